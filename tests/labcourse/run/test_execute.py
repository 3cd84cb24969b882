"""Notebooks run at home, by the warm process and in kernels: whatever a cell does, the next notebook is run."""

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

from labcourse.answers.cell_reports import REPORTS_FILE
from labcourse.answers.schema import read_reports
from labcourse.errors import CheckError
from labcourse.run import execute, warm

pytestmark = pytest.mark.slow

STUBBORN = "import time\nwhile True:\n    try:\n        time.sleep(100)\n    except KeyboardInterrupt:\n        pass"


@pytest.fixture(params=["warm", "kernels"])
def run(request, tmp_path, monkeypatch):
    """A function that runs notebooks in ``tmp_path``, and returns what became of their cells."""
    is_warm = request.param == "warm"
    monkeypatch.setattr(warm, "CAN_FORK", is_warm)
    monkeypatch.setattr(warm, "_KernelClient" if is_warm else "_Warm", lambda *_, **__: pytest.fail("the other way"))

    def run_in(notebooks, **options):
        execute.run(notebooks, tmp_path, **{"parameters": {"student": "ada"}, **options})
        return {one.cell: one for one in read_reports((tmp_path / REPORTS_FILE).read_bytes()).cells}

    return run_in


def put(name, value):
    return f"import pathlib; _ = pathlib.Path({name!r}).write_text(str({value}))"


def left(folder):
    return {path.name: path.read_text() for path in folder.iterdir() if path.name != REPORTS_FILE}


def test_cells_are_run_in_order_with_their_ids_and_the_job_and_an_error_stops_none(run, tmp_path):
    ran = notebook(
        text("words", "not run"),
        code("a", 'student = "nobody"', ["parameters"]),
        code("b", f"from labcourse import job\n{put('student', '(student, job.STUDENT)')}"),
        code("c", "1 / 0"),
        code("empty", "  \n"),
        code("d", put("cell", 'get_ipython().get_parent()["metadata"]["cellId"]')),
        code("e", "await __import__('asyncio').sleep(0)\n" + put("last", "In[-2]")),
    )
    reports = run({"one.ipynb": ran})
    assert left(tmp_path) == {"student": "('nobody', 'ada')", "cell": "d", "last": ran["cells"][5]["source"]}
    assert [name for name, report in reports.items() if report.error] == ["c"] and list(reports) == list("abcde")


def test_each_notebook_has_a_process_of_its_own_that_has_named_nothing(run, tmp_path):
    loaded = put("names", "[name for name in ('fractions', 'Fraction', 'seen', 'student') if name in globals()]")
    begun = []
    run(
        {"one.ipynb": notebook(code("a", "seen = 1")), "two.ipynb": notebook(code("b", loaded))},
        imports=["import fractions", "from fractions import Fraction", "print('as some libraries do')"],
        report=begun.append,
    )
    assert left(tmp_path) == {"names": "['student']"}
    assert begun == ["one.ipynb", "two.ipynb"]


def test_a_run_is_marked_and_draws_nothing_unasked(run, tmp_path, monkeypatch):
    monkeypatch.setenv("IPYTHONDIR", str(tmp_path / "ipython"))
    monkeypatch.setenv("PYTHONSAFEPATH", "1")  # as the command has it; a student's own programs run as ever
    names = ["LABCOURSE_RUNNING", "TQDM_DISABLE", "LABCOURSE_PICTURES", "OMP_NUM_THREADS", "PYTHONSAFEPATH"]
    shows = "class Shown:\n    def _repr_png_(self):\n        raise SystemExit\nShown()"
    cell = f"import os; {put('told', f'[os.environ.get(name) for name in {names}]')}"
    run({"one.ipynb": notebook(code("a", cell), code("b", put("python", "__import__('sys').executable")))})
    assert run({"one.ipynb": notebook(code("c", shows))})["c"].error is None
    assert left(tmp_path) == {"told": "['check', '1', 'off', '1', None]", "python": sys.executable}


ENDS = {"dies": "import os; os._exit(3)", "exits": "exit()", "sleeps": "import time; time.sleep(99)"}


@pytest.mark.parametrize(
    "ends",
    [
        pytest.param(ENDS, id="in the end"),
        pytest.param({"stubborn": STUBBORN}, id="only if it is made to", marks=pytest.mark.scheduled),
    ],
)
def test_after_a_cell_that_does_not_end_by_itself_the_next_notebook_is_run(run, tmp_path, monkeypatch, ends):
    monkeypatch.setattr(warm, "GRACE", 0.5 if "stubborn" in ends else warm.GRACE)
    ran = {
        f"{way}.ipynb": notebook(
            code(f"{way}-before", put(way, 1)), code(way, source), code(f"{way}-after", put(f"{way}-after", 1))
        )
        for way, source in ends.items()
    }
    reports = run(ran | {"z.ipynb": notebook(code("z", put("z", 1)))}, cell_timeout=2)
    assert set(left(tmp_path)) == {*ends, "z"} | ({"sleeps-after"} if "sleeps" in ends else set())
    assert all(reports[way].error is not None or not reports[way].finished for way in ends)
    assert reports["z"].finished


