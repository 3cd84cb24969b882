"""Why answers are missing, and under which facts it is said."""

import pytest

from labcourse.answers.catalogue import Catalogue
from labcourse.answers.cell_reports import LEFT, CellError, CellReport, CellReports, Refusal
from labcourse.answers.notebooks import CODE, Cell, as_released
from labcourse.answers.parts import Question, number
from labcourse.problems import Code, Problem, has
from labcourse.run.merge import merged
from labcourse.run.reasons import explain
from labcourse.sentences import sentence

ONE, TWO = "1_one.ipynb", "2_two.ipynb"


def question(name, notebook):
    return Question(name, "1", notebook.removesuffix(".ipynb"), "", (), (number("x", "", None, "", ""),))


CATALOGUE = Catalogue([question("1", ONE), question("2", ONE), question("3", TWO), question("4", TWO)])


def asked(name, variable, stub):
    grading = {"nbgrader": {"grade_id": f"q{name}", "solution": True}}
    return [
        {"id": f"q{name}", "cell_type": CODE, "source": stub, "metadata": grading},
        {"id": f"q{name}-answer", "cell_type": CODE, "source": f'lab.answer("{name}", x={variable})', "metadata": {}},
    ]


def fetched(name, variable):
    source = f'{variable} = lab.value("{name}", "x", default=None)'
    return {"id": f"get-{name}", "cell_type": CODE, "source": source, "metadata": {}}


PRISTINE = {
    ONE: {"cells": [*asked("1", "a", "a = None"), *asked("2", "b", "b = None")]},
    TWO: {"cells": [fetched("2", "b"), *asked("3", "c", "c = None"), *asked("4", "d", "d = None")]},
}
NAME = CellError("NameError", "name 'omgea' is not defined", 3)
NO_VALUE = Refusal("1", "x", "")


def raised(kind, text="", line=None):
    return Problem.of(Code.RAISED, type=kind, text=text, line=line)


def stop(cell, question, why, code=Code.CELL_STOPPED, role="answer", notebook=ONE, **more):
    return Problem.of(code, cell=cell, question=question, notebook=notebook, role=role, why=why, **more)


def told(answers, reports, recorded, claim=None, added=(), handed_in=(ONE, TWO), refusals=(), seconds=60, python=None):
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
        CellReports(tuple(found), tuple(refusals)),
        {(number, "x") for number in recorded},
        CATALOGUE,
        handed_in=handed_in,
        claim=claim,
        seconds=seconds,
        python=python,
    )


def test_nothing_is_said_where_all_is_well_or_nothing_was_written():
    found = told({"q1": "a = 1"}, {}, "1234", claim={"1": {"x": "q1-answer"}})
    assert (found.missing, found.stops, found.lost) == ({}, (), ())
    assert told({}, {}, "").missing == {}


def name_error(name):
    return CellError("NameError", f"name '{name}' is not defined", 1)


def test_each_reason_names_the_question_the_error_and_its_line():
    def of_one(error, **options):
        return told({"q1": "a = 1"}, {"q1": error, **options}, "34" if options else "234")

    gone = {"q1-answer": "not run"}
    died, exited = of_one("died", **gone), of_one(CellError(LEFT, ""), **gone)
    for found, why in ((died, Problem.of(Code.PYTHON_ENDED)), (exited, Problem.of(Code.LEFT_PYTHON))):
        first = stop("q1", "1", why)
        assert found.missing == {("1", "x"): first, ("2", "x"): stop("q1", "1", why, Code.BUILDS_ON_STOPPED)}
        assert found.stops == (stop("q1", "1", why, building=["2"]),)
        assert found.roots == {("1", "x"): first, ("2", "x"): first}
    bench = CellError("LimitExceeded", "The deflection reached 30.7 deg at t = 1 s.\nStopped.", 2)
    text = "The deflection reached 30.7 deg at t = 1 s. Stopped"
    for error, why in (
        (CellError("KeyboardInterrupt", "", 2), Problem.of(Code.TOOK_TOO_LONG, seconds=60, line=2)),
        (bench, Problem.of(Code.BENCH_STOPPED, text=text, line=2)),
        (CellError("SyntaxError", "invalid syntax", 4), raised("SyntaxError", "invalid syntax", 4)),
        (CellError("Odd", "", None), Problem.of(Code.RAISED, type="Odd")),
        (CellError("ValueError", "No module named 'x'", 2), raised("ValueError", "No module named 'x'", 2)),
        (
            CellError("FileNotFoundError", "k", 2),
            Problem.of(Code.FILE_NOT_FOUND, type="FileNotFoundError", text="k", line=2),
        ),
    ):
        found = of_one(error)
        assert [*found.missing.values()] == [*found.stops] == [stop("q1", "1", why)]
    refused = told({"q1": "a = 'x'"}, {}, "234", refusals=[Refusal("1", "x", "it is text")])
    assert [*refused.missing.values()] == [Problem.of(Code.REFUSED, why="it is text")]


