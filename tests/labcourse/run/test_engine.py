"""papermill's engine ``labcourse``: outputs as nbclient's, one process for all notebooks, and errors as papermill's."""

import os
import shutil
import subprocess
import sys
import time
import tomllib
from pathlib import Path

import nbformat
import papermill
import pytest
from checkout import ROOT
from executed import executed, outputs
from inside_cells import CELLS
from inside_runs import notebook
from nbclient.exceptions import CellTimeoutError, DeadKernelError
from papermill import PapermillExecutionError

from labcourse.answers.schema import read_reports
from labcourse.run import warm
from labcourse.run.inside import outputs as limits

pytestmark = pytest.mark.slow

#: What cells write past Python. A kernel shows it when a thread of its own gets to it, at times below a later cell.
PAST_PYTHON = {
    "low-level": {"stdout": "low\n", "stderr": "level\n"},
    "c-library": {"stdout": "from C\n", "stderr": ""},
    "child": {"stdout": "from a child\n", "stderr": ""},
}


@pytest.fixture(autouse=True, scope="module")
def ended():
    yield
    warm.end()


@pytest.fixture(autouse=True)
def in_folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("PYTEST_CURRENT_TEST", raising=False)  # a warm process is kept while the environment is the same


def made(*cells):
    return nbformat.from_dict(notebook([*cells]))


def shown(ran, number):
    """Text of the streams of a cell, numbered from 0 after that of parameters."""
    return "".join(output.get("text", "") for output in ran.cells[number + 1].outputs)


def widgets(ran):
    """Return the states of widgets in a notebook."""
    return ran.metadata.widgets["application/vnd.jupyter.widget-state+json"].state


@pytest.fixture(scope="module")
def both(tmp_path_factory):
    """All cells by papermill's own engine and by ours: id → outputs, and the notebook."""
    whole = nbformat.from_dict(notebook(CELLS))
    for cell in whole.cells:
        cell.metadata.tags = [*cell.metadata.get("tags", []), "raises-exception"]
    found = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(
            "papermill.execute.raise_for_execution_errors", lambda *_: None
        )  # papermill does, for tagged ones too
        patch.delenv("PYTEST_CURRENT_TEST", raising=False)  # with it, a kernel does not look at its descriptors
        for engine in (None, "labcourse"):
            folder = tmp_path_factory.mktemp("run")
            ran = executed(whole, engine, cwd=folder, execution_timeout=60)
            found.append(({cell.id: outputs(cell, folder) for cell in ran.cells}, ran))
    return found


def of_python(shown):
    """Return what a cell has shown, without what is written past Python."""
    count, texts, others = shown
    for written in PAST_PYTHON.values():
        texts = {stream: text.replace(written[stream], "") for stream, text in texts.items()}
    return count, texts, others


@pytest.mark.parametrize("name", sorted({*CELLS} - {"not-text"}))  # that one shows the library's own lines
def test_a_cell_shows_what_nbclient_shows(both, name):
    (real, _), (ours, _) = both
    assert of_python(ours[name]) == of_python(real[name])


@pytest.mark.parametrize("name", PAST_PYTHON)
def test_what_a_cell_writes_past_python_is_shown_below_it(both, name):
    (real, _), (ours, _) = both
    assert ours[name][1] == PAST_PYTHON[name]
    for stream, text in PAST_PYTHON[name].items():
        assert text in "".join(texts[stream] for _count, texts, _others in real.values())


def test_metadata_are_those_of_nbclient(both):
    real, ours = (ran.metadata for _, ran in both)
    assert ours.keys() == real.keys() and ours.language_info == real.language_info
    first, second = (sorted(state.model_name for state in widgets(ran).values()) for _, ran in both)
    assert first == second != []
    for (_, theirs), (_, mine) in zip(*([(c.id, c) for c in ran.cells] for _, ran in both), strict=True):
        assert mine.metadata.papermill.keys() == theirs.metadata.papermill.keys()
        assert mine.metadata.papermill.status == theirs.metadata.papermill.status
        assert mine.metadata.papermill.start_time <= mine.metadata.papermill.end_time


