"""Notebooks are run as JupyterLab would, with a real kernel each; whatever a cell does, others run, and it is told."""

import contextlib
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from checkout import ROOT
from made_notebooks import code, notebook, text

from labcourse.errors import CheckError
from labcourse.run import execute
from labcourse.run.execute import Broken

pytestmark = pytest.mark.slow

STUBBORN = "import time\nwhile True:\n    try:\n        time.sleep(100)\n    except KeyboardInterrupt:\n        pass"


def run(folder, notebooks, **options):
    return execute.run(notebooks, folder, **{"parameters": {"student": "ada"}, **options})


def put(name, value):
    return f"import pathlib; _ = pathlib.Path({name!r}).write_text(str({value}))"


def left(folder):
    return {path.name: path.read_text() for path in folder.iterdir()}


def test_cells_are_run_in_order_with_their_ids_and_parameters_and_an_error_stops_none(tmp_path):
    ran = notebook(
        text("words", "not run"),
        code("a", 'student = "nobody"', ["parameters"]),
        code("b", put("student", "student")),
        code("c", "1 / 0"),
        code("empty", "  \n"),
        code("d", put("cell", 'get_ipython().get_parent()["metadata"]["cellId"]')),
        code("e", "await __import__('asyncio').sleep(0)\n" + put("last", "In[-2]")),
    )
    assert run(tmp_path, {"one.ipynb": ran}) == ()
    assert left(tmp_path) == {"student": "ada", "cell": "d", "last": ran["cells"][5]["source"]}


def test_without_a_cell_for_them_parameters_come_first(tmp_path):
    run(tmp_path, {"one.ipynb": notebook(code("a", put("student", "student")))})
    assert left(tmp_path) == {"student": "ada"}


def test_each_notebook_has_a_kernel_of_its_own_that_has_imported_and_named_nothing(tmp_path):
    loaded = put("loaded", "('fractions' in sys.modules, 'fractions' in dir(), 'seen' in dir(), 'first' in dir())")
    run(
        tmp_path,
        {"one.ipynb": notebook(code("a", "seen = 1")), "two.ipynb": notebook(code("b", "import sys; " + loaded))},
        imports=["import fractions", "import no_such_module_anywhere", "from fractions import Fraction"],
        first=lambda name: f"first = {name!r}" if name == "two.ipynb" else "",
    )
    assert left(tmp_path) == {"loaded": "(True, False, False, True)"}


def test_a_run_is_marked_and_shows_nothing(tmp_path, monkeypatch):
    monkeypatch.setenv("IPYTHONDIR", str(tmp_path / "ipython"))
    names = ["LABCOURSE_RUNNING", "TQDM_DISABLE", "LABCOURSE_PICTURES", "OMP_NUM_THREADS"]
    cell = f"import os; {put('told', f'[os.environ[name] for name in {names}]')}"
    run(tmp_path, {"one.ipynb": notebook(code("a", cell), code("b", put("python", "__import__('sys').executable")))})
    assert left(tmp_path) == {"told": "['check', '1', 'off', '1']", "python": sys.executable}


@pytest.mark.parametrize(
    ("source", "how", "gone"),
    [
        ("import os; os._exit(3)", execute.DIED, True),
        ("exit()", execute.EXITED, True),
        ("import time; time.sleep(100)", execute.TIMED_OUT, False),
        (STUBBORN, execute.TIMED_OUT, True),
    ],
    ids=["dies", "exits", "sleeps", "does not stop"],
)
def test_a_cell_that_does_not_end_by_itself_is_named_and_the_next_notebook_is_run(
    tmp_path, monkeypatch, source, how, gone
):
    monkeypatch.setattr(execute, "GRACE", 0.5)
    one = notebook(code("a", put("a", 1)), code("bad", source), code("after", put("after", 1)))
    two = notebook(code("b", put("b", 1)))
    told = []
    found = run(
        tmp_path, {"one.ipynb": one, "two.ipynb": two}, cell_timeout=2, report=lambda *about: told.append(about)
    )
    assert found == (Broken("one.ipynb", "bad", how, gone),)
    assert set(left(tmp_path)) == {"a", "b"} | (set() if gone else {"after"})
    assert told[:2] == [("one.ipynb", 0, 4), ("one.ipynb", 1, 4)] and told[-1] == ("two.ipynb", 2, 2)


def test_what_cannot_be_begun_is_an_error_in_words(tmp_path):
    with pytest.raises(CheckError, match="ZeroDivisionError"):
        run(tmp_path, {"one.ipynb": notebook(code("a", "1"))}, first=lambda name: "1 / 0")


def test_a_kernel_that_does_not_start_is_an_error_that_says_what_to_do(tmp_path, monkeypatch):
    (tmp_path / "kernel.py").write_text("")
    monkeypatch.setattr(execute, "KERNEL", tmp_path / "kernel.py")
    with pytest.raises(CheckError, match="ipykernel"):
        run(tmp_path, {"one.ipynb": notebook(code("a", "1"))})


def alive(process):
    with contextlib.suppress(ProcessLookupError):
        os.kill(process, 0)
        return Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    return False


@pytest.mark.parametrize("ending", [signal.SIGINT, signal.SIGKILL], ids=["Ctrl-C", "killed"])
@pytest.mark.skipif(not Path("/proc").is_dir(), reason="processes are looked for in /proc")
def test_no_process_is_left_behind(tmp_path, ending):
    program = f"""
import pathlib, signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell has its background ignore it
sys.path[:0] = [{str(ROOT)!r}, {str(ROOT / "tests/helpers")!r}]
from made_notebooks import code, notebook
from labcourse.run import execute
cell = "import os, pathlib, time; pathlib.Path('pid').write_text(str(os.getpid())); time.sleep(300)"
ran = {{"a": notebook(code("a", cell)), "b": notebook(code("b", "1"))}}
execute.run(ran, pathlib.Path({str(tmp_path)!r}), parameters={{}})
"""
    child = subprocess.Popen([sys.executable, "-c", program], stderr=subprocess.DEVNULL)
    try:
        until = time.monotonic() + 60
        while not (tmp_path / "pid").exists() or not (tmp_path / "pid").read_text():
            assert child.poll() is None and time.monotonic() < until
            time.sleep(0.05)
        kernel = int((tmp_path / "pid").read_text())
        others = {int(one.name) for one in Path("/proc").iterdir() if one.name.isdigit() and _parent(one) == child.pid}
        assert kernel in others and len(others) >= 2  # the next one's, too
        child.send_signal(ending)
        child.wait(timeout=30)
        until = time.monotonic() + 15  # a killed one ends its kernels by their own watch
        while any(map(alive, others)) and time.monotonic() < until:
            time.sleep(0.1)
        assert not any(map(alive, others))
    finally:
        child.kill()


def _parent(process):
    with contextlib.suppress(OSError):
        return int((process / "stat").read_text().rpartition(")")[2].split()[1])
    return None
