"""Grade the honest class: right work earns full marks in whatever form, and other work is told what is wrong and why.

Ways that touch different cells share a submission. Where a submission is not as expected, each of its ways is graded
alone, and the faulty one fails. Ways that differ in the file only are read and merged, not run: the same cells would
run. ``benchmarks/honest.py`` grades each way alone, and runs all at home, too.
"""

import importlib.util
import json
import unicodedata
from functools import cached_property

import honest_packings
import honest_words
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

CELL_TIMEOUT = 45  # s: one of them never ends; a busy machine needs half of it for the grey-box fit of 03
PANDAS = importlib.util.find_spec("pandas") is not None
SOLVED = solved_notebooks(ROOT)
#: Words and pictures that are marked, and shown in a feedback, all the same.
_SHOWN = {"pictures-pasted"}
_ONLY_OF_THE_FILE = {"everything-lost-as-by-kaggle", "written-otherwise", "whole-course-folder"}
READ = [
    *honest_packings.WAYS,
    *(way for way in honest_words.WAYS if way.name not in _SHOWN),
    *(way for way in RIGHT if way.name in _ONLY_OF_THE_FILE),
]
_READ = {way.name for way in READ}
RUN = [way for way in (*RIGHT, *WRONG) if way.name not in _READ and way.pandas in (None, PANDAS)]
BUILDS_ON_ALL = {"Table 3"}  # many ways lose points of it, each of them other ones
#: The cell had assigned all that is recorded before it stopped.
KEPT_BEFORE_IT_STOPPED = {"endless-loop", "import-in-a-locked-cell"}


def named(name):
    return next(way for way in RUN if way.name == name)


def graded_here(ways, place, solved=SOLVED):
    return grade(ways, solved, place, "--jobs", "2", "--cell-timeout", str(CELL_TIMEOUT))


class Shared:
    """The ways in few submissions. Right ways share one if they touch different cells; wrong ways, if they also lose
    points of different questions."""

    def __init__(self, place):
        right = packed([way for way in RUN if way.change and not way.lost], lambda way: touched(way, SOLVED))
        wrong = packed(
            [way for way in RUN if way.change and way.lost],
            lambda way: touched(way, SOLVED) | (way.lost - BUILDS_ON_ALL),
        )
        self.place = place
        self.packs = [*right, *wrong, *([way] for way in RUN if not way.change)]
        self.hand_ins = [together(pack) if pack[0].change else pack[0] for pack in self.packs]

    @cached_property
    def graded(self):
        return graded_here(self.hand_ins, self.place)

    def hand_in(self, way):
        """Return the submission that a way is part of."""
        return next(one for pack, one in zip(self.packs, self.hand_ins, strict=True) if way in pack)


@pytest.fixture(scope="module")
def shared(tmp_path_factory, sandbox):
    return Shared(tmp_path_factory.mktemp("honest"))


def faults(graded, hand_in):
    """Return what is not as expected: messages that are missing, points lost elsewhere, problems with right work."""
    found = {"not told": graded.not_told(hand_in)}
    for student in (hand_in.student, *hand_in.others):
        marks = graded.of(student)
        found[student, "lost"] = [why for question, why in marks.lost.items() if question not in hand_in.lost]
        if not hand_in.lost:
            found[student, "problems"] = marks.problems if marks.marks else ["not graded", *graded.ignored]
    return {what: which for what, which in found.items() if which}


def costs_nothing(graded, hand_in, way):
    """Say whether a change that should lose points loses none of those that the machine gives."""
    if not way.change or way.name in KEPT_BEFORE_IT_STOPPED:
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


@pytest.mark.scheduled
def test_an_answers_json_that_goes_along_changes_nothing_that_is_expected(shared, tmp_path):
    with Gradebook(shared.graded.place / "book.sqlite") as book:
        answers = book.current(shared.hand_in(named("plain")).student).run.answers
    ways = [way for way in RUN if way.answers_json]
    graded = graded_here(ways, tmp_path, SOLVED | {"answers.json": json.loads(answers)})
    assert {way.name: found for way in ways if (found := faults(graded, way))} == {}


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
    for student in (way.student, *way.others):
        (submission,) = [one for one in found.submissions if one.student.casefold() == _composed(student)]
        read = intake.read(submission, names, masters)
        assert [*submission.problems, *read.problems()] == []
        hand_in, _notes = intake.newest(read.items, names)
        assert _run_of(made, hand_in.notebooks) == _run_of(made, plain)
        assert [name for name in hand_in.files if name.endswith(".py")] == []
        own_words = way in honest_words.WAYS
        said, wanted = _words_of(made, hand_in.notebooks, hand_in.files), _words_of(made, plain)
        assert said.keys() == wanted.keys()
        assert own_words or said == wanted


def _run_of(made, notebooks):
    """The cells that are run, but for the first, in which an ID may stand: what it says is replaced."""
    merged = merge.merged(made.pristine, notebooks).notebooks
    return {
        name: [cell["source"].strip() for cell in notebook["cells"] if "parameters" not in cell["metadata"]["tags"]]
        for name, notebook in merged.items()
    }


def _words_of(made, notebooks, files=None):
    """What is answered in words, by (question, part); there is nothing to say against any."""
    written = [words.written(master["cells"], notebooks[name], files) for name, master in made.pristine.items()]
    assert [told for one in written for told in one.problems] == []
    return {where: said.text for one in written for where, said in one.words.items()}


def _composed(student):
    return unicodedata.normalize("NFC", student).casefold()


#: Checked at home, with what shares a submission with it; in `make test-all` with kernels, too.
SEEN = ("magics", "name-error")


@pytest.fixture(scope="module")
def home(tmp_path_factory):
    return students_installation(tmp_path_factory.mktemp("home") / "course")


@pytest.mark.parametrize(
    ("name", "way"),
    [*((name, "warm") for name in SEEN), pytest.param(SEEN[-1], "kernels", marks=pytest.mark.scheduled)],
)
def test_what_is_seen_at_home_is_what_grading_finds(shared, home, name, way):
    graded, student = shared.graded, shared.hand_in(named(name)).student
    seen = at_home(graded.place / "in" / student, student, home, CELL_TIMEOUT, way=way)
    with Gradebook(graded.place / "book.sqlite") as book:
        found = when_graded(book, student)
    assert (seen.recorded, seen.stops) == (found.recorded, found.stops)


@pytest.mark.scheduled
def test_check_warns_of_a_package_that_grading_does_not_have(shared, home, tmp_path):
    if PANDAS:
        pytest.skip("pandas is installed here, so that it is there where grading runs, too")
    graded, student = shared.graded, shared.hand_in(named("pandas-missing")).student
    for folder, name, content in (
        ("pandas", "__init__.py", "class DataFrame(dict):\n    pass\n"),
        ("pandas-9.dist-info", "METADATA", "Metadata-Version: 2.1\nName: pandas\nVersion: 9\n"),
        ("pandas-9.dist-info", "top_level.txt", "pandas\n"),
    ):
        (tmp_path / folder).mkdir(exist_ok=True)
        (tmp_path / folder / name).write_text(content)
    seen = at_home(graded.place / "in" / student, student, home, CELL_TIMEOUT, tmp_path)
    assert any(note.startswith("pandas ") for note in seen.notes)
    assert any("pandas" in line and "not installed" in line for line in graded.of(student).problems)
