"""The command: what each part of it does, refuses, and leaves alone."""

import json
import re
import sys
from pathlib import Path

import pytest
from checkout import ROOT
from made_courses import copied
from made_notebooks import answer, code, notebook, saved, text
from typer.testing import CliRunner

from labcourse import courses, lab_command
from labcourse.grading.isolation.selftest import Attempt, Layer
from labcourse.run import commands
from rotflex import cli
from rotflex.course.lab import Lab
from rotflex.hil.student_benches import DRAW


def rotflex(*arguments):
    return CliRunner().invoke(cli.app, [str(argument) for argument in arguments])


@pytest.fixture
def course(tmp_path, monkeypatch):
    """A course with two notebooks, and a working folder of one's own to be in."""
    (tmp_path / "course" / "notebooks").mkdir(parents=True)
    for name in ("00_start.ipynb", "01_next.ipynb"):
        (tmp_path / "course" / "notebooks" / name).write_text(json.dumps(name))
    (tmp_path / "course" / "data").mkdir()
    (tmp_path / "course" / "data" / "log.mat").write_text("data")
    (tmp_path / "desk").mkdir()
    (tmp_path / "course" / "__init__.py").write_text("from rotflex.course import draw\n")
    monkeypatch.delitem(sys.modules, "course", raising=False)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(courses, "installed", lambda: {"course": "course"})
    monkeypatch.setattr(courses, "use", lambda name: monkeypatch.setenv(courses.COURSE_VARIABLE, "course"))
    monkeypatch.setenv(lab_command.SETTINGS_VARIABLE, str(tmp_path / "settings"))
    monkeypatch.chdir(tmp_path / "desk")
    return tmp_path / "course"


@pytest.fixture
def opened(monkeypatch):
    """What JupyterLab was opened with, in place of JupyterLab."""
    calls = []
    monkeypatch.setattr(lab_command, "open_jupyterlab", lambda *arguments: calls.append(arguments))
    return calls


def test_lab_fills_a_new_folder_and_opens_it(course, opened):
    """With the ID as it is kept; recordings come with a release alone, never from a checkout."""
    assert rotflex("lab", "work", "--student", " ju\u0308rgen").exit_code == 0
    assert {path.name for path in Path("work").iterdir()} == {"00_start.ipynb", "01_next.ipynb", "course.json"}
    assert about_work() == {"student": "j\u00fcrgen", "course": "course", "draw": DRAW}
    assert opened == [(Path("work"), [])]
    (course / "notebooks" / "course.json").write_text(json.dumps(RELEASED))
    rotflex("lab", "released", "--student", "ada")
    assert Path("released/data/log.mat").read_text() == "data"


def about_work():
    return json.loads(Path("work/course.json").read_text(encoding="utf-8"))


def test_work_that_begins_in_a_checkout_has_the_bench_of_now_with_and_without_an_id(course, opened, monkeypatch):
    """`rotflex lab` first, the ID later, and the other way round; the marker has the same bench."""
    from solutions.true_bench import TrueBench

    for folder, *more in (("early", "--student", "ada"), ("late",)):
        assert rotflex("lab", folder, *more).exit_code == 0
        begun = Lab("ada", "virtual", Path(folder), quiet=True)
        assert rotflex("lab", folder, "--student", "ada").exit_code == 0
        now = Lab("ada", "virtual", Path(folder), quiet=True)
        assert begun.joint == now.joint == TrueBench("ada").joint


def test_a_course_file_that_cannot_be_written_is_an_error_in_words(course, opened):
    Path("work/course.json").mkdir(parents=True)
    done = rotflex("lab", "work", "--student", "ada")
    assert done.exit_code == 2 and "Is a directory" in " ".join(done.output.split())
    assert not list(Path("work").glob(".course*"))


def test_lab_never_overwrites_a_students_work(course, opened):
    Path("work").mkdir()
    kept = {"00_start.ipynb": "my work", "course.json": '{"student": "ada"}', "answers.json": "{}"}
    for name, content in kept.items():
        Path("work", name).write_text(content)
    done = rotflex("lab", "work")
    assert {path.name: path.read_text() for path in Path("work").iterdir()} == {
        **kept,
        "01_next.ipynb": '"01_next.ipynb"',
    }
    assert "01_next.ipynb" in done.output and "00_start.ipynb" not in done.output


