"""Why answers are missing: the words that a student and an instructor read."""

import pytest

from rotflex.courseware.catalogue import Catalogue
from rotflex.courseware.parts import Question, number
from rotflex.courseware.run.cell_reports import LEFT, CellError, CellReport, Refusal, Reports
from rotflex.courseware.run.handed_in import CODE, Cell, as_released
from rotflex.courseware.run.merge import merged
from rotflex.courseware.run.reasons import Claim, explain

ONE, TWO = "1_one.ipynb", "2_two.ipynb"


def question(name, notebook):
    return Question(name, "1", notebook.removesuffix(".ipynb"), "", (), (number("x", "", None, "", ""),))


CATALOGUE = Catalogue([question("1", ONE), question("2", ONE), question("3", TWO), question("4", TWO)])


def asked(name, variable, stub):
    grading = {"nbgrader": {"grade_id": f"q{name}", "solution": True}}
    return [
        {"id": f"q{name}", "cell_type": CODE, "source": stub, "metadata": grading},
        {
            "id": f"q{name}-answer",
            "cell_type": CODE,
            "source": f'lab.answer("{name}", x={variable})',
            "metadata": {},
        },
    ]


def fetched(name, variable):
    """A cell of the course's that gets an earlier answer."""
    return {
        "id": f"get-{name}",
        "cell_type": CODE,
        "source": f'{variable} = lab.value("{name}", "x", default=None)',
        "metadata": {},
    }


PRISTINE = {
    ONE: {"cells": [*asked("1", "a", "a = None"), *asked("2", "b", "b = None")]},
    TWO: {"cells": [fetched("2", "b"), *asked("3", "c", "c = None"), *asked("4", "d", "d = None")]},
}
NAME = CellError("NameError", "name 'omgea' is not defined", 3)


def told(answers, reports, recorded, claim=None, added=(), handed_in=(ONE, TWO), refusals=(), seconds=60):
    """``answers``: cell → source. ``reports``: cell → error (or "died"), or what it lacked."""
    cells = {name: as_released(PRISTINE[name], answers) for name in handed_in}
    for name, place, cell in added:
        mine = list(cells[name])
        mine.insert(place, cell)
        cells[name] = tuple(mine)
    made = merged(PRISTINE, cells)
    found = []
    for name, notebook in made.notebooks.items():
        for cell in notebook["cells"]:
            what = reports.get(cell["id"])
            if what == "not run":
                break
            error = what if isinstance(what, CellError) else None
            lacked = what if isinstance(what, tuple) else ()
            found.append(CellReport(name, cell["id"], what != "died", error, lacked))
    return explain(
        PRISTINE,
        made,
        Reports(tuple(found), tuple(refusals)),
        {(number, "x") for number in recorded},
        CATALOGUE,
        handed_in=handed_in,
        claim=claim,
        seconds=seconds,
    )


def test_nothing_is_said_where_all_is_well():
    found = told({"q1": "a = 1"}, {}, "1234", claim=Claim({"1": {"x": "q1-answer"}}))
    assert (found.missing, found.stops, found.lost) == ({}, (), ())


def test_what_was_left_empty_needs_no_reason():
    assert told({}, {}, "").missing == {}


def test_what_stopped_and_all_that_builds_on_it():
    answers = {"q1": "a = 1\n\na = omgea", "q2": "b = a + 1", "q3": "c = b * 2", "q4": "d = c + 1"}
    none = CellError("TypeError", "unsupported operand", 1)
    found = told(
        answers,
        {
            "q1": NAME,
            "q1-answer": CellError("NameError", "name 'a' is not defined"),
            "q2": none,
            "get-2": (("2", "x"),),
            "q3": none,
            "q4": none,
        },
        "",
    )
    assert found.stops == ("1 stopped: NameError, name 'omgea' is not defined, line 3; 2, 3 and 4 build on it.",)
    assert found.missing["1", "x"] == "1 stopped: NameError, name 'omgea' is not defined, line 3."
    assert found.missing["4", "x"] == (
        "It builds on what stopped before it: 1 (NameError, name 'omgea' is not defined, line 3)."
    )


def test_two_causes_are_told_apart():
    answers = {"q1": "a = omgea", "q2": "b = undefined"}
    found = told(answers, {"q1": NAME, "q2": CellError("NameError", "name 'undefined' is not defined", 1)}, "34")
    assert len(found.stops) == 2


