"""What comes out of a notebook that is run inside is what comes out of a real kernel."""

from __future__ import annotations

import contextlib
import json
import re

import nbformat
import papermill
import pytest
from inside_runs import ENVIRONMENT, ROOT, notebook, run, specification

pytestmark = pytest.mark.slow

CELLS = {
    "first": "student, bench",
    "streams": "import os, sys, time\nprint('out')\nprint('err', file=sys.stderr)\nprint('äé∑', end='')",
    "streams-in-time": """
print("first")
time.sleep(0.4)
print("second", file=sys.stderr)
time.sleep(0.4)
print("third")
""",
    "result": "1 + 1",
    "last": "_ + 1, __",
    "out": "sorted(Out)[:3], In[-1]",
    "only-the-last": "4\n5",
    "quiet": "6;",
    "none": "None",
    "mime": """
class Rich:
    def __repr__(self): return "plain"
    def _repr_html_(self): return "<b>rich</b>"
    def _repr_latex_(self): return "$r$"
class Bundle:
    def _repr_mimebundle_(self, include=None, exclude=None):
        return {"text/plain": "bundle", "application/json": {"a": [1, 2]}}, {"application/json": {"expanded": True}}
display(Rich(), Bundle())
Rich()
""",
    "bad-repr": "class Bad:\n    def __repr__(self): raise ValueError('no')\nBad()",
    "display": """
from IPython.display import HTML, JSON, Image, Latex, Markdown, clear_output
display(HTML("<i>x</i>"), Markdown("*x*"), Latex("$x$"), JSON({"x": 1}), metadata={"of": "mine"})
display({"text/plain": "raw"}, raw=True)
""",
    "display-id": "handle = display('one', display_id='here')\nhandle.update('two')",
    "display-again": "handle.update('three')\ndisplay('another', display_id='here')",
    "clear": "print('gone')\nclear_output()\nprint('stays')",
    "clear-wait": "print('gone')\nclear_output(wait=True)\nprint('stays')",
    "clear-wait-for-nothing": "print('stays')\nclear_output(wait=True)",
    "plot": "import matplotlib.pyplot as plt\nplt.plot([1, 3, 2])\nplt.title('$x^2$');",
    "plots": "for n in (1, 2):\n    plt.figure(figsize=(2, 1))\n    plt.plot([0, n])\n    print(n)",
    "plots-shown": "plt.plot([1, 2])\nplt.show()\nprint('between')\nplt.plot([2, 1])\nplt.show()",
    "figures-closed": "plt.get_fignums(), plt.isinteractive(), plt.get_backend()",
    "figure-as-result": "figure, axes = plt.subplots(figsize=(2, 1))\nfigure",
    "inline": "%matplotlib inline\n%config InlineBackend.figure_formats = ['retina']\nplt.plot([1, 2]);",
    "show": "from rotflex import figures\nfigures.show(figures.joint_angles(), caption='**1**')",
    "picture": "figures.lumped_model()",
    "sympy": "import sympy\nsympy.init_printing()\nsympy.Symbol('x') ** 2 / 3",
    "time": "%time total = sum(range(10))",
    "timed-cell": "%%time\nprint('hello')",
    "capture": "%%capture held\nprint('hidden')\ndisplay(HTML('held'))\n7",
    "captured": "print(held.stdout)\nheld.outputs[0]",
    "writefile": "%%writefile note.txt\nhello",
    "shell": "!cat note.txt; echo error >&2",
    "shell-assigned": "lines = !echo there\nlines",
    "script": "%%bash\necho from bash",
    "who": "%who_ls int",
    "magic-error": "%no_such_magic",
    "help": "print?",
    "history": "%history -n 2-3",
    "error": "def divide(a):\n    return a / 0\ndivide(1)",
    "error-from": """
class Mine(Exception):
    pass
try:
    {}["key"]
except KeyError as error:
    raise Mine("told <b>so</b>") from error
""",
    "error-after-output": "print('before')\ndisplay('shown')\nraise RuntimeError",
    "error-group": "raise ExceptionGroup('two', [ValueError(1), TypeError(2)])",
    "syntax-error": "for",
    "indentation-error": "if True:\n  a = 1\n b = 2",
    "assertion": "assert 1 == 2, 'differs'",
    "exit-raised": "raise SystemExit('leaving')",
    "exit-called": "sys.exit(0)",
    "interrupt": "raise KeyboardInterrupt",
    "await": "import asyncio\nprint(await asyncio.sleep(0, 'waited'))\nawait asyncio.sleep(0, 8)",
    "await-error": "await asyncio.sleep(0)\nraise OSError('after a wait')",
    "loop": "loop = asyncio.get_running_loop()\nloop.is_running()",
    "task": "async def later():\n    await asyncio.sleep(0.05)\n    return 9\ntask = asyncio.create_task(later())",
    "task-done": "await task",
    "run-in-loop": "waits = later()\ntry:\n    asyncio.run(waits)\nfinally:\n    waits.close()",
    "low-level": "n = os.write(1, b'low\\n')\ntime.sleep(0.2)",
    "low-level-error": "n = os.write(2, b'level\\n')\ntime.sleep(0.2)",
    "c-library": "import ctypes\nc = ctypes.CDLL(None)\nn = c.puts(b'from C'), c.fflush(None)\ntime.sleep(0.2)",
    "child": "import subprocess\nn = subprocess.run(['echo', 'from a child'])\ntime.sleep(0.2)",
    "child-to-stdout": "subprocess.run(['true'], stdout=sys.stdout, stderr=sys.stderr, check=True).returncode",
    "system": "import os\nos.system('true')",
    "warning": "import warnings\nwarnings.warn('careful')",
    "logging": "import logging\nlogging.warning('careful')",
    "thread": "import threading\nt = threading.Thread(target=print, args=('in a thread',))\nt.start()\nt.join()",
    "thread-error": "t = threading.Thread(target=lambda: 1 / 0, name='t')\nt.start()\nt.join()",
    "slider": "import ipywidgets\nslider = ipywidgets.IntSlider(3, description='n')\ndisplay(slider)\nslider",
    "observed": "slider.observe(lambda change: print(change['new']), 'value')\nslider.value = 4",
    "main": "__name__, sys.modules['__main__'].__dict__ is globals()",
    "source": "import inspect\nprint(inspect.getsource(divide))",
    "shell-itself": "type(get_ipython()).__name__, 'IPKernelApp' in get_ipython().config",
    "arguments": "os.path.basename(sys.argv[0]), len(sys.argv)",
    "path": "[os.path.basename(p) for p in sys.path[sys.path.index('') :]], sys.path.count('')",
    "streams-themselves": """
[(s.isatty(), s.encoding, s.name, s.closed, isinstance(s.fileno(), int)) for s in (sys.stdout, sys.stderr)]
""",
    "stdin": "sys.stdin.read(), sys.stdin.isatty()",
    "environment": "[os.environ[name] for name in ('MPLBACKEND', 'TERM', 'PAGER', 'FORCE_COLOR', 'CLICOLOR')]",
    "reseeded": "import random\nrandom.random() != random.random()",
    "stdout-replaced": """
import contextlib, io
with contextlib.redirect_stdout(io.StringIO()) as taken:
    print("taken")
taken.getvalue()
""",
    "count": "get_ipython().execution_count",
}
# What fails in a kernel's own code, of which a traceback shows some lines.
WITHIN = {
    "input": "input('name?')",
    "getpass": "import getpass\ngetpass.getpass()",
    "not-text": "sys.stdout.write(3)",
}