RELEASED = {"student": "", "release": "2026-x", "draw": 1, "title": "T", "term": "2026", "bench": {"which": "own"}}


@pytest.fixture
def released(course):
    """The course as a release: with a name, and notebooks that are some."""
    (course / "notebooks" / "course.json").write_text(json.dumps(RELEASED))
    for name in ("00_start.ipynb", "01_next.ipynb"):
        (course / "notebooks" / name).write_bytes(saved(notebook(text("title", "# New"), answer("q1", "k = None"))))
    return course


@pytest.mark.parametrize("about", [None, {"student": "ada", "release": "2025-y", "with": ["bob"]}])
def test_lab_brings_a_half_done_folder_to_the_installed_release(released, opened, about):
    Path("work").mkdir()
    begun = notebook(text("title", "# Old"), answer("q1", "k = 3.5"), code("mine", "1"))
    Path("work/00_start.ipynb").write_bytes(saved(begun))
    Path("work/answers.json").write_text("{}")
    if about is not None:
        Path("work/course.json").write_text(json.dumps(about))
    done = rotflex("lab", "work")
    assert done.exit_code == 0 and opened
    assert re.search(r"00_start.*before-restore.*01_next\.ipynb", done.output, re.DOTALL)
    assert "another bench" not in done.output
    cells = json.loads(Path("work/00_start.ipynb").read_text())["cells"]
    assert [cell["source"] for cell in cells] == ["# New", "k = 3.5", "1"]
    assert json.loads(Path("work/00_start.before-restore.ipynb").read_text()) == begun
    assert about_work() == {**RELEASED, **(about or {}), "release": "2026-x"}
    assert Path("work/answers.json").read_text() == "{}"
    before = {path: path.stat().st_mtime_ns for path in Path("work").rglob("*")}
    assert ("--student YOUR-ID" in rotflex("lab", "work").output) == (about is None)
    assert {path: path.stat().st_mtime_ns for path in Path("work").rglob("*")} == before


def test_lab_adds_no_notebook_to_a_folder_of_the_same_release_and_names_what_is_missing(course, opened):
    """Some hand out a course week by week."""
    (course / "notebooks" / "course.json").write_text(json.dumps(RELEASED))
    Path("work").mkdir()
    Path("work", "00_start.ipynb").write_text("mine")
    Path("work", "course.json").write_text(json.dumps({**RELEASED, "student": "ada"}))
    done = rotflex("lab", "work")
    assert done.exit_code == 0 and "01_next" in done.output
    assert {path.name for path in Path("work").iterdir()} == {"00_start.ipynb", "course.json"}


def test_lab_says_that_the_bench_is_another(released, opened):
    Path("work").mkdir()
    Path("work/00_start.ipynb").write_bytes(saved(notebook(text("title", "# New"))))
    for bench in ({"which": "same", "seed": 3}, 3):
        Path("work/course.json").write_text(json.dumps({"student": "ada", "bench": bench}))
        assert "another bench" in rotflex("lab", "work").output


def test_lab_leaves_a_broken_course_file_unless_it_is_given_the_student(released, opened):
    Path("work").mkdir()
    Path("work/course.json").write_text('{"student": "ada"')
    assert "course.json should be" in " ".join(rotflex("lab", "work").output.split())
    assert Path("work/course.json").read_text() == '{"student": "ada"'
    assert rotflex("lab", "work", "--student", "ada").exit_code == 0
    assert about_work() == {**RELEASED, "student": "ada", "course": "course"}


@pytest.fixture
def at_a_terminal(monkeypatch):
    monkeypatch.setattr(commands, "at_a_terminal", lambda: True)


def test_lab_asks_for_the_id_where_there_is_none_and_once_only(course, opened, at_a_terminal):
    done = CliRunner().invoke(cli.app, ["lab", "work"], input="a/b\nAda\n")
    assert done.output.count("Your student ID") == 2 and "'a/b'" in done.output
    assert about_work()["student"] == "Ada" and len(opened) == 1
    assert "Your student ID" not in rotflex("lab", "work").output


