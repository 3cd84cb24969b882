"""On a JupyterHub: whose bench it is, and what `rotflex lab` leaves to it. Here, a hub is environment variables."""

import json
from pathlib import Path

import pytest
from made_notebooks import answer, locked, notebook, saved
from typer.testing import CliRunner

import rotflex.course.lab
from labcourse import lab_command
from labcourse.errors import ConfigurationError
from labcourse.run import commands, student_folder
from rotflex import cli

NOTEBOOK = "00_start.ipynb"


@pytest.fixture(autouse=True)
def hub(monkeypatch, tmp_path):
    """As a hub's server has it, in a folder with the course as it is pulled: released for nobody in particular."""
    monkeypatch.setenv("JUPYTERHUB_USER", "ada")
    monkeypatch.setenv("JUPYTERHUB_SERVICE_PREFIX", "/user/ada/")
    monkeypatch.setenv(lab_command.SETTINGS_VARIABLE, str(tmp_path / "settings"))
    monkeypatch.setattr(lab_command, "open_jupyterlab", lambda *arguments: pytest.fail("a second JupyterLab"))
    monkeypatch.chdir(tmp_path)
    (tmp_path / "course.json").write_text('{"student": ""}')
    (tmp_path / NOTEBOOK).write_bytes(saved(notebook(answer("q1", "k = 1"), locked("q1-answer", "lab.answer()"))))


def whose(capsys, student=""):
    """Whose the session is, that of the packed work, and what is told beside the first."""
    found = rotflex.course.lab.start(student).student
    packed = student_folder.student_of(student_folder.read(Path(), [NOTEBOOK]), found)
    assert packed == found
    return found, "The hub knows you as" in capsys.readouterr().out


def test_who_gives_no_id_is_the_hubs_user(capsys):
    assert whose(capsys) == ("ada", False)
    Path("course.json").unlink()
    assert whose(capsys) == ("ada", False)


def test_the_folders_student_leads_and_the_hubs_name_is_told_where_it_is_another(capsys):
    assert whose(capsys, "eve") == ("ada", False)  # typed in a notebook: the hub knows better
    Path("course.json").write_text('{"student": "bob"}')
    assert whose(capsys) == ("bob", True)
    Path("course.json").write_text('{"student": "ADA"}')
    assert whose(capsys) == ("ADA", False)


def test_what_was_recorded_for_nobody_in_particular_is_the_hubs_users(capsys):
    Path("answers.json").write_text('{"student": "demo"}')
    assert whose(capsys) == ("ada", False)
    Path("answers.json").write_text('{"student": "demo"}')
    assert student_folder.student_of(student_folder.read(Path(), [NOTEBOOK])) == "ada"


def test_a_binder_makes_up_its_users(capsys, monkeypatch):
    """mybinder.org is a hub, whose users are named after the repository and a few letters that are others each time."""
    monkeypatch.setenv("BINDER_LAUNCH_HOST", "https://mybinder.org/")
    assert whose(capsys) == ("demo", False)


def test_a_hubs_name_that_is_no_id_is_told_with_what_to_do(capsys, monkeypatch):
    monkeypatch.setenv("JUPYTERHUB_USER", "nul")
    with pytest.raises(ConfigurationError, match=r"Windows keeps the name nul .* rotflex lab --student YOUR-ID"):
        rotflex.course.lab.start()
    assert whose(capsys, "ada") == ("ada", True)


@pytest.fixture
def desk(tmp_path, monkeypatch):
    """A folder with no course in it."""
    (tmp_path.parent / f"{tmp_path.name}-desk").mkdir()
    monkeypatch.chdir(tmp_path.parent / f"{tmp_path.name}-desk")


def lab(*words):
    done = CliRunner().invoke(cli.app, ["lab", *words])
    assert done.exit_code == 0, done.output
    return " ".join(done.output.split()), json.loads(Path("work/course.json").read_text())["student"]


def test_rotflex_lab_writes_the_hubs_user_down_and_leaves_jupyterlab_to_the_hub(desk):
    said, student = lab("work")
    assert student == "ada"
    assert "Student: ada" in said and "JupyterLab runs here already, as the hub's: open work" in said
    assert "Is it another?" in said and "Is it another?" not in lab("work")[0]


def test_another_id_than_the_hubs_can_be_given_and_is_told(desk):
    said, student = lab("work", "--student", "bob")
    assert student == "bob" and "The hub knows you as 'ada'. The work here is that of 'bob'." in said
    said, student = lab("work")
    assert student == "bob" and "The work here is that of 'bob'." in said


def test_whose_name_on_the_hub_is_no_id_is_asked(desk, monkeypatch):
    monkeypatch.setenv("JUPYTERHUB_USER", "a/b")
    monkeypatch.setattr(commands, "at_a_terminal", lambda: True)
    done = CliRunner().invoke(cli.app, ["lab", "work"], input="ada\n")
    assert "'a/b' cannot be a student's ID" in " ".join(done.output.split())
    assert json.loads(Path("work/course.json").read_text())["student"] == "ada"