@pytest.fixture(scope="module")
def ran(tmp_path_factory):
    """The same notebook run by papermill with a real kernel, and inside: cells by id, and the widgets' states."""
    made = notebook(CELLS | WITHIN)
    real, ours = tmp_path_factory.mktemp("real"), tmp_path_factory.mktemp("ours")
    done = run(specification({"n.ipynb": made}, ours), ours)
    assert (done.returncode, done.stderr) == (0, "")
    for cell in made["cells"]:
        cell["metadata"]["tags"] = [*cell["metadata"].get("tags", []), "raises-exception"]
    (real / "in.ipynb").write_text(json.dumps(made))
    with pytest.MonkeyPatch.context() as patch:
        patch.delenv("PYTEST_CURRENT_TEST")  # with which a kernel would not look at its descriptors
        for name, value in ENVIRONMENT.items():
            patch.setenv(name, value)
        parameters = {"student": "ada", "bench": "virtual"}
        with contextlib.suppress(papermill.PapermillExecutionError):  # cells had errors, it says in the end
            papermill.execute_notebook(
                real / "in.ipynb", real / "n.ipynb", parameters, progress_bar=False, cwd=real, execution_timeout=120
            )
    return [nbformat.read(folder / "n.ipynb", as_version=4) for folder in (real, ours)]


def plain(output):
    """An output without what differs from one run to the next."""
    return _tidy(json.loads(json.dumps(output)))


def _tidy(value):
    if isinstance(value, dict):
        return {key: _tidy(inner) for key, inner in value.items()}
    if isinstance(value, list):
        return [_tidy(inner) for inner in value]
    if not isinstance(value, str):
        return value
    value = re.sub(r"0x[0-9a-f]{6,}", "ADDRESS", value)
    value = re.sub(r"(\b|_)[0-9a-f]{32}\b", "ID", value)
    value = re.sub(r"ipykernel_\d+/\d+", "CELL", value)
    return re.sub(r"[\d.]+(e[-+]?\d+)? (s|ms|μs|µs|ns)\b", "TIME", value)


def by_id(executed):
    return {cell.id: cell for cell in executed.cells if cell.cell_type == "code"}


@pytest.mark.parametrize("name", CELLS)
def test_a_cells_outputs_are_a_real_kernels(ran, name):
    real, ours = (by_id(one)[name] for one in ran)
    assert [plain(output) for output in ours.outputs] == [plain(output) for output in real.outputs]
    assert ours.execution_count == real.execution_count


