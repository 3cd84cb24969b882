"""Grade the honest class: right work earns full marks in whatever form, and other work is told what is wrong and why.

Ways that touch different cells share a submission. Where a submission is not as expected, each of its ways is graded
alone, and the faulty one fails. Ways that differ in the file only are read and merged, not run: the same cells would
run. ``benchmarks/honest.py`` grades each way alone, and runs all at home, too.
"""

from functools import cached_property

import pytest
from checkout import ROOT
from honest_checks import at_home, students_installation, when_graded
from honest_class import RIGHT, WRONG, solved_notebooks
from honest_hand_in import together, touched
from honest_marks import WAITING, build, grade
from made_courses import OURS
from packs import packed

from labcourse.answers import words
from labcourse.answers.notebooks import as_released
from labcourse.grading import intake
from labcourse.grading.gradebook import Gradebook
from labcourse.grading.running import bundle
from labcourse.run import merge

pytestmark = pytest.mark.slow

CELL_TIMEOUT = 45  # s: a busy machine needs half of it for the grey-box fit of 03
SOLVED = solved_notebooks(ROOT)
#: What differs in the file only.
READ = [way for way in RIGHT if not way.change or way.name == "everything-lost-as-by-kaggle"]
_READ = {way.name for way in READ}
RUN = [way for way in (*RIGHT, *WRONG) if way.name not in _READ]
BUILDS_ON_ALL = {"Table 3"}  # many ways lose points of it, each of them other ones


def graded_here(ways, place):
    """Grade a class of these ways."""
    return grade(ways, SOLVED, place, "--jobs", "2", "--cell-timeout", str(CELL_TIMEOUT))


class Shared:
    """The ways in few submissions. Right ways share one if they touch different cells; wrong ways, if they also lose
    points of different questions."""

    def __init__(self, ways, place):
        right = packed([way for way in ways if way.change and not way.lost], lambda way: touched(way, SOLVED))
        wrong = packed(
            [way for way in ways if way.change and way.lost],
            lambda way: touched(way, SOLVED) | (way.lost - BUILDS_ON_ALL),
        )
        self.place = place
        self.packs = [*right, *wrong, *([way] for way in ways if not way.change)]
        self.hand_ins = [together(pack) if pack[0].change else pack[0] for pack in self.packs]

    @cached_property
    def graded(self):
        """The class, graded by the command."""
        return graded_here(self.hand_ins, self.place)

    def hand_in(self, way):
        """Return the submission that a way is part of."""
        return next(one for pack, one in zip(self.packs, self.hand_ins, strict=True) if way in pack)


@pytest.fixture(scope="module")
def shared(tmp_path_factory, sandbox):
    return Shared(RUN, tmp_path_factory.mktemp("honest"))


def faults(graded, hand_in):
    """Return what is not as expected: messages that are missing, points lost elsewhere, problems with right work."""
    found = {"not told": graded.not_told(hand_in)}
    marks = graded.of(hand_in.student)
    found["lost"] = [why for question, why in marks.lost.items() if question not in hand_in.lost]
    if not hand_in.lost:
        found["problems"] = marks.problems if marks.marks else ["not graded", *graded.ignored]
    return {what: which for what, which in found.items() if which}


def costs_nothing(graded, hand_in, way):
    """Say whether a change that should lose points loses none of those that the machine gives."""
    if not way.change:
        return False
    marks = graded.of(hand_in.student)
    mine = {one["question"] for one in marks.marks if one["question"] in way.lost and one["status"] != WAITING}
    return bool(mine) and not mine & marks.lost.keys()


def test_ways_that_share_a_hand_in_do_not_disturb_each_other(shared):
    found = {one.name: faults(shared.graded, one) for one in shared.hand_ins}
    assert {name: one for name, one in found.items() if one} == {}


@pytest.mark.parametrize("way", RUN, ids=str)
def test_who_did_right_has_full_marks_and_who_did_wrong_is_told_what(shared, way, tmp_path):
    hand_in = shared.hand_in(way)
    if found := faults(shared.graded, hand_in):
        assert faults(graded_here([way], tmp_path / "alone"), way) == {}, found
    assert not costs_nothing(shared.graded, hand_in, way)


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    """What is found of a class of all that are read."""
    place = tmp_path_factory.mktemp("read")
    roster = build(READ, SOLVED, place / "in")
    with Gradebook(place / "book.sqlite") as book:
        assert book.import_roster(roster).problems == ()
        return intake.find(place / "in", book.students())


@pytest.fixture(scope="module")
def made():
    return bundle.build(OURS)


@pytest.mark.parametrize("way", READ, ids=lambda way: way.name)
def test_however_it_is_packed_named_and_saved_the_same_is_run(found, made, way):
    names = tuple(made.pristine)
    masters = {name: {cell["id"]: cell for cell in notebook["cells"]} for name, notebook in made.pristine.items()}
    plain = {name: as_released(SOLVED[name]) for name in names}
    (submission,) = [one for one in found.submissions if one.student == way.student]
    intake.read(submission, names, masters)
    assert [*submission.problems, *intake.unread_problems(submission)] == []
    intake.choose_newest(submission, submission.items, names)
    assert _run_of(made, submission.notebooks) == _run_of(made, plain)
    assert [name for name in submission.files if name.endswith(".py")] == []
    assert _words_of(made, submission.notebooks) == _words_of(made, plain)


def _run_of(made, notebooks):
    """The cells that are run, but for the first, in which an ID may stand: what it says is replaced."""
    merged = merge.merged(made.pristine, notebooks).notebooks
    return {
        name: [cell["source"].strip() for cell in notebook["cells"] if "parameters" not in cell["metadata"]["tags"]]
        for name, notebook in merged.items()
    }


def _words_of(made, notebooks):
    """What is answered in words, by (question, part); there is nothing to say against any."""
    written = [words.written(master["cells"], notebooks[name]) for name, master in made.pristine.items()]
    assert [told for one in written for told in one.problems] == []
    return {where: said.text for one in written for where, said in one.words.items()}


@pytest.fixture(scope="module")
def home(tmp_path_factory):
    return students_installation(tmp_path_factory.mktemp("home") / "course")


@pytest.mark.parametrize("name", ["name-error", pytest.param("magics", marks=pytest.mark.scheduled)])
def test_what_is_seen_at_home_is_what_grading_finds(shared, home, name):
    """Of all that shares a submission."""
    graded, student = shared.graded, shared.hand_in(next(way for way in RUN if way.name == name)).student
    seen = at_home(graded.place / "in" / student, student, home, CELL_TIMEOUT)
    with Gradebook(graded.place / "book.sqlite") as book:
        found = when_graded(book, student)
    assert (seen.recorded, seen.stops) == (found.recorded, found.stops)
