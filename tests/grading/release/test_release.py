"""What students get, and what they must not get."""

import ast
import errno
import json
import re
import shutil
import subprocess
import sys
import tomllib
import zipfile
from dataclasses import replace
from importlib import metadata

import nbformat
import pytest
from checkout import ROOT
from made_courses import OURS, WITH_OPTIONAL

import labcourse
import rotflex
from labcourse.answers import words
from labcourse.answers.catalogue import Catalogue
from labcourse.answers.parts import Question, number, prose
from labcourse.benches import BenchPolicy
from labcourse.errors import GradingError
from labcourse.grading.release import student_course, student_notebooks
from labcourse.grading.release.student_notebooks import BEGIN_CODE, END_CODE


def code(source, cell_id="a", **metadata):
    return nbformat.v4.new_code_cell(source, id=cell_id, metadata=metadata)


def answer(source, cell_id="q1"):
    return code(source, cell_id, nbgrader={"grade_id": cell_id, "solution": True, "grade": True, "schema_version": 3})


def stripped(*cells):
    return student_notebooks.student_version(
        nbformat.v4.new_notebook(cells=list(cells)), "demo.ipynb", Catalogue(())
    ).cells


def test_every_solution_becomes_one_line_at_its_own_indentation():
    source = (
        "x = None\n### BEGIN SOLUTION\nx = 1\nx += 1\n### END SOLUTION\n"
        "def f():\n    ### BEGIN SOLUTION\n    return 2\n    ### END SOLUTION\n    return None"
    )
    (cell,) = stripped(answer(source))
    assert cell.source == "x = None\n# Your code here.\ndef f():\n    # Your code here.\n    return None"


@pytest.mark.parametrize(
    "source",
    [
        "### BEGIN SOLUTION\nx = 1",
        "x = 1\n### END SOLUTION",
        "### BEGIN SOLUTION\n### BEGIN SOLUTION\n### END SOLUTION",
        "### Begin solution\nx = 1\n### End solution",
        "x = 1",
    ],
    ids=["no end", "no beginning", "nested", "misspelt", "none"],
)
def test_an_answer_that_would_be_released_with_its_solution_is_refused_by_name(source):
    with pytest.raises(GradingError, match=r"demo\.ipynb, cell 'q1'"):
        stripped(answer(source))


@pytest.mark.parametrize(
    "spelt",
    [
        *("### Begin Solution", "###BEGIN SOLUTION", "### BEGIN SOLUTION ###", "### BEGIN\u00a0SOLUTION"),
        *("### BEGIN_SOLUTION", "### BEGIN-SOLUTIONS", "### beg\u0131n solution", "x = 0  ### BEGIN SOLUTION"),
    ],
)
@pytest.mark.parametrize("kind", ["code", "words"])
def test_a_second_mark_in_other_letters_beside_a_right_pair_is_refused(kind, spelt):
    begin, end, cell = (BEGIN_CODE, END_CODE, answer) if kind == "code" else (words.BEGIN, words.END, in_words)
    with pytest.raises(GradingError):
        released_cells(cell(f"{begin}\nsecret = 1\n{end}\n{spelt}\nsecret = 2"))
    with pytest.raises(GradingError):
        released_cells(cell(f"{begin}\nsecret = 1\n{spelt}\n{end}"))
    assert stripped(code("backendsolution = 1\n# at the end. Solution: see above"))


HEADING = words.heading("Your answer: 1.1, why")
WORDS_CATALOGUE = Catalogue(
    [
        Question("1.1", "1", "demo", "Why", (), (prose("why", "", "Why?", points=3), number("k", "N", None, "", "k?"))),
        Question("1.2", "1", "demo", "How", (), (prose("how", "", "How?", points=2),)),
    ]
)


def in_words(source, cell_id="q1-1-why", question="1.1", part="why", **more):
    about = {"grade_id": cell_id, "solution": True, "grade": True, "locked": False, "schema_version": 3}
    metadata = {"nbgrader": about, words.KEY: {"question": question, "part": part}}
    return nbformat.v4.new_markdown_cell(source, id=cell_id, metadata=metadata, **more)


def released_cells(*cells):
    notebook = nbformat.v4.new_notebook(cells=list(cells))
    return student_notebooks.student_version(notebook, "demo.ipynb", WORDS_CATALOGUE).cells