def test_what_builds_on_an_answer_that_was_never_given():
    found = told({"q3": "c = b + 1"}, {"get-2": (("2", "x"),), "q3": CellError("TypeError", "None", 1)}, "1")
    assert found.missing["3", "x"] == "It builds on 2, which is not answered."
    assert found.stops == ()


def test_a_helper_cell_of_the_students():
    helper = Cell("mine", "", CODE, "import pandas\ntable = 1")
    error = CellError("ModuleNotFoundError", "No module named 'pandas.io'", 1)
    found = told(
        {"q1": "a = table"},
        {"mine": error, "q1": CellError("NameError", "name 'table' is not defined", 1)},
        "234",
        added=[(ONE, 0, helper)],
    )
    assert found.stops == (
        "Your own cell before 1 stopped: pandas is not installed where grading runs, and no file of that name was "
        "handed in, line 1.",
    )


def test_a_cell_of_no_consequence_is_not_held_against_anybody():
    found = told({"q1": "a = 1"}, {"mine": NAME}, "1234", added=[(ONE, 4, Cell("mine", "", CODE, "omgea"))])
    assert found.stops == ()
    assert found.harmless == (
        "Your own cell mine in 1_one.ipynb stopped: NameError, name 'omgea' is not defined, line 3; no answer is "
        "missing for it.",
    )


@pytest.mark.parametrize(
    ("error", "words"),
    [
        (CellError("KeyboardInterrupt", "", 2), "1 stopped: it took longer than 60 s and was stopped, line 2."),
        (
            CellError("LimitExceeded", "The deflection reached 30.7 deg at t = 1 s.\nStopped.", 2),
            "1 stopped: your bench stopped: The deflection reached 30.7 deg at t = 1 s. Stopped, line 2.",
        ),
        (CellError("SyntaxError", "invalid syntax", 4), "1 stopped: SyntaxError, invalid syntax, line 4."),
        (CellError("Odd", "", None), "1 stopped: Odd."),
    ],
)
def test_errors_in_words(error, words):
    assert told({"q1": "a = 1"}, {"q1": error}, "234").stops == (words,)


def test_a_process_that_died_takes_the_rest_of_its_notebook_along():
    found = told({"q1": "a = 1"}, {"q1": "died", "q1-answer": "not run"}, "34")
    assert found.stops == (
        "1 stopped: the Python process ended in it, and nothing after it in this notebook was run; 2 builds on it.",
    )


def test_a_cell_that_ends_python_takes_the_rest_of_its_notebook_along():
    found = told({"q1": "exit()"}, {"q1": CellError(LEFT, ""), "q1-answer": "not run"}, "34")
    (stop,) = found.stops
    assert stop.startswith("1 stopped: it called exit(), which ends Python") and stop.endswith("; 2 builds on it.")


def test_an_answer_that_was_given_and_not_recorded():
    found = told({"q1": "a = 'x'"}, {}, "234", refusals=[Refusal("1", "x", "it is text")])
    assert found.missing["1", "x"] == "It was given, and not recorded: it is text."


@pytest.mark.parametrize(
    ("claim", "handed_in", "why"),
    [
        (Claim({"1": {"x": ""}}), (ONE, TWO), "by the button of an explorer or by hand"),
        (Claim({"1": {"x": "gone"}}), (ONE, TWO), "the cell that did it, gone, is no longer in 1_one.ipynb"),
        (Claim({"1": {"x": "q1-answer"}}), (ONE, TWO), "1_one.ipynb, run from top to bottom, leaves it empty"),
        (Claim({"1": {"x": "q1-answer"}}), (TWO,), "1_one.ipynb was not handed in"),
        (Claim({"1": {"x": ""}}, knows_cells=False), (ONE, TWO), "run from top to bottom, leaves it empty"),
    ],
)
def test_what_was_recorded_at_home_and_is_missing(claim, handed_in, why):
    found = told({}, {}, "234", claim=claim, handed_in=handed_in)
    (line,) = found.lost
    assert line.startswith("Recorded at home and missing here: 1 x; ") and why in line
    assert why in found.missing["1", "x"]


def test_of_what_stopped_it_is_not_said_again_that_it_was_recorded_at_home():
    found = told({"q1": "a = omgea"}, {"q1": NAME}, "234", claim=Claim({"1": {"x": "q1-answer"}}))
    assert found.lost == () and len(found.stops) == 1
