"""Several submissions of a student, several archives in one, several that cannot be read."""

from datetime import UTC, datetime, timedelta

import pytest
from packings import WANTED, lay, notebook, work, zipped

from labcourse.grading import intake
from labcourse.grading.gradebook.records import StudentRecord

ROSTER = [StudentRecord("ada", "Ada Lovelace"), StudentRecord("bob", "Bob Noether")]
EARLY = datetime(2026, 11, 20, 12, 0, 0, tzinfo=UTC)
LATE = EARLY + timedelta(days=1)


def put(folder, name, answer, when, names=WANTED):
    files = work("ada", answer, names=list(names))
    if name.casefold().endswith(".zip"):
        lay(folder, {name: zipped(files, when)}, when)
    else:
        lay(folder / name, files, when)


def taken(folder, roster):
    (submission,) = intake.find(folder, roster).submissions
    intake.read(submission, WANTED)
    assert intake.unread_problems(submission) == []
    intake.choose_newest(submission, submission.items, WANTED)
    return submission, {name: cells[0].source for name, cells in submission.notebooks.items()}


PAIRS = [("ada", "ADA.zip"), ("Ada", "ada (1).zip"), ("ADA.zip", "ada (1).zip"), ("ada", "Ada ")]


@pytest.mark.parametrize("roster", [ROSTER, ()], ids=["roster", "no roster"])
@pytest.mark.parametrize("names", PAIRS, ids=" beside ".join)
@pytest.mark.parametrize("second_is_newer", [True, False])
def test_of_a_folder_and_a_zip_of_one_student_both_are_taken_and_the_newer_counts(
    tmp_path, names, roster, second_is_newer
):
    times = (EARLY, LATE) if second_is_newer else (LATE, EARLY)
    for name, answer, when in zip(names, ("first", "second"), times, strict=True):
        put(tmp_path, name, answer, when)
    submission, counts = taken(tmp_path, roster)
    assert submission.student.casefold() == "ada"
    assert sorted(piece.source for piece in submission.pieces) == sorted(names)
    assert [piece.received for piece in submission.pieces] == [EARLY, LATE]
    assert counts == dict.fromkeys(WANTED, "second" if second_is_newer else "first")


def test_two_zips_within_a_hand_in_are_both_read(tmp_path):
    parts = {f"part{number}.zip": zipped({name: notebook(name, name)}) for number, name in enumerate(WANTED)}
    lay(tmp_path / "ada", parts)
    submission, counts = taken(tmp_path, ROSTER)
    assert len(submission.pieces) == len(WANTED) and counts == {name: name for name in WANTED}


@pytest.mark.parametrize(
    "course_file", ["course.json", "work/course.json", "work/deep/course.json", "other/course.json"]
)
def test_own_files_are_those_beside_the_notebooks_wherever_the_course_file_lies(tmp_path, course_file):
    files = {f"work/{name}": content for name, content in work(None).items()}
    lay(tmp_path / "ada", files | {"work/data/x.csv": b"1", "y.csv": b"2", course_file: b'{"student": "ada"}'})
    items = {
        item.name: item.content for item in intake.read(intake.find(tmp_path, ROSTER).submissions[0], WANTED).items
    }
    assert set(WANTED) < set(items) and items["data/x.csv"] == b"1"
    assert items["course.json"] == b'{"student": "ada"}'


def test_the_newest_python_of_a_students_notebooks_counts(tmp_path):
    for name, version in zip(WANTED, ("3.9.1", "3.12.1", "x"), strict=True):
        about = {"metadata": {"language_info": {"version": version}}}
        lay(tmp_path / "ada", {name: notebook(name, **about)})
    assert intake.read(intake.find(tmp_path, ROSTER).submissions[0], WANTED).python == (3, 12)
