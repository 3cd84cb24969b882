"""Which folder is worked in, and what is kept for next time. (As a student meets it: tests/test_cli.py.)"""

from pathlib import Path

import pytest

from labcourse import course_file, courses, lab_command

NAMES = ["00_a.ipynb", "01_b.ipynb", "02_c.ipynb"]


@pytest.fixture(autouse=True)
def settings(tmp_path, monkeypatch):
    """Where one course is installed."""
    monkeypatch.setattr(courses, "installed", lambda: {"abc": "abc_course"})
    monkeypatch.setattr(courses, "notebooks", lambda: {"abc": {*NAMES}})
    monkeypatch.setattr(courses, "current", lambda: courses.InstalledCourse("abc_course", tmp_path))
    monkeypatch.setenv(lab_command.SETTINGS_VARIABLE, str(tmp_path / "settings"))
    monkeypatch.setenv(courses.COURSE_VARIABLE, "abc")
    return tmp_path / "settings"


@pytest.mark.parametrize(
    ("files", "is_one"),
    [
        ((), False),
        (("00_a.ipynb",), False),  # as it may lie among downloads
        (("00_a.ipynb", "01_b.ipynb"), True),
        (("course.json",), True),
        (("answers.json", "mine.ipynb"), False),
    ],
)
def test_a_courses_folder_is_told_by_its_course_file_or_most_of_its_notebooks(tmp_path, files, is_one):
    for name in files:
        (tmp_path / name).write_text("")
    assert course_file.courses_of(tmp_path) == ["abc"] * is_one


@pytest.mark.parametrize("notebooks", [NAMES[:2], []], ids=["half of two", "none"])
def test_half_of_a_courses_notebooks_or_none_are_not_most_of_them(tmp_path, monkeypatch, notebooks):
    monkeypatch.setattr(courses, "notebooks", lambda: {"abc": {*notebooks}})
    (tmp_path / NAMES[0]).write_text("")
    assert course_file.courses_of(tmp_path) == []


def test_a_folder_that_holds_the_unpacked_course_is_not_filled_beside_it(tmp_path, monkeypatch):
    (tmp_path / "rotflex-course" / "notebooks").mkdir(parents=True)
    (tmp_path / "rotflex-course" / "notebooks" / "course.json").write_text("{}")
    monkeypatch.chdir(tmp_path / "rotflex-course")
    assert lab_command.choose(Path("."))[0] == Path("notebooks")
    assert lab_command.choose(None) == (Path("notebooks"), [])
    (tmp_path / "rotflex-course" / "docs").mkdir()
    monkeypatch.chdir(tmp_path / "rotflex-course" / "docs")
    folder, (said,) = lab_command.choose(None)
    assert folder == tmp_path / "rotflex-course" / "notebooks" and str(folder) in said


def test_the_last_folder_is_kept_and_forgotten_when_it_is_gone(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    work = tmp_path / "w\u00f6rk"
    work.mkdir()
    (work / "course.json").write_text("{}")
    lab_command.remember(Path("w\u00f6rk"))
    assert lab_command.remembered() == work
    assert lab_command.choose(None)[0] == work
    work.rename(tmp_path / "gone")
    assert lab_command.choose(None) == (Path("notebooks"), [])


@pytest.mark.parametrize("content", ["", "[]", '{"folder": 3}', "\x00"])
def test_settings_that_cannot_be_read_or_written_stop_nobody(settings, content):
    settings.mkdir()
    (settings / "lab.json").write_text(content)
    assert lab_command.remembered() is None
    (settings / "lab.json").unlink()
    settings.rmdir()
    settings.write_text("in the way")
    lab_command.remember(Path("work"))
    assert lab_command.remembered() is None


def test_settings_are_beside_jupyters(tmp_path, monkeypatch):
    monkeypatch.delenv(lab_command.SETTINGS_VARIABLE)
    monkeypatch.setenv("JUPYTER_CONFIG_DIR", str(tmp_path / "jupyter"))
    (tmp_path / "course.json").write_text("{}")
    lab_command.remember(tmp_path)
    assert (tmp_path / "jupyter" / "labcourse" / "lab.json").exists() and lab_command.remembered() == tmp_path
