"""What a student meets: JupyterLab, with the notebooks in it, running in a browser, without a network.

It is served below a prefix, as a hub does.
"""

import json

import browser
import explorer_notebooks
import pytest
from checkout import ROOT

NOTEBOOKS = sorted(path.name for path in (ROOT / "notebooks").glob("*.ipynb"))

needs_chromium = pytest.mark.skipif(
    browser.CHROMIUM is None, reason="chromium is not installed (apt-get install chromium)"
)


@pytest.fixture(scope="module")
def served(jupyterlab):
    """The address of a course that nobody has worked on."""
    jupyterlab.course("empty")
    return jupyterlab.address


def test_rotflex_lab_serves_the_notebooks(served):
    names = {item["name"] for item in browser.get(served, "/api/contents/")["content"]}
    assert set(NOTEBOOKS) <= names
    assert "course.json" in names


#: At a landing: the console, and an explorer of recordings. All run empty in test_released_course.py.
AT_A_LANDING = ("00_", "02_")


@needs_chromium
@pytest.mark.parametrize(
    "notebook",
    [pytest.param(name, marks=() if name.startswith(AT_A_LANDING) else pytest.mark.scheduled) for name in NOTEBOOKS],
)
def test_a_student_notebook_runs_empty_in_the_browser(served, notebook):
    with browser.visit(served, f"empty/{notebook}") as seen:
        cells = browser.run_all(seen)
        errors = [output for cell in cells for output in cell["outputs"] if output["output_type"] == "error"]
        assert not errors
        said = [browser.plain(cell) for cell in cells if cell["source"].startswith("lab.answer(")]
        assert said
        assert all("not answered yet" in text for text in said)
        if notebook == NOTEBOOKS[0]:
            the_arm_moves_and_is_saved(seen.page, served, notebook)
        assert not seen.errors
        assert not seen.abroad


def the_arm_moves_and_is_saved(page, address, notebook):
    """The console runs an experiment at the prefix, and the saved notebook has its picture, and no live view."""
    page.wait_for_selector(".labcourse-explorer[data-version]")
    explorer_notebooks.settled(page)
    explorer_notebooks.run_to_the_end(page)
    page.evaluate("() => window.jupyterapp.commands.execute('docmanager:save')")
    page.wait_for_function("() => !window.jupyterapp.shell.currentWidget.context.model.dirty", timeout=browser.PATIENCE)
    saved = json.dumps(browser.get(address, f"/api/contents/empty/{notebook}")["content"])
    assert "To use the explorer, run this cell." in saved and "widget-view" not in saved
