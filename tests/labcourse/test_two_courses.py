"""Two courses side by side: each command, in each kind of folder, works on the folder's course and on no other."""

import json
import os
import sys

import pytest
from made_notebooks import answer, notebook, saved, text
from typer.testing import CliRunner

from labcourse import command_line, course_file, courses, lab_command
from labcourse.answers import notebooks
from labcourse.run import check as checking
from labcourse.run import commands

#: Both begin with a notebook of the same name.
NOTEBOOKS = {"tanks": ["00_start", "01_tank", "02_level"], "springs": ["00_start", "01_spring"]}
OTHERS = ["01_swing", "02_period"]  # of a course that is not installed
opened = []  # by the command ``lab``
COMMANDS = ["lab --student ada", "check", "submit --no-check --student ada", "restore"]


@pytest.fixture(autouse=True)
def desk(tmp_path, monkeypatch):
    """A folder to be in, where both courses are installed, and their own commands."""
    for name, stems in NOTEBOOKS.items():
        (tmp_path / f"{name}_course" / "notebooks").mkdir(parents=True)
        (tmp_path / f"{name}_course" / "__init__.py").touch()
        for stem in stems:
            content = notebook(text("title", f"# {name}: {stem}"), answer("q1", "k = None"))
            (tmp_path / f"{name}_course" / "notebooks" / f"{stem}.ipynb").write_bytes(saved(content))
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(courses, "installed", lambda: {name: f"{name}_course" for name in NOTEBOOKS})
    monkeypatch.delenv(courses.COURSE_VARIABLE)
    monkeypatch.setenv("LABCOURSE_PROGRAM", "rotflex")  # which each program sets
    monkeypatch.setenv(lab_command.SETTINGS_VARIABLE, str(tmp_path / "settings"))
    monkeypatch.setattr(lab_command, "open_jupyterlab", lambda folder, _options: opened.append(folder.resolve()))
    opened.clear()
    monkeypatch.setattr(checking, "check", lambda folder, *_, **__: checking.Checked("ada", folder, ()))
    monkeypatch.setattr(notebooks, "catalogue_of", lambda masters: None)
    monkeypatch.setattr(notebooks, "asked_of", lambda masters, folder: None)
    monkeypatch.setattr("labcourse.run.submit.report_files.of_files", lambda *_: {})
    (tmp_path / "desk").mkdir()
    monkeypatch.chdir(tmp_path / "desk")
    yield tmp_path / "desk"
    courses.requested = ""
    for name in NOTEBOOKS:
        sys.modules.pop(f"{name}_course", None)


def lay(folder, stems, **about):
    """A student's folder; without anything about it, without a course.json."""
    folder.mkdir(parents=True, exist_ok=True)
    for stem in stems:
        content = notebook(text("title", "# Mine"), answer("q1", "k = 1.5"))
        (folder / f"{stem}.ipynb").write_bytes(saved(content))
    if about:
        (folder / "course.json").write_text(json.dumps({"student": "ada", **about}))
    return folder.resolve()


def say(program, words, given=None):
    """Type a command of the program ``labcourse``, perhaps with --course, or of a course's own program."""
    os.environ.pop(courses.COURSE_VARIABLE, None)
    own = "" if program.startswith("labcourse") else f"{program}_course"
    app = command_line.command_line(program.partition(" ")[0], "1", course=own)
    done = CliRunner().invoke(app, [*program.split()[1:], *words.split()], input=given)
    assert done.exit_code in (0, 1, 2) and not isinstance(done.exception, (TypeError, KeyError, OSError)), done
    return done


def stems_in(folder):
    return {path.stem for path in folder.glob("*.ipynb") if "before-restore" not in path.name}


PROGRAMS = ["labcourse", "springs", "labcourse --course springs", "tanks", "labcourse --course tanks"]
KINDS = ["named", "below", "above", "old", "old, handed out week by week", "without course.json"]
#: Of the second course, and by its own programs, the command that most depends on it is tried.
TRIED = [("tanks", "springs", program, words) for program in PROGRAMS[:3] for words in COMMANDS]
TRIED += [("tanks", "springs", program, COMMANDS[0]) for program in PROGRAMS[3:]]
TRIED += [("springs", "tanks", program, COMMANDS[0]) for program in (PROGRAMS[0], *PROGRAMS[3:])]


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(("course", "other", "program", "words"), TRIED)
def test_a_command_uses_the_course_of_its_folder_or_refuses(desk, monkeypatch, course, other, kind, program, words):
    stems = NOTEBOOKS[course][1:] if "week" in kind else NOTEBOOKS[course]
    about = {"draw": 1} if "old" in kind else {} if "without" in kind else {"course": course}
    work = lay(desk / "notebooks" if kind == "above" else desk / "work", stems, **about)
    (work / "data").mkdir()
    monkeypatch.chdir({"below": work / "data", "above": desk}.get(kind, work))
    before = {path: path.read_bytes() for path in work.iterdir() if path.is_file()}
    done = say(program, words)
    if other in program and (kind == "above" or "--course" in program):  # the folder is not meant
        is_begun = kind == "above" and words.startswith("lab")  # in a folder of its own
        assert (done.exit_code == 0) == is_begun and (desk / other / "01_spring.ipynb").exists() <= is_begun
        assert {path: path.read_bytes() for path in work.iterdir() if path.is_file()} == before
        return
    assert done.exit_code == 0, done.output
    assert {*stems} <= stems_in(work) <= {*NOTEBOOKS[course]}
    assert courses.current().package == f"{course}_course"
    if words.startswith("lab"):
        assert course_file.read(work)["course"] == course and str(work) in "".join(map(str, opened))