@pytest.mark.parametrize(
    ("problem", "said"),
    [
        (stop("q1", "1", raised("Odd")), "1 stopped: Odd."),
        (stop("q1", "1", raised("Odd", "x", 2), building=["2"]), "1 stopped: Odd, x, line 2; 2 builds on it."),
        (stop("q1", "1", raised("Odd"), building=["2", "3", "4"]), "1 stopped: Odd; 2, 3 and 4 build on it."),
        (stop("q1", "1", raised("Odd"), building=[*"2345"]), "1 stopped: Odd; 2, 3 and 2 more build on it."),
        (stop("m", "1", raised("Odd"), role="added"), "Your own cell before 1 stopped: Odd."),
        (stop("m", "", raised("Odd"), role="added"), "Your own cell m in 1_one.ipynb stopped: Odd."),
        (stop("get", "1", raised("Odd"), role="locked"), "The course's cell get in 1_one.ipynb stopped: Odd."),
        (
            stop("q1", "1", Problem.of(Code.TOOK_TOO_LONG, seconds=60.0, line=2)),
            "1 stopped: it took longer than 60 s and was stopped, line 2.",
        ),
        (
            stop("q1", "1", Problem.of(Code.LEFT_PYTHON), Code.BUILDS_ON_STOPPED),
            "It builds on what stopped before it: 1 (it called exit(), which ends Python: nothing after it in this "
            "notebook was run).",
        ),
        (Problem.of(Code.REFUSED, why="it is text"), "It was given, and not recorded: it is text."),
    ],
)
def test_each_names_the_cell_the_error_and_its_line(problem, said):
    assert sentence(problem) == said


@pytest.mark.parametrize(("python", "named"), [(None, False), ((3, 8), False), ((3, 99), True)])
def test_a_newer_python_than_the_one_that_grades_is_named(python, named):
    found = told({"q1": "a = 1"}, {"q1": CellError("SyntaxError", "invalid syntax", 4)}, "234", python=python)
    code, needed = (Code.NEWER_PYTHON_NEEDED, "3.99") if named else (Code.RAISED, None)
    for one in (*found.stops, *found.missing.values()):
        assert (one.parameters["why"].code, one.parameters["why"].parameters.get("needed")) == (code, needed)
        assert ("needs Python 3.99" in sentence(one)) is named


def test_what_builds_on_a_cell_that_stopped_names_it_and_a_module_that_lacks_is_told():
    chain = {"q1": "a = 1\n\na = omgea", "q2": "b = a + 1", "q3": "c = b * 2", "q4": "d = c + 1"}
    none = CellError("TypeError", "unsupported operand", 1)
    broken = {"q1": NAME, "q1-answer": name_error("a"), "q2": none, "get-2": (("2", "x"),), "q3": none, "q4": none}
    found = told(chain, broken, "")
    error = raised(NAME.type, NAME.message, 3)
    first, others = stop("q1", "1", error), stop("q1", "1", error, Code.BUILDS_ON_STOPPED)
    assert found.stops == (stop("q1", "1", error, building=["2", "3", "4"]),)
    assert found.missing == {("1", "x"): first, **{(number, "x"): others for number in "234"}}
    assert found.harmless == ()  # what records 1 stopped, too, and its answer is missing
    helper = Cell("mine", "", CODE, "import pandas\ntable = 1")
    no_module = {"mine": CellError("ModuleNotFoundError", "No module named 'pandas.io'", 1), "q1": name_error("table")}
    found = told({"q1": "a = table"}, no_module, "234", added=[(ONE, 0, helper)])
    lacks = Problem.of(Code.MODULE_MISSING, module="pandas.io", at_home=False, line=1)
    assert [*found.missing.values()] == [*found.stops] == [stop("mine", "1", lacks, role="added")]
    assert "pandas.io is not installed where grading runs" in sentence(found.stops[0])


