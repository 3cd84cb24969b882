"""nbgrader's own commands can read our notebooks: its own validator accepts the metadata of their cells."""

import sys
from importlib.util import find_spec
from pathlib import Path

import nbformat
import pytest
from checkout import ROOT

BESIDE = Path(sys.prefix, "nbgrader")  # where `make test-all` installs it, so that no JupyterLab has its extensions
NOTEBOOKS = sorted([*ROOT.glob("notebooks/*.ipynb"), *ROOT.glob("solutions/*.ipynb")])

pytestmark = [
    pytest.mark.scheduled,
    pytest.mark.skipif(
        not BESIDE.is_dir() and find_spec("nbgrader") is None, reason="nbgrader is not installed: make .venv/nbgrader"
    ),
]


@pytest.fixture
def nbgraderformat(monkeypatch):
    monkeypatch.setattr(sys, "path", [*sys.path, str(BESIDE)])
    from nbgrader import nbgraderformat

    return nbgraderformat


def test_its_validator_accepts_all_notebooks_and_refuses_one_without_points(nbgraderformat):
    assert NOTEBOOKS
    for path in NOTEBOOKS:
        nbgraderformat.MetadataValidator().validate_nb(nbformat.read(path, as_version=4))
    broken = nbformat.read(ROOT / "notebooks" / "01_modeling_prelab.ipynb", as_version=4)
    cell = next(cell for cell in broken.cells if cell.metadata.get("nbgrader", {}).get("grade"))
    del cell.metadata["nbgrader"]["points"]
    with pytest.raises(nbgraderformat.ValidationError, match="does not have points"):
        nbgraderformat.MetadataValidator().validate_nb(broken)
