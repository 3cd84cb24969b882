"""A notebook for each explorer, in JupyterLab as students start it; and what tests ask of an explorer's page."""

from pathlib import Path
from typing import Any

import browser
import nbformat

BEGIN = """
import numpy as np
import rotflex.course.lab
from rotflex import widgets
from rotflex import model
lab = rotflex.course.lab.start("ada")
system = model.state_space(lab.servo, lab.joint, lab.joint.J_l * 20.7**2, input="voltage")
A, B = np.asarray(system.A), np.asarray(system.B)
"""
KERNEL = {"kernelspec": {"name": "python3", "display_name": "Python 3", "language": "python"}}
NOTEBOOKS = {
    "poles": "explorer = widgets.explore_poles(A, B)\nexplorer",
    "console": "explorer = widgets.open_console(lab, K=[18.2, -17.2, 1.59, 0.633])\nexplorer",
    "results": 'explorer = widgets.results_table(lab, "Table 2")\nexplorer',
}


def write(folder: Path) -> None:
    """Write the notebooks into a folder that JupyterLab serves."""
    for name, cell in NOTEBOOKS.items():
        cells = [nbformat.v4.new_code_cell(source) for source in (BEGIN, cell)]
        nbformat.write(nbformat.v4.new_notebook(cells=cells, metadata=KERNEL), folder / f"{name}.ipynb")


def show(seen: browser.Visit) -> None:
    """Run a notebook's cells, and wait for its explorer."""
    cells = browser.run_all(seen)
    assert [output for cell in cells for output in cell["outputs"] if output["output_type"] == "error"] == []
    seen.page.wait_for_selector(".labcourse-explorer[data-version]")


def settled(page: Any) -> None:
    """Wait until Python has answered all that the page has said, and the page has drawn it."""
    page.wait_for_function("() => document.querySelector('.labcourse-explorer').ariaBusy !== 'true'")
    version = None
    while (now := page.locator(".labcourse-explorer").get_attribute("data-version")) != version:
        version = now
        page.wait_for_timeout(300)


def middle(page: Any, name: str) -> tuple[float, float]:
    """Where a handle is."""
    box = page.locator(f'.handle[data-name="{name}"]').bounding_box()
    return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