def test_a_model_answer_in_words_becomes_a_line_to_be_written_over_and_its_pictures_go():
    pictures = {"model.png": {"image/png": "bW9kZWw="}, "hint.png": {"image/png": "aGludA=="}}
    source = f"{HEADING}\n\n![](attachment:hint.png)\n{words.BEGIN}\nSecret.\n\n![](attachment:model.png)\n{words.END}"
    (cell,) = released_cells(in_words(source, attachments=pictures))
    assert cell.source == f"{HEADING}\n\n![](attachment:hint.png)\n{words.STUB}"
    assert cell.attachments == {"hint.png": {"image/png": "aGludA=="}}
    assert words.where_of(cell) == ("1.1", "why")
    assert cell.metadata.nbgrader.points == 3
    assert "editable" not in cell.metadata and cell.metadata.deletable is False


@pytest.mark.parametrize(
    "source",
    ["It bends.", f"{words.BEGIN}\nIt bends.", "### BEGIN SOLUTION\nIt bends.\n### END SOLUTION"],
    ids=["none", "no end", "the marks of code"],
)
def test_a_model_answer_that_would_be_released_is_refused_by_name(source):
    with pytest.raises(GradingError, match=r"demo\.ipynb, cell 'q1-1-why'"):
        released_cells(in_words(source))


def test_points_of_words_are_their_own_and_code_says_which_question_it_answers():
    kept = released_cells(
        in_words(f"{HEADING}\n{words.BEGIN}\nx\n{words.END}"),
        answer("k = None\n### BEGIN SOLUTION\nk = 1\n### END SOLUTION", "q1-1"),
        code('lab.answer("1.1", k=k)', "q1-1-answer"),
        in_words(f"**✎ 1.2, how**\n{words.BEGIN}\nx\n{words.END}", "q1-2-how", "1.2", "how"),
        answer("%%time\n### BEGIN SOLUTION\nk = 1\n### END SOLUTION", "q1-1b"),
        code('lab.answer("1.1", k=k)', "q1-1b-answer"),
    )
    assert [cell.metadata.nbgrader.get("points") for cell in kept if student_notebooks.is_answer(cell)] == [3, 1, 2, 1]
    assert kept[1].source == words.heading("Your answer: 1.1 (code, in the next cell)")
    assert kept[1].metadata == {"deletable": False, "editable": False}
    assert kept[2].source == "# ✎ Your answer: 1.1 " + 67 * "─" + "\nk = None\n# Your code here."
    assert kept[6].source.startswith("%%time\n")  # which must come first


def test_the_coloured_line_of_a_code_answer_ends_the_courses_text_before_it():
    question = nbformat.v4.new_markdown_cell("### Question 1.1", id="q1-1-text")
    text, kept, recording = released_cells(
        question, answer("### BEGIN SOLUTION\nk = 1\n### END SOLUTION", "q1-1"), code('lab.answer("1.1", k=k)')
    )
    assert text.source == "### Question 1.1\n\n" + words.heading("Your answer: 1.1 (code, in the next cell)")
    assert (text.id, kept.id, recording.cell_type) == ("q1-1-text", "q1-1", "code")
    assert question.source == "### Question 1.1"  # the instructor's stays as it is


def test_what_students_may_change_is_by_role_and_not_by_hand():
    kept = released_cells(
        nbformat.v4.new_markdown_cell("Text.", id="text", metadata={"editable": True}),
        code("student = ''", "parameters", tags=["parameters"]),
        code("1", "locked", deletable=True),
        code("2", "open-cell", tags=["open"], editable=False),
        answer("### BEGIN SOLUTION\n1\n### END SOLUTION", "q1"),
        in_words(f"{HEADING}\n{words.BEGIN}\nx\n{words.END}"),
    )
    assert {cell.id for cell in kept if cell.metadata.get("editable") is False} == {"text", "locked"}
    assert all(cell.metadata.deletable is False for cell in kept)


def test_student_notebooks_are_in_step_with_the_solutions():
    """If this fails, say `rotflex make-notebooks`."""
    derived = student_course.derive_notebooks(WITH_OPTIONAL)
    stored = {path.name: path.read_text(encoding="utf-8") for path in (ROOT / "notebooks").glob("*.ipynb")}
    assert stored.keys() == derived.keys()
    assert [name for name in derived if stored[name] != derived[name]] == []


PACKAGES = ("labcourse", "rotflex")


@pytest.fixture(scope="module")
def released(tmp_path_factory):
    return student_course.release(OURS, tmp_path_factory.mktemp("release") / "out")