def test_a_figure_is_shown_after_its_cell_and_a_widget_holds_its_output():
    plot = "import matplotlib.pyplot as plt\nplt.plot([1, 2])"
    widget = "import ipywidgets\nout = ipywidgets.Output()\nwith out:\n    print('held')"
    ran = executed(made(plot, widget))
    assert [output.output_type for output in ran.cells[1].outputs] == ["execute_result", "display_data"]
    assert "image/png" in ran.cells[1].outputs[1].data and ran.cells[2].outputs == []
    (state,) = (one for one in widgets(ran).values() if one.model_name == "OutputModel")
    assert state.state.outputs[0].text == "held\n"


PARENT = "import os, sys\nprint(os.getppid(), os.getcwd(), 'seen' in globals(), 'papermill' in sys.modules)\nseen = 1"


def test_notebooks_share_one_process_and_nothing_else_in_whatever_folder(tmp_path):
    (tmp_path / "a").mkdir()
    job = "from labcourse import job\nprint(job.FOLDER)"
    found = [
        shown(executed(made(PARENT), cwd=folder, progress_bar=True), 0).split() for folder in (None, tmp_path / "a")
    ]
    assert found[0][0] == found[1][0] != str(os.getpid())
    assert [one[1:] for one in found] == [[str(folder), "False", "False"] for folder in (tmp_path, tmp_path / "a")]
    assert shown(executed(made(job), cwd=tmp_path / "a"), 0) == f"{tmp_path / 'a'}\n"
    assert shown(executed(made(PARENT), environment={**os.environ, "OTHER": "1"}), 0).split()[0] != found[0][0]


def test_an_error_is_raised_and_marked_as_papermill_does(tmp_path):
    (tmp_path / "n.ipynb").write_text(nbformat.writes(made("1", "1 / 0", "2")))
    marked = []
    for engine in (None, "labcourse"):
        with pytest.raises(PapermillExecutionError, match="ZeroDivisionError"):
            papermill.execute_notebook("n.ipynb", "out.ipynb", engine_name=engine, progress_bar=False)
        ran = nbformat.read("out.ipynb", 4)
        states = [(cell.cell_type, cell.metadata.get("papermill", {}).get("status")) for cell in ran.cells]
        marked.append((states, [outputs(cell, tmp_path) for cell in ran.cells if cell.cell_type == "code"]))
    assert marked[0] == marked[1]


def test_with_errors_allowed_nothing_is_raised_and_no_cell_added(tmp_path):
    ran = papermill.execute_notebook(
        made("1 / 0", "'went on'"), "out.ipynb", engine_name="labcourse", allow_errors=True, progress_bar=False
    )
    assert [cell.outputs[0].output_type for cell in ran.cells[1:]] == ["error", "execute_result"]
    assert nbformat.read("out.ipynb", 4) == ran and "errors_allowed" not in ran.metadata.papermill
    with pytest.raises(PapermillExecutionError):  # the next one is not allowed any
        executed(made("1 / 0"), None)


@pytest.mark.parametrize("can_fork", [True, False])
def test_a_cell_that_ends_python_or_its_time_is_said(monkeypatch, can_fork):
    monkeypatch.setattr(warm, "CAN_FORK", can_fork)
    for source in ("import os\nos._exit(3)", "exit()"):
        with pytest.raises(DeadKernelError):
            executed(made(source, "1"), allow_errors=True)
    ran = executed(made("import time\ntime.sleep(60)", "'went on'"), execution_timeout=1, allow_errors=True)
    assert [cell.outputs[0].get("ename") for cell in ran.cells[1:]] == ["KeyboardInterrupt", None]