def test_lab_opens_the_courses_own_notebooks_as_they_are_and_asks_nothing(course, opened, at_a_terminal, monkeypatch):
    monkeypatch.chdir(course)
    before = {path.name: path.stat().st_mtime_ns for path in (course / "notebooks").iterdir()}
    assert rotflex("lab").output == ""
    assert opened == [(Path("notebooks"), [])] and lab_command.remembered() is None
    assert {path.name: path.stat().st_mtime_ns for path in (course / "notebooks").iterdir()} == before


@pytest.mark.parametrize(("inside", "words"), [("data", ()), (".", ("work",)), ("data", (".",))])
def test_no_second_course_is_begun_inside_a_course(course, opened, monkeypatch, inside, words):
    rotflex("lab", "work", "--student", "ada")
    opened.clear()
    work = Path("work").resolve()
    (work / inside).mkdir(exist_ok=True)  # as "data", which a release may bring
    monkeypatch.chdir(work / inside)
    done = rotflex("lab", *words)
    assert opened == [(work, [])]
    assert f"he course in {work}" in done.output
    assert not list(work.glob("*/*.ipynb"))


def test_lab_passes_on_jupyterlabs_own_options_and_says_where_they_go(course, opened):
    done = rotflex("lab", "--no-browser")
    assert done.exit_code == 2 and "rotflex lab -- --no-browser" in " ".join(done.output.replace("│", " ").split())
    assert rotflex("lab", "--student", "ada", "work", "--", "--no-browser", "--port", "1").exit_code == 0
    assert opened == [(Path("work"), ["--no-browser", "--port", "1"])]


@pytest.mark.parametrize(
    ("words", "named"),
    [(("work", "--student", "a/b"), "'a/b'"), (("work", "b"), "'b'"), (("c",), "c is not a folder")],
)
def test_lab_refuses_what_is_no_id_and_no_folder_before_it_does_anything(course, opened, words, named):
    Path("c").write_text("")
    done = rotflex("lab", *words)
    assert done.exit_code == 2 and named in " ".join(done.output.split())
    assert not Path("work").exists() and opened == []


def test_release_says_what_it_made_and_keeps_it(tmp_path):
    course = copied(tmp_path / "course", ["00_start.ipynb"])
    assert rotflex("make-notebooks", "--solutions", course).exit_code == 0
    assert "# Your code here." in (tmp_path / "course" / "notebooks" / "00_start.ipynb").read_text()
    done = rotflex("release", tmp_path / "out", "--solutions", course)
    assert done.exit_code == 0, done.output
    notebooks = tmp_path / "out" / "rotflex-course" / "notebooks"
    assert (notebooks / "00_start.ipynb").exists() and "00_start.ipynb" in done.output
    (kept,) = (tmp_path / "course" / "releases").iterdir()
    assert kept.read_bytes() == (tmp_path / "out" / "rotflex-course.zip").read_bytes()
    assert f"Release {kept.stem}, stored as {kept}" in done.output
    about = json.loads((notebooks / "course.json").read_text())
    assert (about["release"], about["draw"], about["bench"]) == (kept.stem, DRAW, {"which": "own"})


def test_without_the_instructors_libraries_a_command_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "nbformat", None)
    monkeypatch.delitem(sys.modules, "labcourse.grading.release.student_notebooks", raising=False)
    monkeypatch.delitem(sys.modules, "labcourse.grading.release.student_course", raising=False)
    done = rotflex("make-notebooks", "--solutions", ROOT)
    assert done.exit_code == 2
    assert 'pip install "labcourse[grading]"' in " ".join(done.output.split())


@pytest.fixture
def isolated(monkeypatch):
    """As if the isolation had been examined."""
    monkeypatch.setattr("labcourse.grading.running.isolation_report.check", lambda: None)


def graded(folder, *options, student="ada", out="out"):
    """Grade something that is not a zip."""
    (folder / "in").mkdir()
    (folder / "in" / f"{student}.zip").write_bytes(b"not a zip")
    return rotflex("grade", folder / out, folder / "in", "--solutions", ROOT, *options)


LACKING = Layer("bubblewrap", False, "the program bwrap is not there", "apt-get install bubblewrap", True)


