"""In JupyterLab, what is the course's can neither be changed nor deleted; answers can be written in."""

import browser
import pytest

NOTEBOOK = "08_full_state_feedback.ipynb"

pytestmark = pytest.mark.skipif(browser.CHROMIUM is None, reason="chromium is not installed (apt-get install chromium)")

_CELLS = """() => Array.from(window.jupyterapp.shell.currentWidget.content.model.cells,
    cell => [cell.id, cell.sharedModel.getSource()])"""
_GO_TO = """async id => {
    const content = window.jupyterapp.shell.currentWidget.content;
    const index = Array.from(content.model.cells).findIndex(cell => cell.id === id);
    content.activeCellIndex = index;
    content.deselectAll();
    await content.scrollToItem(index, 'center');
    content.mode = 'command';
    content.node.focus();
    content.activeCell.node.focus();
}"""


@pytest.fixture(scope="module")
def page(jupyterlab):
    """A notebook as a student has it, in the browser."""
    jupyterlab.course("locked")
    with browser.visit(jupyterlab.address, f"locked/{NOTEBOOK}") as seen:
        yield seen.page


def cells(page):
    """Id of each cell → its source."""
    return dict(page.evaluate(_CELLS))


def write(page, cell, text):
    """Go into a cell as by Enter, and type at its end."""
    page.evaluate(_GO_TO, cell)
    page.keyboard.press("Enter")
    page.wait_for_timeout(300)
    page.keyboard.press("Control+End")
    page.keyboard.type(text)
    page.keyboard.press("Escape")
    page.wait_for_timeout(100)


@pytest.mark.parametrize("cell", ["title", "setup", "q3-13-answer"])
def test_typing_into_a_locked_cell_changes_nothing(page, cell):
    before = cells(page)
    assert cell in before
    write(page, cell, "zzz")
    assert cells(page) == before


@pytest.mark.parametrize("cell", ["title", "q3-13", "q3-13-answer", "parameters"])
def test_neither_the_courses_cells_nor_answers_are_deleted_by_d_d(page, cell):
    before = cells(page)
    page.evaluate(_GO_TO, cell)
    page.keyboard.press("d")
    page.keyboard.press("d")
    page.keyboard.press("x")
    page.wait_for_timeout(200)
    assert cells(page) == before


@pytest.mark.parametrize("cell", ["q3-13", "q3-14-conclusion", "predict-3-13"])
def test_answers_parameters_and_open_cells_can_be_written_in(page, cell):
    before = cells(page)
    write(page, cell, " # mine")
    assert cells(page) == {**before, cell: f"{before[cell]} # mine"}


def test_a_cell_to_be_copied_and_changed_can_be(page):
    before = cells(page)
    page.evaluate(_GO_TO, "predict-3-13")
    page.keyboard.press("c")
    page.keyboard.press("v")
    page.wait_for_function(f"() => ({_CELLS})().length === {len(before) + 1}")
    (copy,) = cells(page).keys() - before.keys()
    write(page, copy, " # changed")
    after = cells(page)
    assert after[copy] == f"{before['predict-3-13']} # changed"
    assert {cell: after[cell] for cell in before} == before
    page.evaluate(_GO_TO, copy)
    page.keyboard.press("d")
    page.keyboard.press("d")
    page.wait_for_function(f"() => ({_CELLS})().length === {len(before)}")
