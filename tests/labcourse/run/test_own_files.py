"""Which of a student's files come along to a run, and what is told of the others."""

from pathlib import PurePosixPath

from labcourse import files
from labcourse.answers import own_files
from labcourse.problems import Code, Problem

COURSE = ["01_springs.ipynb"]


def choice(*names, size=10, modules=()):
    return own_files.choose([(PurePosixPath(name), size) for name in names], COURSE, modules)


def test_what_a_student_put_there_comes_along():
    names = ["helpers.py", "tools/fits.py", "tools/__init__.py", "data/sweep 1.csv", "messung_ü.txt", "scratch.ipynb"]
    # Folders of these names hide no module of Python's: they hold data.
    names += ["old/01_springs.ipynb", "test/a.csv", "numpy/a.csv", "code/b.py", "Makefile", "springlab.py"]
    for name in names:
        assert choice(name) == ([PurePosixPath(name)], [])


def test_what_is_the_courses_or_a_programs_stays_behind_without_a_word():
    names = ["01_springs.ipynb", "01_Springs.IPYNB", "answers.json", "old/answers.json", "answers.broken.json"]
    names += ["course.json", ".git/config", ".ipynb_checkpoints/a-checkpoint.ipynb", "tools/.env", "~$report.docx"]
    names += ["__pycache__/helpers.cpython-311.pyc", "__MACOSX/helpers.py", "01_springs.before-restore.ipynb"]
    for name in [*names, "ada-receipts.txt"]:
        assert choice(name) == ([], [])


def test_a_virtual_environment_stays_behind_whatever_its_name():
    assert choice("env/pyvenv.cfg", "env/lib/site.py", "env2/a.py") == ([PurePosixPath("env2/a.py")], [])


def test_number_and_size_are_bounded_and_those_of_the_folder_itself_come_first():
    for more, told in ((20, 20), (30, 21)):
        names = [f"f{number:03}" for number in range(own_files.MAX_FILES + more)]
        paths, notes = choice(*names)
        assert [str(path) for path in paths] == names[: own_files.MAX_FILES]
        assert len(notes) == told
        assert (notes[-1] == Problem.of(Code.MORE_OWN_FILES_REFUSED, count=10)) == (more == 30)
    paths, notes = choice("a/1", "a/2", "a/3", "b", size=own_files.MAX_FILE)
    assert [str(path) for path in paths] == ["b", "a/1", "a/2"]
    why = Problem.of(Code.OWN_FILES_TOO_LARGE, most=own_files.MAX_TOTAL)
    assert notes == [Problem.of(Code.OWN_FILE_REFUSED, "a/3", why=why)]


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
    (tmp_path / "work" / "u\u0308ber.csv").write_bytes(b"1")  # as macOS names it
    contents, notes = own_files.read(tmp_path / "work", COURSE)
    assert contents == {"tools/fits.py": b"a = 1\r\n", "\u00fcber.csv": b"1"}
    assert [(note.code, note.where) for note in notes] == [(Code.OWN_FILE_REFUSED, name) for name in ("all", "link")]


HARMFUL = {
    Problem.of(Code.WRITTEN_BY_RUN): ["cell_reports.jsonl/a.txt", "Cell_Reports.JSONL"],
    Problem.of(Code.CHANGES_SETTINGS, program="matplotlib"): ["matplotlibrc", "tools/matplotlibrc"],
    Problem.of(Code.HIDES_MODULE, module="__main__"): ["__main__.py"],
    Problem.of(Code.HIDES_MODULE, module="numpy"): [
        "numpy.py",
        "NumPy.PY",
        "numpy/__init__.py",
        "numpy/__init__.cpython-312-x86_64-linux-gnu.so",
    ],
    Problem.of(Code.HIDES_MODULE, module="statistics"): ["statistics.py", "statistics.cpython-311-x86_64-linux-gnu.so"],
    Problem.of(Code.HIDES_MODULE, module="nbformat"): ["nbformat.abi3.so"],
    Problem.of(Code.HIDES_MODULE, module="ipython"): ["IPython.py"],
    Problem.of(Code.HIDES_MODULE, module="sitecustomize"): ["sitecustomize.py", "sitecustomize.pyc"],
    Problem.of(Code.HIDES_MODULE, module="mine"): ["mine.py", "mine/__init__.py"],
    Problem.of(Code.OWN_FILE_TOO_DEEP, most=8): ["a/b/c/d/e/f/g/h/i/j.py"],
    Problem.of(Code.UNUSUAL_NAME): [
        "x" * 300,
        "a\\..\\b.txt",
        "a\\b.py",
        "\x1b[2J.txt",
        "a\x1b[31m.py",
        "\u202etxt.py",
    ],
}


def test_what_is_meant_to_harm_or_no_system_takes_does_not_come_along_and_is_told():
    for why, names in HARMFUL.items():
        for name in names:
            told = Problem.of(Code.OWN_FILE_REFUSED, files.shown(name), why=why)
            assert choice(name, modules=["mine"]) == ([], [told])
    assert len(choice("numpy/__init__.py", "numpy/linalg/extra.py")[1]) == 2  # all files of such a package