def test_causes_are_told_apart_and_only_what_costs_an_answer_is_a_stop():
    answers = {"q1": "a = omgea", "q2": "b = undefined"}
    assert len(told(answers, {"q1": NAME, "q2": name_error("undefined")}, "34").stops) == 2
    found = told({"q3": "c = b + 1"}, {"get-2": (("2", "x"),), "q3": CellError("TypeError", "None", 1)}, "1")
    assert (found.missing["3", "x"], found.stops) == (Problem.of(Code.BUILDS_ON_UNANSWERED, on="2"), ())
    found = told({"q1": "a = 1"}, {"mine": NAME}, "1234", added=[(ONE, 4, Cell("mine", "", CODE, "omgea"))])
    own = stop("mine", "", raised(NAME.type, NAME.message, 3), Code.STOPPED_WITHOUT_COST, role="added")
    assert (found.stops, found.harmless) == ((), (own,))
    found = told({"q1": "a = omgea"}, {"q1": NAME}, "234", claim={"1": {"x": "q1-answer"}})
    assert found.lost == () and len(found.stops) == 1  # it is not said again that it was recorded at home


def mine(source):
    return Cell("mine", "", CODE, source)


@pytest.mark.parametrize(
    ("q1", "place", "source", "error"),
    [
        ("x = 1", 4, "print(a)", name_error("a")),  # 1 stops on the same name
        ("a = None", 4, "print(a / 2)", CellError("TypeError", "unsupported operand", 1)),
        ("a = None", 0, "print(a)", name_error("a")),
    ],
)
def test_no_stop_on_the_name_of_a_missing_answer_is_said_to_cost_nothing(q1, place, source, error):
    stops = {"mine": error} | ({"q1-answer": name_error("a")} if q1 == "x = 1" else {})
    found = told({"q1": q1}, stops, "234", added=[(ONE, place, mine(source))])
    assert not has(Code.STOPPED_WITHOUT_COST, found.harmless)
    (said,) = found.stops or found.harmless
    assert found.stops or (said.code, said.parameters["on"]) == (Code.STOPPED_ON_UNANSWERED, "1")


def test_what_stops_because_an_answer_of_the_same_notebook_has_no_value_builds_on_that():
    none = CellError("TypeError", "unsupported operand", 1)
    found = told({"q2": "b = a + 1"}, {"q2": none}, "34")
    assert (found.missing["2", "x"], found.stops) == (Problem.of(Code.BUILDS_ON_UNANSWERED, on="1"), ())
    found = told({"q1": "c = 1", "q2": "b = a + 1"}, {"q1-answer": name_error("a"), "q2": name_error("a")}, "34")
    no_name = raised("NameError", "name 'a' is not defined", 1)
    assert found.stops == (stop("q1-answer", "1", no_name, role="recorder", building=["2"]),)
    own = told({"q2": "b = a + 1"}, {"q2": none}, "34", added=[(ONE, 2, mine("a = 3"))])
    assert own.stops == (stop("q2", "2", raised("TypeError", none.message, 1)),)  # they gave it a value themselves


def test_a_stop_in_an_own_cell_costs_no_answer_that_nobody_began():
    found = told({}, {"mine": NAME}, "234", added=[(ONE, 0, mine("y = omgea"))])
    assert ("1", "x") not in found.missing and found.stops == ()
    assert has(Code.STOPPED_WITHOUT_COST, found.harmless)
    begun = told({"q1": "a = y"}, {"mine": NAME, "q1": name_error("y")}, "234", added=[(ONE, 0, mine("y = omgea"))])
    own = stop("mine", "1", raised(NAME.type, NAME.message, 3), role="added")
    assert (begun.harmless, begun.stops) == ((), (own,))


def test_nothing_is_blamed_for_an_answer_in_a_notebook_that_was_not_handed_in():
    found = told({"q2": "b = omgea"}, {"q2": NAME, "get-2": (("2", "x"),)}, "1", handed_in=(ONE,))
    assert [*found.missing] == [("2", "x")]


