"""A student's notebook beside the course's own: which cell is which, whatever an editor or a student did to it."""

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from labcourse.answers.notebooks import CODE, TEXT, Cell
from labcourse.run.alignment import OPEN, Happened, Role, align, count_changed


def course_cell(name, source, kind=CODE, solution=False, tags=()):
    grading = {"grade_id": name, "solution": solution}
    metadata = {"nbgrader": grading} if kind == CODE and PARAMETERS not in tags else {}
    return {"id": name, "cell_type": kind, "source": source, "metadata": {**metadata, "tags": list(tags)}}


PARAMETERS = "parameters"
MASTER = [
    course_cell("title", "# Title", TEXT),
    course_cell("parameters", 'student = ""', tags=[PARAMETERS]),
    course_cell("setup", "lab = start()"),
    course_cell("q1-text", "What is x?", TEXT),
    course_cell("q1", "x = None", solution=True),
    course_cell("q1-answer", 'lab.answer("1", x=x)'),
    course_cell("q2-text", "What is y?", TEXT),
    course_cell("q2", "y = None", solution=True),
    course_cell("q2-answer", 'lab.answer("2", y=y)'),
    course_cell("end", "That is all.", TEXT),
]
NAMES = [cell["id"] for cell in MASTER]


def handed_in():
    return [
        Cell(cell["id"], cell["metadata"].get("nbgrader", {}).get("grade_id", ""), cell["cell_type"], cell["source"])
        for cell in MASTER
    ]


def at(name):
    return NAMES.index(name)


def own(source="own = 1", kind=CODE):
    return Cell("mine", "", kind, source)


def run_order(cells):
    """The sources of code as they would be run: the course's for its own cells, the student's for all others."""
    found = align(MASTER, cells)
    sources = []
    for one in found.placed:
        if one.role is Role.LOCKED or (one.role is Role.OPEN and one.student is None):
            sources.append(MASTER[one.master]["source"])
        elif one.student is None:
            continue
        elif cells[one.student].kind == CODE:
            sources.append(cells[one.student].source)
    return sources


WHOLE = [cell["source"] for cell in MASTER if cell["cell_type"] == CODE]


def happened(cells):
    return [(change.what, change.cell) for change in align(MASTER, cells).changes]


def test_the_notebook_as_released_is_itself():
    found = align(MASTER, handed_in())
    assert [(one.master, one.student) for one in found.placed] == [(i, i) for i in range(len(MASTER))]
    assert found.changes == ()


@pytest.mark.parametrize("kept", [None, 0, 1, 2])
def test_pieces_of_a_split_cell_are_taken_in_order_whichever_kept_the_id(kept):
    """JupyterLab gives the last piece the id, other editors the first."""
    cells = handed_in()
    pieces = [replace(cells[at("q1")], id="q1" if i == kept else f"new{i}", source=f"x{i} = {i}") for i in range(3)]
    between = [] if kept == 0 else [own()]
    cells[at("q1") : at("q1") + 1] = [*pieces[:2], *between, pieces[2]]
    sources = ["x0 = 0", "x1 = 1", *(cell.source for cell in between), "x2 = 2"]
    assert run_order(cells) == [*WHOLE[:2], *sources, *WHOLE[3:]]
    placed = align(MASTER, cells).placed
    assert [one.role for one in placed if one.master == at("q1")] == [Role.ANSWER] * 3


def change(cells, name, **changes):
    cells[at(name)] = replace(cells[at(name)], **changes)


def without(cells, name, place="q1", *added):
    del cells[at(name)]
    cells[at(place) : at(place)] = added


def move(cells, name, to=None):
    cells.insert(len(cells) if to is None else to, cells.pop(at(name)))


