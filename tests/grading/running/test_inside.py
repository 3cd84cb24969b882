"""The program that runs notebooks inside: what it leaves, how it ends; and nothing in a notebook stops the rest."""

import json

import pytest
from inside_runs import ENVIRONMENT, notebook, run, specification

from labcourse.run.inside import BROKEN, DIED, FINE, TIMED_OUT

pytestmark = pytest.mark.slow

NOTES = "answers.json"  # what the sandbox gives back
NOTE = f"""
def note(**what):
    import json
    with open({NOTES!r}, 'a') as file:
        file.write(json.dumps(what) + chr(10))
"""


QUIET = {
    "first": [
        "note(first=student, bench=bench)",
        "import sys, time\nsys.stdout.write('x' * 10**8)\nimport os\nn = os.write(1, b'x' * 10**7)",
        "import numpy as np, random, sympy.core.random\n"
        "note(drawn=[int(np.random.randint(2**31)), random.random(), sympy.core.random.random()])",
    ],
    "second": [
        "note(second=len(open('answers.json').readlines()))",
        "note(drawn=[int(__import__('numpy').random.randint(2**31)), __import__('random').random(),"
        " __import__('sympy').core.random.random()])",
    ],
    "errors": [
        "1 / 0",
        "raise SystemExit",
        "for",
        "input()",
        "%no_such_magic",
        "import sys\nsys.stdout = None",
        "note(errors=1)",
        "get_ipython().run_cell = None",
        "get_ipython().displayhook = None\n1",
        "raise KeyboardInterrupt",
    ],
    "modules": [
        "open('rotflex.py', 'w').write('planted = 1')\nopen('mine.py', 'w').write('value = 2')",
        "import mine, rotflex, sys",
        "note(mine=mine.value, planted=hasattr(rotflex, 'planted'), debugpy=bool(sys.modules.get('debugpy')))",
    ],
}


@pytest.fixture(scope="module")
def quiet(tmp_path_factory):
    folder = tmp_path_factory.mktemp("quiet")
    done = run(specification({name: notebook([NOTE, *cells]) for name, cells in QUIET.items()}), folder)
    assert (done.stdout.split(), done.stderr) == ([*QUIET], "")
    return done.returncode, [json.loads(line) for line in (folder / NOTES).read_text().splitlines()]


def noted(notes, name):
    return [note[name] for note in notes if name in note]


def test_errors_are_no_reason_to_stop_and_the_run_is_fine(quiet):
    code, notes = quiet
    assert code == FINE
    assert noted(notes, "errors") == [1]


def test_parameters_come_before_the_cells_and_files_are_carried_on(quiet):
    _, notes = quiet
    assert notes[0] == {"first": "ada", "bench": "virtual"}
    assert noted(notes, "second") == [2]


def test_each_notebook_has_random_numbers_of_its_own(quiet):
    _, notes = quiet
    first, second = noted(notes, "drawn")
    assert all(one != other for one, other in zip(first, second, strict=True))


def test_the_students_package_is_the_released_one_and_their_own_modules_are_found(quiet):
    _, notes = quiet
    assert {"mine": 2, "planted": False, "debugpy": False} in notes


def test_a_cell_over_its_time_is_stopped_and_exit_ends_its_notebook_alone(tmp_path):
    slow = ["while True: pass", "import asyncio\nawait asyncio.sleep(60)", "note(after='loops')"]
    leaving = ["note(before='exit')", "exit()", "note(after='exit')"]
    notebooks = {"slow": slow, "leaving": leaving, "last": ["note(after='all')"]}
    told = {name: notebook([NOTE, *cells]) for name, cells in notebooks.items()}
    assert run(specification({"slow": told["slow"]}, cell_timeout=1), tmp_path).returncode == TIMED_OUT
    assert run(specification({"leaving": told["leaving"], "last": told["last"]}), tmp_path).returncode == DIED
    notes = [json.loads(line) for line in (tmp_path / NOTES).read_text().splitlines()]
    assert notes == [{"after": "loops"}, {"before": "exit"}, {"after": "all"}]


def test_where_the_package_cannot_be_imported_nothing_is_run(tmp_path, monkeypatch):
    (tmp_path / "rotflex").mkdir()
    (tmp_path / "rotflex" / "__init__.py").write_text("raise OSError('half a package')")
    monkeypatch.setitem(ENVIRONMENT, "PYTHONPATH", str(tmp_path))
    done = run(specification({"first": notebook([NOTE, "note(ran=1)"])}), tmp_path)
    assert done.returncode == BROKEN
    assert "half a package" in done.stderr
    assert not (tmp_path / NOTES).exists()