def test_a_cell_of_the_course_builds_on_an_answer_only_if_the_name_is_not_defined():
    own = {"q3": "e = 1", "q4": "d = 1"}
    undefined = told(own, {"q3-answer": name_error("c"), "q4-answer": name_error("c")}, "12")
    no_name = raised("NameError", "name 'c' is not defined", 1)
    first = stop("q3-answer", "3", no_name, role="recorder", notebook=TWO, building=["4"])
    assert undefined.stops == (first,)
    none = told({"q4": "d = 1"}, {"q4-answer": CellError("TypeError", "unsupported operand", 1)}, "12")
    error = raised("TypeError", "unsupported operand", 1)
    assert none.stops == (stop("q4-answer", "4", error, role="recorder", notebook=TWO),)


#: Each reason → the facts under which it is given; and what else is said or known if one is not there.
WRITTEN = {"q1": "a = None  # later"}
AT_HOME = {"1": {"x": "q1-answer"}}
GIVEN = Refusal("1", "x", "it is text")
ERROR = CellError("TypeError", "unsupported operand", 1)
SAID = {
    Problem.of(Code.LEFT_AS_IT_WAS): (
        {"refusals": [NO_VALUE]},
        [{"refusals": []}, {"refusals": [GIVEN]}, {"answers": WRITTEN}, {"recorded": "1234"}, {"handed_in": (TWO,)}],
    ),
    Problem.of(Code.RUN_AND_EMPTY): (
        {"answers": WRITTEN, "refusals": [NO_VALUE]},
        [{"refusals": []}, {"answers": {}}, {"recorded": "1234"}, {"handed_in": (TWO,)}, {"reports": {"q1": ERROR}}],
    ),
    Problem.of(Code.REFUSED, why="it is text"): (
        {"refusals": [GIVEN]},
        [{"refusals": []}, {"refusals": [NO_VALUE]}, {"recorded": "1234"}],
    ),
    Problem.of(Code.BUILDS_ON_REFUSED, on="2", why="it is text"): (
        {"recorded": "14", "refusals": [Refusal("2", "x", "it is text")], "reports": {"get-2": (("2", "x"),)}},
        [{"refusals": []}, {"reports": {}}, {"recorded": "124"}, {"refusals": [Refusal("2", "x", "")]}],
    ),
    Problem.of(Code.BUILDS_ON_UNANSWERED, on="2"): (
        {"answers": {"q3": "c = b"}, "recorded": "14", "reports": {"get-2": (("2", "x"),)}},
        [{"recorded": "124"}, {"reports": {}}, {"answers": {"q3": "c = None"}, "reports": {}}],
    ),
    Problem.of(Code.NOTEBOOK_NOT_THERE, ONE): (
        {"claim": AT_HOME, "handed_in": (TWO,)},
        [{"handed_in": (ONE, TWO)}, {"claim": {}}, {"recorded": "1234"}],
    ),
    Problem.of(Code.NOTHING_LEFT, ONE): (
        {"claim": AT_HOME},
        [{"refusals": [NO_VALUE]}, {"claim": {}}, {"handed_in": (TWO,)}, {"recorded": "1234"}],
    ),
    Problem.of(Code.NO_CELL_KNOWN, ONE): (
        {"claim": {"1": {"x": ""}}, "refusals": [NO_VALUE]},
        [{"claim": AT_HOME}, {"refusals": []}, {"recorded": "1234"}],
    ),
    Problem.of(Code.CELL_NOT_AMONG, ONE, cell="gone"): (
        {"claim": {"1": {"x": "gone"}}, "refusals": [NO_VALUE]},
        [{"claim": AT_HOME}, {"refusals": []}, {"added": [(ONE, 0, Cell("gone", "", CODE, "1"))]}],
    ),
    Problem.of(Code.RUN_LEAVES_EMPTY, ONE): (
        {"claim": AT_HOME, "refusals": [NO_VALUE]},
        [{"claim": {}}, {"refusals": []}, {"refusals": [GIVEN]}, {"recorded": "1234"}],
    ),
}


@pytest.mark.parametrize("reason", SAID, ids=lambda reason: reason.code)
def test_each_reason_is_given_under_its_facts_and_not_without_them(reason):
    facts, without = SAID[reason]

    def is_given(**more):
        found = told(**{"answers": {}, "reports": {}, "recorded": "234", **facts, **more})
        lost = [one.parameters["why"] for one in found.lost]
        return reason in (*found.missing.values(), *lost)

    assert is_given()
    assert [fact for fact in without if is_given(**fact)] == []
