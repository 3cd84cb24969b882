"""What the cells of a notebook do when it is run inside is what they do in a real kernel.

What they output is discarded inside. So both are asked for what is left in other ways: results, errors, variables,
figures, files.
"""

import json

import pytest
from inside_cells import CELLS
from inside_facts import FACTS, facts, inside, observed, with_kernels
from inside_runs import ROOT, notebook
from nbclient.exceptions import DeadKernelError

from labcourse.answers.cell_reports import REPORTS_FILE
from labcourse.run.inside import DIED, FINE

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def ran(tmp_path_factory):
    made = {"n.ipynb": observed(notebook(CELLS))}
    real, ours = tmp_path_factory.mktemp("real"), tmp_path_factory.mktemp("ours")
    with_kernels(made, real)
    assert inside(made, ours) == FINE
    return real, ours


def by_source(folder):
    return {fact["source"]: fact for fact in facts(folder) if "source" in fact}


@pytest.mark.parametrize("name", CELLS)
def test_a_cell_does_what_it_does_in_a_real_kernel(ran, name):
    real, ours = (by_source(folder).get(CELLS[name]) for folder in ran)
    assert real is not None
    assert ours == real


def test_the_cells_ran_in_the_same_order_and_leave_the_same_names(ran):
    real, ours = map(facts, ran)
    assert len(set(CELLS.values())) == len(CELLS)  # or they could not be told apart
    assert [fact["source"] for fact in real if fact.get("source") in CELLS.values()] == list(CELLS.values())
    assert [fact.get("source") for fact in ours] == [fact.get("source") for fact in real]
    (names,), (our_names,) = ([fact["names"] for fact in one if "names" in fact] for one in (real, ours))
    assert {"waited", "caught", "ran", "done", "lines", "changes"} <= names.keys()
    assert our_names == names


def files(folder):
    """Path → bytes of what is left in a folder, besides facts and reports."""
    ours = {FACTS, REPORTS_FILE}
    kept = (path for path in folder.rglob("*") if path.is_file() and path.name not in ours and path.suffix != ".pyc")
    return {str(path.relative_to(folder)): path.read_bytes() for path in kept}


def test_the_files_that_are_left_are_the_same_to_the_last_byte(ran):
    real, ours = map(files, ran)
    assert {"later.png", "later.svg", "at-once.png", "note.txt", "copied.txt", "mine.py"} <= real.keys()
    assert ours == real


#: Cells that show on purpose what is not made or kept inside, for nobody will see it: → in a kernel, and inside.
MUTED = {
    """
asked = []
class Rich:
    def __repr__(self): return "plain"
    def _repr_html_(self): asked.append("html")
display(Rich())
asked
""": ("['html']", "[]"),
    """
from matplotlib.backends.backend_agg import FigureCanvasAgg
drawn, draw = [], FigureCanvasAgg.draw
FigureCanvasAgg.draw = lambda self, *args: (drawn.append(1), draw(self, *args))[1]
import matplotlib.pyplot as plt
plt.plot([1, 2])
plt.show()
bool(drawn)
""": ("True", "False"),
    """
print("kept")
kept = get_ipython().history_manager.outputs.values()
any(one.output_type == "out_stream" for outputs in kept for one in outputs)
""": ("True", "False"),
    "import os\nos.environ.get('LABCOURSE_PICTURES')": (None, "'off'"),
}


def test_what_is_not_made_inside_is_what_is_known_not_to_be(tmp_path):
    made = {"n.ipynb": observed(notebook(list(MUTED)))}
    for folder in (tmp_path / "real", tmp_path / "ours"):
        folder.mkdir()
    with_kernels(made, tmp_path / "real")
    assert inside(made, tmp_path / "ours") == FINE
    real, ours = (by_source(tmp_path / folder) for folder in ("real", "ours"))
    assert {source: (real[source]["result"], ours[source]["result"]) for source in MUTED} == MUTED


def test_a_cell_that_leaves_ends_the_notebook_as_in_a_real_kernel(tmp_path):
    """A kernel ends a moment after it; what comes after a wait is not run."""
    cells = ["before = 1", "exit()\nleft = 1", "import asyncio\nawait asyncio.sleep(20)", "after = 1"]
    made = {"n.ipynb": observed(notebook(cells))}
    for folder in (tmp_path / "real", tmp_path / "ours"):
        folder.mkdir()
    with pytest.raises(DeadKernelError):
        with_kernels(made, tmp_path / "real")
    assert inside(made, tmp_path / "ours") == DIED
    real, ours = (facts(tmp_path / folder) for folder in ("real", "ours"))
    assert [fact["source"] for fact in real][1:] == cells[:2]
    assert ours == real


#: With nbclient and a real kernel, what goes into an output widget sometimes waits for ever.
OUTPUT_WIDGETS = {
    "interact": "import ipywidgets\nseen = []\n@ipywidgets.interact(n=(1, 5))\ndef shown(n=2):\n    seen.append(n)",
    "seen": "seen",
    "widget": "out = ipywidgets.Output()\nwith out:\n    print('inside')\n    display('in it')\n    said = 1",
    "error": "with out:\n    1 / 0",
    "after": "said, out.msg_id",
}


def test_what_is_done_within_an_output_widget_is_done(tmp_path):
    assert inside({"n.ipynb": observed(notebook(OUTPUT_WIDGETS))}, tmp_path) == FINE
    noted = by_source(tmp_path)
    assert noted[OUTPUT_WIDGETS["seen"]]["result"] == "[2]"
    assert noted[OUTPUT_WIDGETS["after"]]["result"] == "(1, '')"
    assert all(fact["success"] for fact in noted.values())  # a widget shows an error and takes it for done


SOLUTIONS = sorted((ROOT / "solutions").glob("*.ipynb"))


@pytest.fixture(scope="module")
def solved(tmp_path_factory):
    """The folders of a real kernel's run of all solution notebooks, one after the other, and of ours."""
    notebooks = {path.name: observed(json.loads(path.read_text(encoding="utf-8"))) for path in SOLUTIONS}
    real, ours = tmp_path_factory.mktemp("real"), tmp_path_factory.mktemp("ours")
    with_kernels(notebooks, real, student="")
    assert inside(notebooks, ours, student="") == FINE
    return real, ours


@pytest.mark.scheduled
def test_solutions_answer_the_same_to_the_last_bit(solved):
    real, ours = (json.loads((folder / "answers.json").read_bytes()) for folder in solved)
    # Inside, as in JupyterLab, a cell is known by its id; the kernel's client here does not send it.
    cells = {cell for parts in ours.pop("cells").values() for cell in parts.values()}
    every = [cell for path in SOLUTIONS for cell in json.loads(path.read_text(encoding="utf-8"))["cells"]]
    code = [cell for cell in every if cell["cell_type"] == "code"]
    assert cells == {cell["id"] for cell in code if "lab.answer(" in "".join(cell["source"])}
    assert {cell for parts in real.pop("cells").values() for cell in parts.values()} == {""}
    assert json.dumps(ours) == json.dumps(real)


@pytest.mark.scheduled
def test_the_cells_of_solutions_have_the_same_results_and_leave_the_same_names(solved):
    real, ours = map(facts, solved)
    assert len(real) > 40
    assert all(fact["success"] for fact in real if "source" in fact)
    assert ours == real


@pytest.mark.scheduled
def test_the_files_that_solutions_leave_are_the_same(solved):
    real, ours = map(files, solved)
    assert ours.keys() == real.keys()
