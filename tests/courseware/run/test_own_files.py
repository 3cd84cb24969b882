"""Which of a student's files come along to a run, and what is told of the others."""

from __future__ import annotations

import time
from pathlib import PurePosixPath

import pytest

from rotflex.courseware.run import own_files

COURSE = ["01_springs.ipynb"]


def choice(*names, size=10, modules=()):
    return own_files.chosen([(PurePosixPath(name), size) for name in names], COURSE, modules)


@pytest.mark.parametrize(
    "name",
    [
        "helpers.py",
        "tools/fits.py",
        "tools/__init__.py",
        "data/sweep 1.csv",
        "messung_ü.txt",
        "scratch.ipynb",
        "old/01_springs.ipynb",
        # Folders of these names hide no module of Python's: they hold data.
        "test/a.csv",
        "numpy/a.csv",
        "code/b.py",
        "Makefile",
    ],
)
def test_what_a_student_put_there_comes_along(name):
    assert choice(name) == own_files.Chosen((PurePosixPath(name),), ())


@pytest.mark.parametrize(
    "name",
    [
        "01_springs.ipynb",
        "01_Springs.IPYNB",
        "answers.json",
        "old/answers.json",
        "answers.broken.json",
        "course.json",
        ".git/config",
        ".ipynb_checkpoints/a-checkpoint.ipynb",
        "tools/.env",
        "__pycache__/helpers.cpython-311.pyc",
        "__MACOSX/helpers.py",
        "~$report.docx",
        "01_springs.before-restore.ipynb",
        "ada-receipts.txt",
    ],
)
def test_what_is_the_courses_or_a_programs_stays_behind_without_a_word(name):
    assert choice(name) == own_files.Chosen((), ())


@pytest.mark.parametrize(
    "name", ["numpy.py", "NumPy.py", "statistics.py", "statistics.cpython-311-x86_64-linux-gnu.so", "numpy/__init__.py"]
)
def test_a_module_of_a_name_that_python_has_is_told(name):
    found = choice(name)
    module = name.partition("/")[0].partition(".")[0].lower()
    assert found.paths == ()
    assert found.notes == (
        f"{name} does not come along: Python has a module {module} already; give yours another name.",
    )


def test_all_files_of_such_a_package_are_told():
    assert len(choice("numpy/__init__.py", "numpy/linalg/extra.py").notes) == 2


def test_so_is_one_of_the_courses_packages():
    assert choice("springlab.py").notes == ()
    assert "has a module springlab" in choice("springlab.py", modules=["springlab"]).notes[0]


@pytest.mark.parametrize("name", ["sitecustomize.py", "__main__.py", "matplotlibrc", "sub/matplotlibrc"])
def test_what_would_change_how_python_or_a_library_works_is_told(name):
    found = choice(name)
    assert found.paths == () and name in found.notes[0]


def test_a_virtual_environment_stays_behind_whatever_its_name():
    assert choice("env/pyvenv.cfg", "env/lib/site.py", "env2/a.py").paths == (PurePosixPath("env2/a.py"),)


def test_size_and_number_are_bounded_and_small_files_are_not_lost_for_a_large_one():
    found = own_files.chosen([(PurePosixPath("a.bin"), own_files.MAX_FILE + 1), (PurePosixPath("b.py"), 1)], COURSE)
    assert found.paths == (PurePosixPath("b.py"),)
    assert found.notes == ("a.bin does not come along: it has more than 10 MB.",)
    names = [f"f{number:03}" for number in range(own_files.MAX_FILES + 30)]
    many = choice(*names)
    assert [str(path) for path in many.paths] == names[: own_files.MAX_FILES]
    assert len(many.notes) == 21 and "10 more files" in many.notes[-1]
    heavy = choice("a", "b", "c", "d", size=own_files.MAX_FILE)
    assert len(heavy.paths) == 3 and "your own files have more than 30 MB" in heavy.notes[0]


@pytest.mark.parametrize("name", ["a/b/c/d/e/f/g/h/i/j.py", "x" * 300, "a\x1b[31m.py", "a\\b.py"])
def test_paths_that_no_system_takes_are_told(name):
    found = choice(name)
    assert found.paths == () and len(found.notes) == 1


def test_files_are_read_from_a_folder_and_links_are_not_followed(tmp_path):
    (tmp_path / "work" / "tools").mkdir(parents=True)
    (tmp_path / "work" / "tools" / "fits.py").write_bytes(b"a = 1\r\n")
    (tmp_path / "work" / "env" / "lib").mkdir(parents=True)
    (tmp_path / "work" / "env" / "pyvenv.cfg").write_text("")
    (tmp_path / "work" / "env" / "lib" / "a.py").write_text("")
    (tmp_path / "work" / "01_springs.ipynb").write_text("{}")
    (tmp_path / "secret").write_text("secret")
    (tmp_path / "work" / "link").symlink_to(tmp_path / "secret")
    (tmp_path / "work" / "all").symlink_to(tmp_path)
    found = own_files.read(tmp_path / "work", COURSE)
    assert found == own_files.OwnFiles({"tools/fits.py": b"a = 1\r\n"}, [])


@pytest.mark.parametrize(
    ("name", "why"),
    [
        ("cell_reports.jsonl/a.txt", "a run writes a file of that name"),
        ("Cell_Reports.JSONL", "a run writes a file of that name"),
        ("tools/matplotlibrc", "it would change matplotlib's settings"),
        ("NumPy.PY", "Python has a module numpy already"),
        ("numpy/__init__.cpython-312-x86_64-linux-gnu.so", "Python has a module numpy already"),
        ("nbformat.abi3.so", "Python has a module nbformat already"),
        ("IPython.py", "Python has a module ipython already"),
        ("sitecustomize.pyc", "Python has a module sitecustomize already"),
        ("mine/__init__.py", "Python has a module mine already"),
        ("a\\..\\b.txt", "characters that cannot be seen"),
        ("\x1b[2J.txt", "characters that cannot be seen"),
        ("\u202etxt.py", "characters that cannot be seen"),
        ("x" * 300, "too long"),
    ],
)
def test_what_is_meant_to_harm_does_not_come_along_and_is_told(name, why):
    chosen = choice(name, modules=["mine"])
    assert chosen.paths == ()
    assert why in chosen.notes[0]


@pytest.mark.parametrize("fits", [True, False])
def test_characters_of_a_path(fits):
    name = "tools/" + "x" * (240 - len("tools/.txt") + (not fits)) + ".txt"
    assert bool(choice(name).paths) == fits and bool(choice(name).notes) != fits


def test_ten_thousand_files_take_no_time_and_are_told_in_a_few_words():
    began = time.monotonic()
    chosen = choice(*(f"many/{number}.txt" for number in range(10_000)))
    assert time.monotonic() - began < 5
    assert (len(chosen.paths), len(chosen.notes)) == (own_files.MAX_FILES, 21)
    assert "more files of yours do not come along" in chosen.notes[-1]