LOCKED_COPY = Cell("new", "setup", CODE, "lab2 = start()")
#: What somebody did to the cells, what is run then, and what is reported of it.
DONE = {
    "a cell of one's own": (lambda cells: cells.insert(at("q1"), own()), [*WHOLE[:2], "own = 1", *WHOLE[2:]], []),
    "a locked cell changed": (
        lambda cells: change(cells, "setup", source="lab = forged()"),
        WHOLE,
        [(Happened.CHANGED, "setup")],
    ),
    "white space at the ends of lines": (lambda cells: change(cells, "setup", source="lab = start()  \r\n"), WHOLE, []),
    **{
        f"{name} deleted": (lambda cells, name=name: without(cells, name), WHOLE, [(Happened.MISSING, name)])
        for name in ("setup", "q1-answer", "parameters", "q2-answer")
    },
    "what records deleted, a cell put there": (
        lambda cells: without(cells, "q1-answer", "q1-answer", own("x = 3")),
        [*WHOLE[:3], "x = 3", *WHOLE[3:]],
        [(Happened.MISSING, "q1-answer")],
    ),
    "the answer deleted, and given elsewhere": (
        lambda cells: without(cells, "q1", "q1-text", own("x = 5")),
        [*WHOLE[:2], "x = 5", *WHOLE[3:]],
        [(Happened.MISSING, "q1")],
    ),
    "a new cell in the answer's place": (
        lambda cells: without(cells, "q1", "q1", own("x = 5")),
        [*WHOLE[:2], "x = 5", *WHOLE[3:]],
        [(Happened.RENAMED, "q1")],
    ),
    "the answer behind what records it": (lambda cells: move(cells, "q1", at("q1-answer")), WHOLE, []),
    "the answer moved to the end": (lambda cells: move(cells, "q1"), [*WHOLE[:2], *WHOLE[4:], WHOLE[2], WHOLE[3]], []),
    "a cell of the course's moved away": (lambda cells: move(cells, "setup"), WHOLE, [(Happened.MOVED, "setup")]),
    "texts deleted": (
        lambda cells: [cells.pop(at(name)) for name in ("end", "q2-text", "q1-text", "title")],
        WHOLE,
        [(Happened.MISSING, name) for name in ("title", "q1-text", "q2-text", "end")],
    ),
    "an answer cell made a text": (
        lambda cells: change(cells, "q1", kind=TEXT),
        [*WHOLE[:2], *WHOLE[3:]],
        [(Happened.OTHER_KIND, "q1")],
    ),
    "a locked cell copied and changed": (
        lambda cells: cells.insert(at("q1"), LOCKED_COPY),
        [*WHOLE[:2], "lab2 = start()", *WHOLE[2:]],
        [],
    ),
}


@pytest.mark.parametrize("what", DONE)
def test_the_courses_code_is_run_in_its_place_and_a_students_where_it_stands(what):
    edit, order, told = DONE[what]
    cells = handed_in()
    edit(cells)
    assert run_order(cells) == order
    assert happened(cells) == told


def test_a_copy_elsewhere_is_no_piece_and_does_not_take_the_recorder_along():
    cells = handed_in()
    copy = replace(cells[at("q1")], id="new", source="x = 7  # scratch")
    cells.append(copy)
    assert run_order(cells) == [*WHOLE, "x = 7  # scratch"]
    cells[at("q1")] = replace(cells[at("q1")], id="other")  # both have new ids
    assert run_order(cells) == [*WHOLE, "x = 7  # scratch"]


@pytest.mark.parametrize("place", ["title", "setup", "q1-text", "q2-text", "end"])
@pytest.mark.parametrize("lower", [0, 1])
def test_a_copy_beyond_a_cell_of_the_courses_is_no_piece_above_or_below(place, lower):
    cells = handed_in()
    copy = replace(cells[at("q1")], id="new", source="x = 7  # scratch")
    here = at(place) + lower
    cells.insert(here, copy)
    found = align(MASTER, cells).placed
    between = NAMES[here : at("q1")] or NAMES[at("q1") + 1 : here]
    assert [one.role for one in found if one.student == here] == [Role.ADDED if between else Role.ANSWER]
    sources = run_order(cells)
    assert sorted(sources) == sorted([*WHOLE, copy.source]) and [one for one in sources if one != copy.source] == WHOLE