#: With nbclient and a real kernel, what goes into an output widget sometimes waits for ever.
OUTPUT_WIDGETS = {
    "interact": "import ipywidgets\n@ipywidgets.interact(n=(1, 5))\ndef shown(n=2):\n    print('n is', n)",
    "widget": "out = ipywidgets.Output()\ndisplay(out)\nwith out:\n    print('inside')\n    display('in it')",
    "after": "print('outside')\n[one['output_type'] for one in out.outputs]",
}


def test_what_is_printed_into_an_output_widget_goes_there_and_not_into_the_cell(tmp_path):
    done = run(specification({"n.ipynb": notebook(OUTPUT_WIDGETS)}, tmp_path), tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    executed = nbformat.read(tmp_path / "n.ipynb", as_version=4)
    found = by_id(executed)
    view = "application/vnd.jupyter.widget-view+json"
    assert [output.data.keys() for output in found["interact"].outputs] == [{view, "text/plain"}]
    assert [output.data.keys() for output in found["widget"].outputs] == [{view, "text/plain"}]
    printed, result = found["after"].outputs
    assert (printed.text, result.data["text/plain"]) == ("outside\n", "['stream', 'display_data']")
    stored = executed.metadata.widgets["application/vnd.jupyter.widget-state+json"]["state"].values()
    inside = [one["state"]["outputs"] for one in stored if one["model_name"] == "OutputModel"]
    # In order of their length: the widgets stand there by their random names.
    assert sorted([[output["output_type"] for output in outputs] for outputs in inside], key=len) == [
        ["stream"],
        ["stream", "display_data"],
    ]


@pytest.mark.parametrize("name", WITHIN)
def test_what_fails_within_a_real_kernel_fails_for_the_same_reason(ran, name):
    (real,), (ours,) = (by_id(one)[name].outputs for one in ran)
    assert real.ename in {"StdinNotImplementedError", "TypeError"}
    assert (ours.output_type, ours.ename, ours.evalue) == (real.output_type, real.ename, real.evalue)


def test_widgets_leave_the_state_that_a_real_kernel_leaves(ran):
    def states(executed):
        stored = executed.metadata.widgets["application/vnd.jupyter.widget-state+json"]["state"]
        return sorted(json.dumps(plain(one), sort_keys=True) for one in stored.values())

    real, ours = map(states, ran)
    assert len(real) > 2
    assert ours == real


def test_the_notebook_that_is_left_is_the_one_that_papermill_leaves(ran):
    real, ours = ran
    anchors = [cell for cell in real.cells if "papermill-error-cell-tag" in cell.metadata.get("tags", [])]
    left = [cell for cell in real.cells if cell not in anchors]
    # The cell of the parameters is new in each run, and so is its id.
    assert [cell.source for cell in ours.cells] == [cell.source for cell in left]
    assert ours.metadata.papermill.parameters == real.metadata.papermill.parameters


# --- the solution notebooks -------------------------------------------------------------------------------------------

SOLUTIONS = sorted((ROOT / "solutions").glob("*.ipynb"))


@pytest.fixture(scope="module")
def solutions(tmp_path_factory):
    """All solution notebooks, run inside one after the other."""
    folder = tmp_path_factory.mktemp("solutions")
    notebooks = {path.name: json.loads(path.read_text(encoding="utf-8")) for path in SOLUTIONS}
    done = run(specification(notebooks, folder, student=""), folder)
    assert done.returncode == 0, done.stderr
    return folder


@pytest.mark.parametrize("path", SOLUTIONS, ids=lambda path: path.stem)
def test_a_solution_notebooks_outputs_are_those_that_a_real_kernel_left_in_it(solutions, path):
    """Stored outputs are a real kernel's; that they are up to date is tested elsewhere, with nbval."""
    stored = by_id(nbformat.read(path, as_version=4))
    ours = by_id(nbformat.read(solutions / path.name, as_version=4))
    assert stored.keys() <= ours.keys()
    for name, cell in stored.items():
        assert [told(output) for output in ours[name].outputs] == [told(output) for output in cell.outputs], name


def told(output):
    """A stored output without its number (papermill's parameters count as a cell)."""
    found = {key: value for key, value in plain(output).items() if key != "execution_count"}
    if "data" in found:  # a widget's view has a random name and is not stored; what stands for it is
        found["data"] = {mime: data for mime, data in found["data"].items() if "widget-view" not in mime}
    return found


def test_a_run_to_which_nobody_listens_leaves_the_same_answers(solutions, tmp_path):
    short = [path for path in SOLUTIONS if path.name[:2] in ("00", "02")]
    notebooks = {path.name: json.loads(path.read_text(encoding="utf-8")) for path in short}
    assert run(specification(notebooks, student=""), tmp_path).returncode == 0
    deaf, listening = (json.loads((folder / "answers.json").read_text())["answers"] for folder in (tmp_path, solutions))
    assert "2.10" in deaf
    assert deaf == {question: listening[question] for question in deaf}
