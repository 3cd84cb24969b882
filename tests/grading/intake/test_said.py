"""How what intake reports is said where a person reads it."""

import pytest

from labcourse.grading.intake.archives import named
from labcourse.problems import Code, Problem
from labcourse.sentences import sentence

NEITHER = Problem.of(Code.NO_FOLDER_NO_ZIP)
BROKEN = Problem.of(Code.ARCHIVE_UNREAD, "x.zip", why=Problem.of(Code.NOT_AN_ARCHIVE, error="BadZipFile"))
PACKED = Problem.of(Code.PACKED_ARCHIVES, files=["y.7z"])
UNCLEAR = Problem.of(Code.NAMES_FIT_PLATFORMS, platforms=["Canvas", "Moodle"])
SAVED = Problem.of(Code.CHOSEN_BY_TIME, saved="2026-11-20 09:01", cells=3)


@pytest.mark.parametrize(
    ("problem", "said"),
    [
        (Problem.of(Code.IGNORED, files=["a"], why=[NEITHER]), "'a' is not read: it is neither a folder nor a zip."),
        (
            Problem.of(Code.IGNORED, files=["a", "b"], why=[BROKEN, Problem.of(Code.COURSE_FILE_NAMES, named="ada")]),
            "'a', 'b' are not read: 'x.zip' cannot be read: it is not an archive that can be read (BadZipFile). Its "
            "course.json names 'ada'.",
        ),
        (
            Problem.of(Code.PLATFORM_UNDECIDED, why=UNCLEAR, choices=["Canvas", "Moodle", "none"]),
            "all names fit Canvas and Moodle. If one platform named it, give --platform (Canvas, Moodle, none), or "
            "decide it in intake.csv; else put each into its own folder.",
        ),
        (
            Problem.of(Code.FILES_REFUSED, **named([*"abcdefgh"]), why=Problem.of(Code.TOO_DEEP, most=8)),
            "'a', 'b', 'c', 'd', 'e' and 3 more: not read: it lies deeper than 8 folders.",
        ),
        (
            Problem.of(Code.SUBMISSION_UNREAD, "ada", why=(BROKEN, PACKED)),
            "The submission cannot be read: 'ada': 'x.zip' cannot be read: it is not an archive that can be read "
            "(BadZipFile). 'y.7z': packed in a way that is not read; hand in an ordinary zip. Hand it in again.",
        ),
        (
            Problem.of(Code.ONE_OF_SEVERAL, "x.ipynb", count=2, chosen="a", why=SAVED, files=["b"]),
            "There are 2 files x.ipynb; 'a' counts, saved 2026-11-20 09:01 UTC, with 3 cells written; not 'b'.",
        ),
        (Problem.of(Code.CHOSEN_BY_TIME, cells=0), "without a time, with 0 cells written"),
        (
            Problem.of(Code.NO_NOTEBOOK, **named([])),
            "There is no notebook of the course in the submission. Names of notebooks end in .ipynb.",
        ),
        (
            Problem.of(Code.TOO_MANY_FILES, most=5, with_others=True),
            "with what was read before it, it has more than 5 files and folders.",
        ),
    ],
    ids=lambda value: value.code if isinstance(value, Problem) else "",
)
def test_what_is_reported_is_said_in_a_sentence(problem, said):
    assert sentence(problem) == said