@pytest.mark.parametrize(
    ("layers", "attempts", "user", "options", "named"),
    [
        ([LACKING], [], 1000, [], ["not there", "apt-get install bubblewrap", "--unsafe-no-isolation"]),
        ([], [Attempt("network", False, "reached a listener outside", True)], 1000, [], ["reached a listener outside"]),
        ([LACKING], [], 0, ["--unsafe-no-isolation"], ["not for root"]),
    ],
    ids=["missing layer", "broke out", "root"],
)
def test_grade_runs_nobodys_code_unisolated(tmp_path, monkeypatch, layers, attempts, user, options, named):
    monkeypatch.setattr("labcourse.grading.isolation.selftest.layers", lambda: layers)
    monkeypatch.setattr("labcourse.grading.isolation.selftest.attempts", lambda: attempts)
    monkeypatch.setattr("os.geteuid", lambda: user)
    done = graded(tmp_path, *options)
    said = " ".join(done.output.split())
    assert done.exit_code == 3 and all(fragment in said for fragment in named)
    assert not (tmp_path / "out").exists()


def test_grade_without_isolation_is_stamped_on_everything(tmp_path, monkeypatch):
    monkeypatch.setattr("os.geteuid", lambda: 1000)
    done = graded(tmp_path, "--unsafe-no-isolation")
    files = [tmp_path / "out" / name for name in ("grades.csv", "ada/feedback.html", "ada/marks.json")]
    assert done.exit_code == 1
    assert all("Run without isolation." in said for said in (done.output, *(path.read_text() for path in files)))


@pytest.mark.parametrize("make", [lambda path: None, Path.mkdir], ids=["missing", "empty"])
def test_grade_without_submissions_is_an_error_in_words(tmp_path, make, isolated):
    make(tmp_path / "in")
    done = rotflex("grade", tmp_path / "out", tmp_path / "in", "--solutions", ROOT)
    assert done.exit_code == 2
    assert "There is nothing in" in done.output
    assert not (tmp_path / "out").exists()


def test_results_among_the_submissions_are_refused(tmp_path, isolated):
    done = graded(tmp_path, out="in/out")
    assert done.exit_code == 2 and not (tmp_path / "in" / "out").exists()


def test_folders_in_the_wrong_order_are_refused(tmp_path, isolated):
    graded(tmp_path)
    done = rotflex("grade", tmp_path / "in", tmp_path / "out", "--solutions", ROOT)
    assert done.exit_code == 2 and "Name that first" in " ".join(done.output.split())
    assert {path.name for path in (tmp_path / "in").iterdir()} == {"ada.zip"}


def test_what_was_graded_can_be_marked_again_and_by_hand_and_looked_back_on(tmp_path, isolated):
    assert graded(tmp_path).exit_code == 1
    book = tmp_path / "out"
    (book / "grades.csv").unlink()
    assert (
        "Other marks than before: 0 students"
        in rotflex("regrade", book, "--solutions", ROOT, "--question", "2.11").output
    )
    assert (book / "grades.csv").exists()
    given = ("mark", book, "ada", "2.11", "explanation", "0.5", "--reason", "Told me \x1b[31m.", "--by", "prof")
    assert rotflex(*given).exit_code == 0
    done = rotflex("history", book, "ada", "--question", "2.11")
    assert "0 (missing) → 0.5 (given by a person)" in done.output
    assert "prof: Told me \\x1b[31m." in done.output


@pytest.mark.parametrize("words", [("regrade", "--solutions", ROOT), ("history",), ("outcomes", "sheets")])
def test_a_slip_in_the_name_of_a_gradebook_makes_no_new_one(tmp_path, words):
    done = rotflex(*words, tmp_path / "slip.sqlite")
    assert done.exit_code == 2
    assert "There is no gradebook" in done.output
    assert list(tmp_path.iterdir()) == []


def test_doctor_shows_the_layers_and_says_what_to_do(monkeypatch):
    layers = [LACKING, Layer("cgroups", False, "not to be had", "", False)]
    monkeypatch.setattr("labcourse.grading.isolation.selftest.layers", lambda: layers)
    done = rotflex("doctor")
    assert done.exit_code == 3
    assert "apt-get install bubblewrap" in done.output and "optional" in done.output
    data = json.loads(rotflex("doctor", "--json").output)
    assert data["good"] is False and data["layers"][0]["name"] == "bubblewrap" and data["attempts"] == []