def test_a_cell_that_was_interrupted_after_its_time_is_a_timeout_as_nbclients():
    with pytest.raises(CellTimeoutError):
        executed(made("import time\ntime.sleep(60)"), execution_timeout=1)


#: What papermill itself fails at, or would be lost.
ODD = {
    "an empty description": ("# papermill_description=\nprint(1)", {}),
    "no kernel or language": ("print(1)", {"kernelspec": {}, "language_info": {}}),
    "braces in its output": ("print('{1}'[1])", {}),
}


@pytest.mark.parametrize(("source", "metadata"), ODD.values(), ids=ODD)
def test_what_is_odd_runs(source, metadata):
    node = made(source)
    node.metadata.update(metadata)
    assert shown(executed(node), 0) == "1\n"


def test_another_language_is_refused():
    node = made("x <- 1")
    node.metadata.language_info = {"name": "R"}
    with pytest.raises(ValueError, match="Python, and this one is in R"):
        executed(node)


ENDLESS = "for n in range(30):\n    print('x' * 99_999)\nprint('the end')"
CLEARED = """
from IPython.display import clear_output
for n in range(30):
    print("x" * 99_999)
    clear_output(wait=True)
print("end")
"""


def test_output_without_end_is_cut_and_said_and_the_next_cell_is_whole():
    ran = executed(made(ENDLESS, CLEARED, "print('next')"))
    assert len(shown(ran, 0)) < limits.MOST_OF_CELL and "Output cut" in shown(ran, 0)
    assert shown(ran, 1) == "end\n" and shown(ran, 2) == "next\n"


#: A cell that writes to the file of outputs what no kernel sends.
FORGES = """
writer = get_ipython().kernel.session.writer
for line in [*{lines!r}, "[" * 100_000, "0" * 3_000_000]:
    writer._file.write(line.encode() + b"\\n")
print("shown")
"""
FORGED = [
    "no JSON",
    '"text"',
    '{"msg_type": 3}',
    '{"msg_type": "stream"}',
    '{"msg_type": "execute_reply", "cut": true}',
    '{"msg_type": "display_data", "content": {"data": 5, "metadata": [], "transient": 7}}',
    '{"msg_type": "comm_open", "content": {"comm_id": {}, "data": {"state": {"_model_name": []}}}}',
    '{"msg_type": "execute_result", "content": {"data": {}, "metadata": {}}}',
]


def test_forged_lines_among_outputs_are_left_out():
    ran = executed(made(FORGES.format(lines=FORGED), "print('next')"))
    assert [shown(ran, number) for number in (0, 1)] == ["shown\n", "next\n"]
    nbformat.validate(ran)


def test_a_cell_may_remove_the_file_of_outputs_and_what_is_in_its_place():
    removes = "import os\npath = get_ipython().kernel.session.writer._file.name\nos.remove(path)\nprint('gone')"
    places = "os.mkfifo(path)\nprint('next')"
    ran = executed(made(removes, places))
    assert [shown(ran, number) for number in (0, 1)] == ["gone\n", "next\n"]


def test_without_a_fork_a_kernel_of_this_python_runs_it_and_reports_on_cells_and_one_line_says_so(
    tmp_path, monkeypatch, caplog
):
    monkeypatch.setattr(warm, "CAN_FORK", False)
    node = made("import sys\nprint(sys.executable)", "1 / 0", "2")
    ran = executed(node, reports=str(tmp_path / "log"), name="n.ipynb", allow_errors=True)
    assert shown(ran, 0) == f"{sys.executable}\n" and ran.cells[3].outputs[0].data["text/plain"] == "2"
    reports = read_reports((tmp_path / "log").read_bytes()).cells
    assert [one.cell for one in reports if one.error] == [node.cells[2].id]
    assert len([one for one in caplog.records if "kernel of its own" in one.message]) == 1