@pytest.mark.parametrize("lost", ["id", "both"])
def test_names_that_an_editor_lost(lost):
    cells = [replace(cell, id="", grade_id="" if lost == "both" else cell.grade_id) for cell in handed_in()]
    answer = at("q1")
    cells[answer] = replace(cells[answer], source="x = 5")
    assert run_order(cells) == [*WHOLE[:2], "x = 5", *WHOLE[3:]]
    expected = [(Happened.RENAMED, "q1")] if lost == "both" else []
    assert happened(cells) == expected


def test_a_text_with_the_words_of_the_courses_code_is_not_that_code():
    cells = [replace(cell, id="", grade_id="") for cell in handed_in()]
    change(cells, "setup", kind=TEXT)
    assert happened(cells) == [(Happened.MISSING, "setup")]


@given(st.data())
def test_nothing_is_lost_and_nothing_comes_twice(data):
    """However cells are mixed, dropped, doubled, renamed: each is placed once, and the course's code is all there."""
    pool = [*handed_in(), own(), own("z = 2"), *(replace(cell, id="") for cell in handed_in())]
    cells = data.draw(st.lists(st.sampled_from(pool), max_size=15))
    found = align(MASTER, cells)
    masters = {one.master for one in found.placed if one.master is not None}
    assert masters == set(range(len(MASTER)))
    students = [one.student for one in found.placed if one.student is not None]
    assert len(students) == len(set(students))
    kept = {
        number for number, one in enumerate(cells) if one.kind == CODE and not one.grade_id and one.id != "parameters"
    }
    pieces = {one.student for one in found.placed if one.role in (Role.ANSWER, Role.ADDED)}
    assert kept - pieces <= {number for number, one in enumerate(cells) if one.source == 'student = ""'}
    order = [one.master for one in found.placed]
    for recorder in (at("q1-answer"), at("q2-answer")):
        answers = [i for i, one in enumerate(order) if one == recorder - 1]
        if all(found.placed[i].student is not None for i in answers):
            assert max(answers) < order.index(recorder)


def test_an_answer_that_was_moved_with_what_records_it_stays_there_and_draws_no_other_cell_along():
    cells = handed_in()
    pair = [cells.pop(at("q2")), cells.pop(at("q2"))]
    moved = [*cells[: at("q1-text")], *pair, *cells[at("q1-text") :]]
    found = align(MASTER, moved)
    assert found.changes == ()
    assert [one.student for one in found.placed] == list(range(len(moved)))
    # And the cell after the pair, where it is missing, comes back where the others before it are.
    without_end = moved[:-1]
    assert align(MASTER, without_end).placed[-1].master == at("end")


def with_source(name, source):
    return [replace(cell, source=source) if cell.id == name else cell for cell in handed_in()]


WITH_OPEN = [
    *MASTER,
    course_cell("draw", "draw()", tags=[OPEN]),
    course_cell("words", "Write here.", TEXT, solution=True),
]
WITH_OPEN[-1]["metadata"]["nbgrader"] = {"grade_id": "words", "solution": True}


@pytest.mark.parametrize(
    ("cells", "changed"),
    [
        (handed_in(), 0),
        (with_source("parameters", 'student = "ada"'), 0),
        (with_source("setup", "lab = start()\nx = 1"), 0),
        (with_source("q1-answer", 'lab.answer("1", x=3)'), 0),
        (with_source("q1-text", "What is z?"), 0),
        (with_source("q1", "  x = None \n\n"), 0),
        (with_source("q1", ""), 0),
        (handed_in()[:3], 0),
        (with_source("q1", "x = 1"), 1),
        ([*with_source("q1", "x = 1"), own()], 2),
        ([*handed_in(), own("I see a spring.", TEXT)], 1),
        ([*handed_in(), own(" \n")], 0),
        ([*handed_in(), Cell("draw", "", CODE, "draw(2)")], 1),
        ([*handed_in(), Cell("words", "words", TEXT, "It bends.")], 1),
        ([*handed_in(), Cell("words", "words", TEXT, "Write here.")], 0),
    ],
)
def test_changed_is_what_a_student_wrote_where_students_write(cells, changed):
    assert count_changed(WITH_OPEN, cells) == changed
