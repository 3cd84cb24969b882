"""What a student meets: JupyterLab, with the notebooks in it, running in a browser, without a network.

It is served below a prefix, as a hub does.
"""

import browser
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


@needs_chromium
@pytest.mark.scheduled  # at each landing, explorers run in a browser of their own, and test_released_course.py runs all
@pytest.mark.parametrize("notebook", NOTEBOOKS)
def test_a_student_notebook_runs_empty_in_the_browser(served, notebook):
    with browser.visit(served, f"empty/{notebook}") as seen:
        cells = browser.run_all(seen)
        errors = [output for cell in cells for output in cell["outputs"] if output["output_type"] == "error"]
        assert not errors
        said = [browser.plain(cell) for cell in cells if cell["source"].startswith("lab.answer(")]
        assert said
        assert all("not answered yet" in text for text in said)
        assert not seen.errors
        assert not seen.abroad