@pytest.mark.parametrize("broken", ["another version", "an import that fails"])
def test_where_the_warm_runner_cannot_run_kernels_do(tmp_path, monkeypatch, broken):
    customize = "from importlib import metadata\nmetadata.version = lambda name: '9.99'"
    if broken == "another version":
        (tmp_path / "sitecustomize.py").write_text(customize)
        monkeypatch.setenv("PYTHONPATH", f"{tmp_path}{os.pathsep}{ROOT}")
    ran = notebook(code("a", put("done", "'debugpy' in __import__('sys').modules")))
    imports = ["import no_such_module_anywhere"] if broken != "another version" else []
    execute.run({"one.ipynb": ran}, tmp_path, parameters={}, imports=imports)
    assert (tmp_path / "done").read_text() == "True"  # a kernel has imported it, and the warm process does not


def test_a_kernel_that_does_not_start_is_an_error_that_says_what_to_do(tmp_path, monkeypatch):
    (tmp_path / "kernel.py").write_text("")
    monkeypatch.setattr(warm, "KERNEL", tmp_path / "kernel.py")
    monkeypatch.setattr(warm, "CAN_FORK", False)
    with pytest.raises(CheckError, match="ipykernel"):
        execute.run({"one.ipynb": notebook(code("a", "1"))}, tmp_path, parameters={})


def test_a_runner_that_was_killed_is_an_error(tmp_path):
    kill = "import os, signal; os.kill(os.getppid(), signal.SIGKILL)"
    with pytest.raises(CheckError, match="lack of memory"):
        execute.run({"one.ipynb": notebook(code("a", kill))}, tmp_path, parameters={})


def alive(process):
    with contextlib.suppress(ProcessLookupError):
        os.kill(process, 0)
        return Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    return False


@pytest.mark.parametrize(
    ("can_fork", "ending"),
    [(True, "SIGINT"), (True, "SIGKILL"), (False, "SIGHUP"), (False, "SIGKILL")],
    ids=["warm, Ctrl-C", "warm, killed", "kernels, terminal closed", "kernels, killed"],
)
@pytest.mark.skipif(not Path("/proc").is_dir(), reason="processes are looked for in /proc")
def test_no_process_is_left_behind(tmp_path, can_fork, ending):
    program = f"""
import pathlib, signal, sys
signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell has its background ignore it
signal.signal(signal.SIGHUP, signal.default_int_handler)  # as the command has it
sys.path[:0] = [{str(ROOT)!r}, {str(ROOT / "tests/helpers")!r}]
from made_notebooks import code, notebook
from labcourse.run import execute, warm
warm.CAN_FORK = {can_fork}
cell = "import os, pathlib, time; pathlib.Path('pid').write_text(str(os.getpid())); time.sleep(300)"
ran = {{"a": notebook(code("a", cell)), "b": notebook(code("b", "1"))}}
execute.run(ran, pathlib.Path({str(tmp_path)!r}), parameters={{}})
"""
    (temporary := tmp_path / "temporary").mkdir()
    environment = {**os.environ, "TMPDIR": str(temporary)}
    options = {"stderr": subprocess.DEVNULL, "start_new_session": True}
    child = subprocess.Popen([sys.executable, "-c", program], env=environment, **options)
    try:
        until = time.monotonic() + 60
        while not (tmp_path / "pid").exists() or not (tmp_path / "pid").read_text():
            assert child.poll() is None and time.monotonic() < until
            time.sleep(0.05)
        runs_cells = int((tmp_path / "pid").read_text())
        others = {int(one.name) for one in Path("/proc").iterdir() if one.name.isdigit() and _parent(one) == child.pid}
        assert others and (runs_cells in others) is not can_fork
        if ending == "SIGKILL":
            child.kill()
        else:
            os.killpg(child.pid, getattr(signal, ending))  # a terminal signals all of a command's processes
        child.wait(timeout=30)
        until = time.monotonic() + 15  # after SIGKILL, they find out for themselves
        while any(map(alive, {*others, runs_cells})) and time.monotonic() < until:
            time.sleep(0.1)
        assert not any(map(alive, {*others, runs_cells}))
        assert ending == "SIGKILL" or list(temporary.glob("labcourse-*")) == []
    finally:
        child.kill()


def _parent(process):
    with contextlib.suppress(OSError):
        return int((process / "stat").read_text().rpartition(")")[2].split()[1])
    return None