@pytest.fixture
def installed(tmp_path):
    """The environment of a program that finds the entry point, as the distribution publishes it."""
    points = tomllib.loads((ROOT / "labcourse/pyproject.toml").read_text())["project"]["entry-points"][
        "papermill.engine"
    ]
    (about := tmp_path / "site/labcourse-0.2.0.dist-info").mkdir(parents=True)
    lines = "".join(f"{name} = {value}\n" for name, value in points.items())
    (about / "entry_points.txt").write_text(f"[papermill.engine]\n{lines}")
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: labcourse\nVersion: 0.2.0\n")
    others = {name: value for name, value in os.environ.items() if name != "TQDM_DISABLE"}
    return {**others, "PYTHONPATH": f"{about.parent}{os.pathsep}{ROOT}"}


def program(text, environment):
    done = subprocess.run(
        [sys.executable, "-c", text], env=environment, capture_output=True, text=True, timeout=120, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


ORDERS = {
    "papermill first": "import papermill, labcourse.run.warm",
    "the engine first": "import labcourse.run.warm, papermill",
    "the check first": "import labcourse.run.check, papermill",
}


@pytest.mark.parametrize("imports", ORDERS.values(), ids=ORDERS)
def test_papermill_finds_the_engine_in_either_order_of_imports(installed, imports):
    find = (
        "from papermill.engines import papermill_engines\nprint(papermill_engines.get_engine('labcourse').__module__)"
    )
    assert program(f"{imports}\n{find}", installed) == "labcourse.run.engine\n"


def test_the_entry_point_imports_nothing(installed):
    modules = "sorted(name for name in sys.modules if name[:9] in ('labcourse', 'papermill'))"
    found = program(f"import sys, labcourse.run.engine\nprint(*{modules})", installed).split()
    assert found == ["labcourse", "labcourse.run", "labcourse.run.engine"]


def test_the_command_runs_a_notebook_with_its_progress_bar_and_its_parameters(installed, tmp_path):
    (tmp_path / "n.ipynb").write_text(nbformat.writes(made("print(student)")))
    command = [shutil.which("papermill", path=Path(sys.executable).parent), "n.ipynb", "out.ipynb"]
    words = ["--engine", "labcourse", "-p", "student", "ada"]
    done = subprocess.run([*command, *words], env=installed, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0 and "Executing" in done.stderr and "unknown" not in done.stderr, done.stderr
    assert nbformat.read(tmp_path / "out.ipynb", 4).cells[2].outputs[0].text == "ada\n"


def test_within_a_kernel_it_runs_and_the_kernel_goes_on(installed, monkeypatch):
    for name, value in installed.items():
        monkeypatch.setenv(name, value)
    run = "ran = papermill.execute_notebook(node, None, engine_name='labcourse')\nprint(ran.cells[0].outputs[0].text)"
    node = "node = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell('print(6 * 7)')])"
    within = executed(made(f"import nbformat, papermill\n{node}\n{run}", run, "print('goes on')"), None)
    assert "42\n" in shown(within, 0) and "42\n" in shown(within, 1) and shown(within, 2) == "goes on\n"


@pytest.mark.parametrize("ending", ["pass", "import os; os._exit(0)", "import os; os.kill(os.getpid(), 9)"])
def test_the_warm_process_ends_with_its_caller(installed, tmp_path, ending):
    (tmp_path / "n.ipynb").write_text(nbformat.writes(made("import os\nprint(os.getppid())")))
    run = "ran = papermill.execute_notebook('n.ipynb', None, engine_name='labcourse', progress_bar=False)"
    text = f"import papermill\n{run}\nprint(ran.cells[1].outputs[0].text, flush=True)\n{ending}"
    done = subprocess.run([sys.executable, "-c", text], env=installed, capture_output=True, text=True, check=False)
    until = time.monotonic() + 15
    while Path(f"/proc/{done.stdout.strip()}").exists() and time.monotonic() < until:
        time.sleep(0.05)
    assert int(done.stdout) and not Path(f"/proc/{done.stdout.strip()}").exists()
