"""The tree of commands: the rules that all of them follow, and the same command line for another course."""

import json
import subprocess
import sys

import pytest
import typer.main
from typer.testing import CliRunner

from labcourse import command_line, courses, lab_command, program
from rotflex import cli

PANELS = ["Student", "Course", "Class", "Person", "Bench"]
TOP = typer.main.get_command(cli.app)


def offered(command):
    """The commands that a person is to use: not those that only say what stands in the place of a former one."""
    return [(name, found) for name, found in command.commands.items() if not found.hidden]


def every(command, path=()):
    """(words that name it, panel, command) of each command and of those below it."""
    for name, found in offered(command):
        if hasattr(found, "commands"):
            yield from ((words, found.rich_help_panel, one) for words, _, one in every(found, (*path, name)))
        else:
            yield " ".join((*path, name)), found.rich_help_panel, found


EVERY = {words: (panel, command) for words, panel, command in every(TOP)}


def test_each_command_is_in_a_panel_and_the_panels_are_in_the_order_of_use():
    assert list(dict.fromkeys(command.rich_help_panel for _name, command in offered(TOP))) == PANELS


def test_a_command_of_a_class_or_person_takes_its_folder_first_and_all_call_it_the_same():
    without = {"doctor"}  # which looks at the computer
    for words, (panel, command) in EVERY.items():
        places = [place for place, one in enumerate(command.params) if one.metavar == "MARKS"]
        assert places == ([0] if panel in ("Class", "Person") and words not in without else []), words


@pytest.mark.parametrize("option", ["--by", "--solutions", "--json", "--dry-run", "--force", "--again", "--out"])
def test_an_option_of_one_name_means_the_same_everywhere(option):
    of_a_class = [command for panel, command in EVERY.values() if panel in ("Class", "Person")]
    found = {one.help for command in of_a_class for one in command.params if option in one.opts and not one.hidden}
    if option == "--by":  # several persons may score at a time, and one at a time does all else
        found = {one.partition(",")[0] for one in found}
    assert len(found) == 1


ENTRIES = "[labcourse.courses]\ntanks = tanks_course\nsprings = springs_course\n"


def test_without_a_course_of_its_own_the_command_asks_which_one(tmp_path, monkeypatch):
    """Two courses that are installed are both named; the one that is chosen is used, and messages name the program."""
    monkeypatch.setenv("LABCOURSE_PROGRAM", "other")
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv(courses.SETTING, raising=False)
    (tmp_path / "tanks_course" / "notebooks").mkdir(parents=True)
    (tmp_path / "tanks_course" / "__init__.py").write_text("def draw():\n    return 7\n")
    (tmp_path / "tanks_course" / "notebooks" / "01_tank.ipynb").write_text("{}")
    (tmp_path / "two-1.dist-info").mkdir()
    (tmp_path / "two-1.dist-info" / "entry_points.txt").write_text(ENTRIES)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(lab_command, "open_jupyterlab", lambda *arguments: None)
    app = command_line.command_line("labcourse", "1.2")
    done = CliRunner().invoke(app, ["lab", "work", "--student", "ada"])
    assert done.exit_code == 2 and "springs, tanks" in " ".join(done.output.split())
    done = CliRunner().invoke(app, ["--course", "tanks", "lab", "work", "--student", "ada"])
    assert done.exit_code == 0, done.output
    assert (tmp_path / "work" / "01_tank.ipynb").exists()
    assert json.loads((tmp_path / "work" / "course.json").read_text())["draw"] == 7
    assert program.name() == "labcourse"
    assert CliRunner().invoke(app, ["--version"]).output == "labcourse 1.2\n"
    done = CliRunner().invoke(app, ["history", "nothing"])
    assert done.output.startswith("labcourse: ") and "labcourse grade" in " ".join(done.output.split())


def test_without_the_courses_machinery_there_are_the_commands_of_a_bench():
    code = "import sys; sys.modules['labcourse'] = None; from rotflex import cli; cli.run()"
    for words, status, shown in ((["--help"], 0, "bench"), (["doctor"], 2, "--bench"), (["bench", "--help"], 0, "fit")):
        done = subprocess.run([sys.executable, "-c", code, *words], capture_output=True, text=True, check=False)
        assert done.returncode == status and shown in done.stdout + done.stderr, done.stderr
        assert "submit" not in done.stdout