@pytest.fixture(scope="module")
def installed(released, tmp_path_factory):
    """The folder that the release's wheels are unpacked into, as pip does."""
    folder = tmp_path_factory.mktemp("installed")
    for wheel in (released.folder / "wheels").glob("*.whl"):
        shutil.unpack_archive(wheel, folder, "zip")
    return folder


def test_a_release_holds_what_a_student_needs_and_nothing_else(released, installed):
    top = "LICENSE README.md notebooks pyproject.toml wheels"
    assert {path.name for path in released.folder.iterdir()} == set(top.split())
    suffixes = {".py", ".js", ".css", ".ipynb", ".json", ".html", ".typ", ".mplstyle", ".svg"}
    about = [path for path in installed.iterdir() if path.suffix == ".dist-info"]
    assert {path.name.partition("-")[0] for path in about} == {"labcourse", "rotflex"}
    brought = [
        path for path in installed.rglob("*") if path.is_file() and path.relative_to(installed).parts[0] in PACKAGES
    ]
    assert {path.suffix for path in brought} <= suffixes
    assert {path.name for path in brought if path.suffix == ".json"} == {
        "another_arm.json",
        "answers.schema.json",
        "course.json",
        "default_setting_overrides.json",
        "package.json",  # of JupyterLab's extension
    }


@pytest.mark.parametrize(
    ("policy", "said"),
    [(BenchPolicy(), "own virtual bench"), (BenchPolicy("real", benches=("north",)), "laboratory's own bench")],
)
def test_the_readme_says_whose_the_bench_is(tmp_path, policy, said):
    course = replace(OURS, settings=replace(OURS.settings, bench=policy))
    student_course.build(course, tmp_path / "out")
    readme = (tmp_path / "out" / "README.md").read_text(encoding="utf-8")
    assert said in readme and "    .venv\\Scripts\\pip install ." in readme.splitlines()


def test_a_release_has_none_of_the_instructors_modules(installed):
    here = {path.relative_to(ROOT) for name in PACKAGES for path in (ROOT / name).rglob("*.py")}
    there = {path.relative_to(installed) for path in installed.rglob("*.py")}
    assert here - there == {path for path in here if path.is_relative_to("labcourse/grading")}
    assert there <= here


def test_a_release_holds_nothing_of_the_modules_that_the_course_withholds(installed):
    names = ("design", "model", "observers", "sampled", "signals.flat", "symbolic")
    assert OURS.withheld == tuple(f"rotflex.{name}" for name in names)
    for module in OURS.withheld:
        path = f"{module.replace('.', '/')}.py"
        stub = ast.parse((installed / path).read_text(encoding="utf-8")).body
        assert [type(statement) for statement in stub] == [ast.Raise]
        done = _run_in(installed, "-c", f"import {module}")
        assert (done.returncode, done.stderr.splitlines()[-1].partition(":")[0]) == (1, "ImportError")
        assert f"{module} is not in your course" in done.stderr


def test_hidden_files_and_what_python_leaves_are_not_released_from_wherever(tmp_path, monkeypatch):
    package, data = tmp_path / "lab_of_ours", tmp_path / "data"
    stray = [".env", ".git/config", ".ipynb_checkpoints/01-checkpoint.ipynb", "__pycache__/x.py", "x.pyc"]
    for folder in (package, package / "deep" / "down", data, data / "deep"):
        for name in (*stray, "kept.py"):
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_text("")
    monkeypatch.syspath_prepend(tmp_path)
    (package / "__init__.py").write_text("")
    monkeypatch.setattr(type(OURS), "data", data)
    course = replace(OURS, packages=("rotflex", package.name))
    made = student_course.release(course, tmp_path / "out", with_data=True)
    with zipfile.ZipFile(made.archive) as archive:
        packed = archive.namelist()
    there = [path.relative_to(made.folder.parent).as_posix() for path in made.folder.rglob("*") if path.is_file()]
    assert sorted(packed) == sorted(there) and sum(name.endswith("/kept.py") for name in packed) == 2
    for wheel in (made.folder / "wheels").glob("*.whl"):
        packed += zipfile.ZipFile(wheel).namelist()
    assert sum(name.endswith("/kept.py") for name in packed) == 2 + 2 + 2  # of the data, its copy, and the package
    assert not [name for name in packed if "/." in name or "__pycache__" in name or name.endswith(".pyc")]


def test_no_line_of_a_solution_is_left_in_the_released_notebooks(released):
    for path in OURS.notebooks:
        text = (released.folder / "notebooks" / path.name).read_text(encoding="utf-8")
        assert "SOLUTION" not in text
        kept = {cell["id"]: "".join(cell["source"]).split("\n") for cell in json.loads(text)["cells"]}
        for cell in student_notebooks.read(path).cells:
            for line in _solution_lines(cell.source):
                assert line not in kept[cell.id]


