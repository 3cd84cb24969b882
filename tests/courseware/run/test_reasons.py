"""Why answers are missing: the words that a student and an instructor read."""

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


def test_nothing_is_said_where_all_is_well_or_nothing_was_written():
    found = told({"q1": "a = 1"}, {}, "1234", claim=Claim({"1": {"x": "q1-answer"}}))
    assert (found.missing, found.stops, found.lost) == ({}, (), ())
    assert told({}, {}, "").missing == {}


def name_error(name):
    return CellError("NameError", f"name '{name}' is not defined", 1)


def test_each_reason_in_words(snapshot):
    """What stopped, what builds on it, and what is missing: which questions are named is checked below."""
    chain = {"q1": "a = 1\n\na = omgea", "q2": "b = a + 1", "q3": "c = b * 2", "q4": "d = c + 1"}
    none = CellError("TypeError", "unsupported operand", 1)
    broken = {"q1": NAME, "q1-answer": name_error("a"), "q2": none, "get-2": (("2", "x"),), "q3": none, "q4": none}
    helper = Cell("mine", "", CODE, "import pandas\ntable = 1")
    no_module = {"mine": CellError("ModuleNotFoundError", "No module named 'pandas.io'", 1), "q1": name_error("table")}
    bench = CellError("LimitExceeded", "The deflection reached 30.7 deg at t = 1 s.\nStopped.", 2)
    errors = [CellError("KeyboardInterrupt", "", 2), bench, CellError("SyntaxError", "invalid syntax", 4)]
    gone = {"q1-answer": "not run"}
    found = {
        "a chain": told(chain, broken, ""),
        "a helper cell": told({"q1": "a = table"}, no_module, "234", added=[(ONE, 0, helper)]),
        "died": told({"q1": "a = 1"}, {"q1": "died", **gone}, "34"),
        "exit": told({"q1": "exit()"}, {"q1": CellError(LEFT, ""), **gone}, "34"),
        "refused": told({"q1": "a = 'x'"}, {}, "234", refusals=[Refusal("1", "x", "it is text")]),
        "by a button": told({}, {}, "234", claim=Claim({"1": {"x": ""}})),
        "cell gone": told({}, {}, "234", claim=Claim({"1": {"x": "gone"}})),
        "left empty": told({}, {}, "234", claim=Claim({"1": {"x": "q1-answer"}})),
        "not handed in": told({}, {}, "234", claim=Claim({"1": {"x": "q1-answer"}}), handed_in=(TWO,)),
        "cells unknown": told({}, {}, "234", claim=Claim({"1": {"x": ""}}, knows_cells=False)),
        **{error.type: told({"q1": "a = 1"}, {"q1": error}, "234") for error in [*errors, CellError("Odd", "", None)]},
    }
    assert found["a chain"].missing.keys() == {(number, "x") for number in "1234"}
    assert {name: [*one.stops, *one.lost, *one.missing.values()] for name, one in found.items()} == snapshot


def test_two_causes_are_told_apart():
    answers = {"q1": "a = omgea", "q2": "b = undefined"}
    found = told(answers, {"q1": NAME, "q2": CellError("NameError", "name 'undefined' is not defined", 1)}, "34")
    assert len(found.stops) == 2


def test_what_builds_on_an_answer_that_was_never_given():
    found = told({"q3": "c = b + 1"}, {"get-2": (("2", "x"),), "q3": CellError("TypeError", "None", 1)}, "1")
    assert found.missing["3", "x"] == "It builds on 2, which is not answered."
    assert found.stops == ()


def test_a_cell_of_no_consequence_is_not_held_against_anybody():
    found = told({"q1": "a = 1"}, {"mine": NAME}, "1234", added=[(ONE, 4, Cell("mine", "", CODE, "omgea"))])
    assert found.stops == ()
    assert found.harmless == (
        "Your own cell mine in 1_one.ipynb stopped: NameError, name 'omgea' is not defined, line 3; no answer is "
        "missing for it.",
    )


def test_of_what_stopped_it_is_not_said_again_that_it_was_recorded_at_home():
    found = told({"q1": "a = omgea"}, {"q1": NAME}, "234", claim=Claim({"1": {"x": "q1-answer"}}))
    assert found.lost == () and len(found.stops) == 1
