"""The honest class: who did everything right has full marks, however they did it; who did not, is told what and why.

Ways of which the same cells are run as of the plain one are merged here, which shows that they are, and not run.
``benchmarks/honest.py`` runs them all, and holds what students see at home against it.
"""

from __future__ import annotations

import importlib.util
import unicodedata

import honest_packings
import honest_platforms
import honest_words
import pytest
from checkout import ROOT
from honest_checks import at_home, students_installation, when_graded
from honest_class import RIGHT, WRONG, solved_notebooks
from honest_marks import build, grade
from made_courses import OURS

from rotflex.courseware import words
from rotflex.courseware.run import merge
from rotflex.courseware.run.handed_in import as_released
from rotflex.instructor.gradebook import Gradebook
from rotflex.instructor.running import bundle, intake

pytestmark = pytest.mark.slow

CELL_TIMEOUT = 45  # s: one of them never ends; a busy machine needs half of it for the grey-box fit of 03
PANDAS = importlib.util.find_spec("pandas") is not None
SOLVED = solved_notebooks(ROOT)
#: Words and pictures that are marked, and shown in a feedback, all the same.
_SHOWN = {"pictures-pasted", "every-kind-of-markdown", "words-in-a-split-cell", "text-cell-made-a-code-cell"}
_ONLY_OF_THE_FILE = {
    *("one-id-renewed", "ids-and-metadata-lost", "texts-deleted", "checkpoints-beside", "large-outputs"),
    *("widget-state-saved", "ids-lost-by-an-old-format", "everything-lost-as-by-kaggle", "by-pycharm", "format-3"),
    *("written-otherwise", "virtual-environment-inside", "whole-course-folder"),
}
PACKED = [*honest_packings.WAYS, *honest_platforms.WAYS]
READ = [
    *PACKED,
    *(way for way in honest_words.WAYS if way.name not in _SHOWN),
    *(way for way in RIGHT if way.name in _ONLY_OF_THE_FILE),
]
_READ = {way.name for way in READ}


def possible(ways):
    """As parameters; a way that wants pandas, or none, is skipped where that is not so."""
    return [
        pytest.param(
            way,
            id=way.name,
            marks=pytest.mark.skipif(
                way.pandas not in (None, PANDAS), reason=f"pandas is {'' if PANDAS else 'not '}installed here"
            ),
        )
        for way in ways
    ]


RUN = [way for way in (*RIGHT, *WRONG) if way.name not in _READ and way.pandas in (None, PANDAS)]


@pytest.fixture(scope="module")
def graded(tmp_path_factory, sandbox):
    return grade(RUN, SOLVED, tmp_path_factory.mktemp("honest"), "--jobs", "2", "--cell-timeout", str(CELL_TIMEOUT))


@pytest.mark.parametrize("way", possible(way for way in RIGHT if way.name not in _READ))
def test_who_did_everything_right_has_full_marks_and_no_trouble(graded, way):
    for student in (way.student, *way.others):
        found = graded.of(student)
        assert found.marks, graded.ignored
        assert (found.lost, found.problems) == ({}, [])


@pytest.mark.parametrize("way", possible(WRONG))
def test_who_did_something_wrong_loses_no_more_than_that_and_is_told_what(graded, way):
    assert set(graded.of(way.student).lost) <= way.lost
    assert graded.not_told(way) == [], graded.told(way)


# --- what is read of the same work ------------------------------------------------------------------------------------


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
    masters = {name: [cell["id"] for cell in notebook["cells"]] for name, notebook in made.pristine.items()}
    plain = {name: as_released(SOLVED[name]) for name in names}
    for student in (way.student, *way.others):
        (submission,) = [one for one in found.submissions if one.student.casefold() == _composed(student)]
        read = intake.read(submission, names, masters)
        assert [*submission.problems, *intake.problems(read)] == []
        hand_in, _notes = intake.newest([item for one in read for item in one.items()], names)
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


# --- seen beforehand --------------------------------------------------------------------------------------------------

#: A dozen, of each sort one or two: what is seen at home is what grading finds.
SEEN = (
    *("helper-cell", "split-in-jupyterlab", "own-module", "magics", "name-error", "syntax-error"),
    *("exit-in-a-cell", "module-forgotten", "frequency-in-hertz", "notebook-left-empty"),
    *("all-ids-renewed", "text-cell-made-a-code-cell"),
)


@pytest.fixture(scope="module")
def home(tmp_path_factory):
    return students_installation(tmp_path_factory.mktemp("home") / "course")


@pytest.mark.parametrize("name", SEEN)
def test_what_is_seen_at_home_is_what_grading_finds(graded, home, name):
    (way,) = [one for one in RUN if one.name == name]
    seen = at_home(graded.place / "in" / way.student, way.student, home, CELL_TIMEOUT)
    with Gradebook(graded.place / "book.sqlite") as book:
        found = when_graded(book, way.student)
    assert (seen.recorded, seen.stops) == (found.recorded, found.stops)


def test_what_only_one_side_has_is_told(graded, home, tmp_path):
    """pandas is there at home, and not where grading runs: at home it goes well, and is warned of."""
    if PANDAS:
        pytest.skip("pandas is installed here, so that it is there where grading runs, too")
    (way,) = [one for one in WRONG if one.pandas is False]
    for folder, name, content in (
        ("pandas", "__init__.py", "class DataFrame(dict):\n    pass\n"),
        ("pandas-9.dist-info", "METADATA", "Metadata-Version: 2.1\nName: pandas\nVersion: 9\n"),
        ("pandas-9.dist-info", "top_level.txt", "pandas\n"),
    ):
        (tmp_path / folder).mkdir(exist_ok=True)
        (tmp_path / folder / name).write_text(content)
    seen = at_home(graded.place / "in" / way.student, way.student, home, CELL_TIMEOUT, tmp_path)
    assert any("pandas is installed here, but does not come with the course" in note for note in seen.notes)
    assert any("pandas is not installed where grading runs" in line for line in graded.of(way.student).problems)