def _solution_lines(source):
    inside, lines = False, []
    for line in source.split("\n"):
        begin, end = (student_notebooks.BEGIN_CODE, words.BEGIN), (student_notebooks.END_CODE, words.END)
        inside = (inside or line.strip() in begin) and line.strip() not in end
        if inside and len(line.strip()) > 3 and line.strip() not in begin:
            lines.append(line)
    return lines


def test_the_zip_holds_the_folder_and_is_the_same_every_time(released, tmp_path):
    again = student_course.release(OURS, tmp_path)
    assert again.archive.read_bytes() == released.archive.read_bytes()
    with zipfile.ZipFile(again.archive) as packed:
        names = set(packed.namelist())
        assert {entry.date_time[:3] for entry in packed.infolist()} == {(2020, 2, 2)}
    assert names == {
        f"rotflex-course/{path.relative_to(again.folder).as_posix()}"
        for path in again.folder.rglob("*")
        if path.is_file()
    }


def test_the_wheels_say_what_they_need_and_bring_the_course(released, installed):
    project = tomllib.loads((released.folder / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    wheels = {path.name for path in (released.folder / "wheels").iterdir()}
    assert {one.rpartition("/")[2] for one in project["dependencies"]} == wheels
    (ours,) = metadata.distributions(name="rotflex", path=[str(installed)])
    version = ours.version
    assert re.fullmatch(rf"{rotflex.__version__}\+course\.[0-9a-f]+", version)
    original = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert set(ours.requires) == {*original["dependencies"], f"labcourse=={labcourse.__version__}"}
    (engine,) = metadata.distributions(name="labcourse", path=[str(installed)])
    assert not [one for one in engine.requires if "jupytext" in one]
    assert engine.metadata.get_all("Provides-Extra") == ["report"]
    assert [one.value for one in ours.entry_points if one.group == "labcourse.courses"] == ["rotflex.course"]
    assert {path.name for path in (installed / "rotflex" / "course" / "notebooks").glob("*.ipynb")} == set(
        released.notebooks
    )


def test_the_released_command_has_no_instructors_commands(installed):
    done = _run_in(installed, "-m", "rotflex.cli", "--help")
    assert done.returncode == 0, done.stderr
    assert "│ lab " in done.stdout
    assert "│ grade " not in done.stdout and "│ release " not in done.stdout


def _run_in(folder, *arguments):
    return subprocess.run([sys.executable, *arguments], cwd=folder, capture_output=True, text=True, check=False)


def test_an_earlier_release_is_only_replaced_when_asked_and_if_there_is_room(tmp_path, monkeypatch):
    write = student_course.files.write

    def full(target, content):
        if target.suffix == ".zip":
            raise OSError(errno.ENOSPC, "No space left on device")
        write(target, content)

    first = student_course.release(OURS, tmp_path)
    (first.folder / "notebooks" / "answers.json").write_text("{}")
    with pytest.raises(GradingError, match="--replace"):
        student_course.release(OURS, tmp_path)
    aside = first.folder.rename(tmp_path / "aside")
    with pytest.raises(GradingError, match="--replace"):  # the zip alone is one, too
        student_course.release(OURS, tmp_path)
    aside.rename(first.folder)
    with monkeypatch.context() as patch, pytest.raises(OSError, match="No space"):
        patch.setattr(student_course.files, "write", full)
        student_course.release(OURS, tmp_path, replace=True)
    assert (first.folder / "notebooks" / "answers.json").exists()
    student_course.release(OURS, tmp_path, replace=True)
    assert not (first.folder / "notebooks" / "answers.json").exists()
    assert not [path for path in tmp_path.iterdir() if path.name.startswith(".")]


def test_a_notebook_that_nothing_leads_to_is_not_deleted_but_reported(tmp_path):
    (tmp_path / "solutions").mkdir()
    nbformat.write(nbformat.v4.new_notebook(cells=[code("1")]), tmp_path / "solutions" / "00_start.ipynb")
    (tmp_path / "notebooks").mkdir()
    (tmp_path / "notebooks" / "mine.ipynb").write_text("precious")
    with pytest.raises(GradingError, match=r"mine\.ipynb"):
        student_course.write_notebooks(replace(OURS, folder=tmp_path / "solutions"))
    assert (tmp_path / "notebooks" / "mine.ipynb").read_text() == "precious"
