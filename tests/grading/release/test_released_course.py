"""What students get, run as they get it: notebooks, empty, on the released folder alone.

At a landing some; in `make test-all` all. `tests/site` runs all empty, in the checkout.
"""

import os

import nbformat
import pytest
from checkout import ROOT
from made_courses import OURS
from nbclient import NotebookClient

from labcourse.grading.release import student_course

pytestmark = pytest.mark.slow

#: Optional notebooks are not in the release of a class that does not have them.
NAMES = sorted(path.name for path in (ROOT / "notebooks").glob("*.ipynb") if path.stem not in OURS.catalogue.optional)
AT_A_LANDING = ("00_", "03_", "09_")
_WHERE = "import rotflex, importlib.util as u; print(rotflex.__file__, u.find_spec('labcourse.grading'))"


@pytest.fixture(scope="module")
def course(tmp_path_factory):
    folder = tmp_path_factory.mktemp("released") / "rotflex-course"
    student_course.build(OURS, folder)
    return folder


@pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=() if name.startswith(AT_A_LANDING) else pytest.mark.scheduled) for name in NAMES],
)
def test_runs_to_its_end_empty(course, name):
    notebook = nbformat.read(course / "notebooks" / name, as_version=4)
    # The first cell tells whose package runs; it is there for the test only.
    notebook.cells.insert(0, nbformat.v4.new_code_cell(_WHERE))
    environment = os.environ | {"PYTHONPATH": str(course), "TQDM_DISABLE": "1"}
    client = NotebookClient(notebook, timeout=120, resources={"metadata": {"path": str(course / "notebooks")}})
    client.execute(env=environment)
    assert notebook.cells[0].outputs[0].text == f"{course / 'rotflex' / '__init__.py'} None\n"
    recorded = [
        "".join(output.get("text", "") for output in cell.outputs)
        for cell in notebook.cells
        if cell.cell_type == "code" and cell.source.startswith("lab.answer(")
    ]
    assert recorded
    assert all("not answered yet" in text and "  recorded" not in text for text in recorded)
