"""The date that a release's files bear."""

import io
import os
import shutil
import subprocess
import zipfile

import pytest
from checkout import ROOT
from made_courses import copied

from labcourse.grading.course import load
from labcourse.grading.release import student_course

needs_git = pytest.mark.skipif(shutil.which("git") is None, reason="git is not installed")


def git(folder, *words, when="1700000000 +0100"):
    who = {f"GIT_{role}_{what}": "a@b" for role in ("AUTHOR", "COMMITTER") for what in ("NAME", "EMAIL")}
    environment = {**os.environ, **who, "GIT_AUTHOR_DATE": when, "GIT_COMMITTER_DATE": when}
    subprocess.run(["git", *words], cwd=folder, env=environment, check=True, capture_output=True)


@needs_git
def test_it_is_that_of_the_last_commit_of_the_sources_and_of_no_other(tmp_path):
    source = tmp_path / "source"
    source.mkdir()
    (source / "a.py").write_text("1")
    git(tmp_path, "init", "-q")
    git(tmp_path, "add", ".")
    git(tmp_path, "commit", "-q", "-m", "source")
    (tmp_path / "elsewhere").write_text("")
    git(tmp_path, "add", ".")
    git(tmp_path, "commit", "-q", "-m", "elsewhere", when="1800000000 +0000")
    os.utime(source / "a.py", (1.9e9, 1.9e9))  # as a fresh clone has it: written now
    assert student_course.zip_time_of([source]) == (2023, 11, 14, 22, 13, 20)
    assert student_course.zip_time_of([tmp_path, source]) == (2027, 1, 15, 8, 0, 0)


@pytest.mark.parametrize("path", [None, ""], ids=["no repository", "no git"])
def test_without_a_commit_it_is_that_of_the_newest_source_and_no_run_changes_it(tmp_path, monkeypatch, path):
    if path is not None:
        monkeypatch.setenv("PATH", path)
    for name, when in {"old.py": 1e9, "new.py": 1.2e9, "answers.json": 1.9e9, "__pycache__/new.pyc": 1.9e9}.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text("")
        os.utime(tmp_path / name, (when, when))
    assert student_course.zip_time_of([tmp_path]) == (2008, 1, 10, 21, 20, 0)


@pytest.mark.parametrize(("when", "year"), [(0, 1980), (9e9, 2107)])
def test_it_can_stand_in_a_zip(tmp_path, when, year):
    source = tmp_path / "source"
    source.mkdir()
    (source / "a.py").write_text("")
    os.utime(source / "a.py", (when, when))
    packed = student_course.zip_files({"a.py": source / "a.py"}, student_course.zip_time_of([source]))
    assert zipfile.ZipFile(io.BytesIO(packed)).infolist()[0].date_time[0] == year


def test_every_file_of_a_release_bears_it(tmp_path):
    course = load(copied(tmp_path / "course", ["00_start.ipynb"]))
    made = student_course.release(course, tmp_path / "out")
    expected = student_course.zip_time_of([course.folder, ROOT / "labcourse", ROOT / "rotflex"])
    with zipfile.ZipFile(made.archive) as packed:
        # A zip's clock goes in steps of two seconds.
        assert {entry.date_time for entry in packed.infolist()} == {(*expected[:5], expected[5] // 2 * 2)}
    assert expected[0] > 2020