def test_each_course_remembers_its_own_folder_and_fills_no_others(desk, monkeypatch):
    for name in NOTEBOOKS:
        assert say(name, f"lab {name}-work --student ada").exit_code == 0
    (desk / "empty").mkdir()
    monkeypatch.chdir(desk / "empty")
    for name in ("tanks", "springs", "labcourse --course tanks", "labcourse --course springs"):
        opened.clear()
        assert say(name, "lab").exit_code == 0
        course = name.rpartition(" ")[2]
        assert opened == [desk / f"{course}-work"] and course_file.read(opened[0])["course"] == course
    done = say("labcourse", "lab")
    assert done.exit_code == 2 and "springs, tanks" in done.output and not list((desk / "empty").iterdir())


def test_the_last_folder_that_an_earlier_version_saved_is_that_of_its_course_alone(desk, tmp_path):
    work = lay(desk / "elsewhere", NOTEBOOKS["tanks"], draw=1)
    (tmp_path / "settings").mkdir()
    (tmp_path / "settings" / "lab.json").write_text(json.dumps({"folder": str(work)}))
    assert say("springs", "lab --student ada").exit_code == 0
    assert stems_in(desk / "notebooks") == {*NOTEBOOKS["springs"]} and stems_in(work) == {*NOTEBOOKS["tanks"]}
    (desk / "notebooks").rename(desk / "springs")
    assert say("tanks", "lab").exit_code == 0 and opened[-1] == work


@pytest.mark.parametrize("stems", [["00_start"], ["00_start", "01_spring", "01_tank", "02_level"], []])
def test_where_two_fit_an_old_file_the_command_asks_once_and_writes_it_down(desk, monkeypatch, stems):
    """A notebook of both, the folder of one that was filled with the other's, and none."""
    work = lay(desk / "work", stems, draw=1, own=3)
    before = (work / "course.json").read_bytes()
    monkeypatch.chdir(work)
    for program in ("labcourse", "springs"):
        for words in COMMANDS:
            done = say(program, words)
            asked = " ".join(done.output.split())
            assert done.exit_code == 2 and f"{program} --course NAME" in asked and str(work) in asked
    assert (work / "course.json").read_bytes() == before and stems_in(work) == {*stems}
    monkeypatch.setattr(commands, "at_a_terminal", lambda: True)
    done = say("labcourse", "lab", "n\ny\n")
    assert done.output.count("a folder of the course") == 2
    assert course_file.read(work) == {"student": "ada", "draw": 1, "own": 3, "course": "springs"}
    assert "a folder of the course" not in say("tanks", "lab").output


def test_a_folder_begun_beside_the_notebooks_of_a_release_is_of_its_course(desk):
    lay(desk / "notebooks", NOTEBOOKS["tanks"], course="tanks", release="tanks-1")
    done = say("labcourse", "lab work --student ada")
    assert done.exit_code == 0, done.output
    assert opened == [(desk / "work").resolve()] and stems_in(desk / "work") == {*NOTEBOOKS["tanks"]}


def test_the_option_answers_where_two_fit(desk, monkeypatch):
    monkeypatch.chdir(lay(desk / "work", ["00_start"], draw=1))
    assert say("labcourse --course springs", "lab").exit_code == 0
    assert course_file.read(desk / "work")["course"] == "springs"


@pytest.mark.parametrize("about", [{"course": "swings"}, {"draw": 1, "title": "swings"}])
def test_a_folder_of_a_course_that_is_not_installed_is_left_alone(desk, monkeypatch, about):
    """Also where one course alone is installed."""
    monkeypatch.setattr(courses, "installed", lambda: {"tanks": "tanks_course"})
    monkeypatch.chdir(lay(desk / "work", OTHERS, **about))
    for program in ("labcourse", "tanks"):
        for words in COMMANDS:
            done = say(program, words)
            assert done.exit_code == 2 and "swings" in done.output and "tanks" in done.output
    assert stems_in(desk / "work") == {*OTHERS} and course_file.read(desk / "work") == {"student": "ada", **about}


@pytest.mark.parametrize("stems", [[], ["00_start"]])
def test_where_one_course_is_installed_nothing_is_asked(desk, monkeypatch, stems):
    monkeypatch.setattr(courses, "installed", lambda: {"tanks": "tanks_course"})
    monkeypatch.chdir(lay(desk / "work", stems, draw=1))
    assert say("labcourse", "lab").exit_code == 0
    assert stems_in(desk / "work") == {*NOTEBOOKS["tanks"]}
