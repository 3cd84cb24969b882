"""The explorers in JupyterLab on a small screen: all that changes is in view, and no key reaches the notebook."""

import browser
import explorer_notebooks
import pytest
from explorer_notebooks import middle, run_to_the_end, settled

pytestmark = pytest.mark.skipif(browser.CHROMIUM is None, reason="chromium is not installed (apt-get install chromium)")

SCREEN = {"width": 1280, "height": 720}
KEYS = ("d", "d", "j", "k", "a", "b", "x", "m", "y", "z", "Shift+Enter", "Shift+M")
CHANGES = {  # explorer → what changes while its handle or slider is moved
    "poles": (".handle", "table.readout:visible", ".stage"),
    "sweep": (".handle", "table.readout", ".stage"),
    "validation": ('[data-name="K_s"]', "table.readout", ".stage"),
    "designs": ('[data-name="second"]', "table.readout", ".stage", ".player"),
    "console": ('[data-name="stop"]', "table.readout:visible", ".stage", ".player"),
}
LEAST_PLOTS = 240  # px


@pytest.fixture(scope="module")
def served(jupyterlab):
    explorer_notebooks.write(jupyterlab.course("small"))
    return jupyterlab.address


@pytest.fixture
def opened(served, request):
    with browser.visit(served, f"small/{request.param}.ipynb") as seen:
        seen.page.set_viewport_size(SCREEN)
        explorer_notebooks.show(seen)
        seen.page.locator(".labcourse-explorer").evaluate("host => host.scrollIntoView({block: 'start'})")
        settled(seen.page)
        yield seen.page, request.param
        assert not seen.errors


def outside(page, selectors):
    """Elements that are not wholly within what the notebook's panel shows, with where they are."""
    panel = page.locator(".jp-WindowedPanel-outer").first.bounding_box()
    low, high = panel["y"] - 1, panel["y"] + panel["height"] + 1
    found = []
    for selector in selectors:
        elements = page.locator(".labcourse-explorer").locator(selector).all()
        assert elements, selector
        boxes = [(selector, element.bounding_box()) for element in elements]
        found += [(name, box) for name, box in boxes if not (low <= box["y"] and box["y"] + box["height"] <= high)]
    return found


@pytest.mark.parametrize(
    "opened",
    [
        "poles",
        *(pytest.param(name, marks=pytest.mark.scheduled) for name in ("console", "sweep", "validation", "designs")),
    ],
    indirect=True,
)
def test_all_that_changes_is_in_view_together_with_what_is_moved(opened):
    page, name = opened
    if name == "console":  # as high as it gets: the bench reports, and a recording can be played
        run_to_the_end(page)
        settled(page)
        page.locator(".labcourse-explorer").evaluate("host => host.scrollIntoView({block: 'start'})")
    if name == "poles":
        x, y = middle(page, "pair")
        page.mouse.move(x, y)
        page.mouse.down()
        page.mouse.move(x - 10, y - 20, steps=4)
        settled(page)
    assert outside(page, CHANGES[name]) == []
    assert page.locator(".stage").bounding_box()["height"] >= LEAST_PLOTS
    if name == "poles":
        page.mouse.up()
        settled(page)
        height = page.locator(".stage").bounding_box()["height"]
        page.mouse.move(*middle(page, "pair"))
        page.mouse.down()
        page.mouse.move(1000, y, steps=4)  # far over the border of stability, and the plot's edge
        settled(page)
        page.mouse.up()
        settled(page)
        assert "stopped by the safety" in page.locator("table.readout").first.inner_text()
        assert outside(page, CHANGES[name]) == []
        assert page.locator(".stage").bounding_box()["height"] == height


ELEMENTS = ('button[data-name="reset"]', ".handle", '[data-name="zeta"]', '[data-name="zeta-number"]')
ELEMENTS += ('[data-name="feedback"]', ".stage", "table.readout", ".notice + .controls", "summary")
CELLS = "() => window.jupyterapp.shell.currentWidget.content.model.cells.length"
STATE = """() => {
    const notebook = window.jupyterapp.shell.currentWidget.content;
    const types = notebook.widgets.map((cell) => cell.model.type);
    return [types, notebook.activeCellIndex, notebook.activeCell.model.executionCount];
}"""


@pytest.mark.parametrize("opened", ["poles"], indirect=True)
def test_no_key_acts_on_the_notebook_after_a_click_on_any_kind_of_element(opened):
    page, _ = opened
    before = page.evaluate(STATE)
    for element in ELEMENTS:
        found = page.locator(".labcourse-explorer").locator(element).first
        found.click(position={"x": 2, "y": 2} if element in (".stage", ".notice + .controls") else None)
        for key in KEYS:
            page.keyboard.press(key)
        assert page.evaluate(STATE) == before, element
    settled(page)


@pytest.mark.parametrize("opened", ["poles"], indirect=True)
def test_beside_the_explorer_the_same_keys_act_on_the_notebook(opened):
    """Else the test above would show nothing."""
    page, _ = opened
    cells = page.evaluate(CELLS)
    page.locator(".jp-Notebook .jp-InputPrompt").first.click()
    for key in ("d", "d"):
        page.keyboard.press(key)
    page.wait_for_timeout(300)
    assert page.evaluate(CELLS) == cells - 1


SAVE = "() => window.jupyterapp.shell.currentWidget.context.save()"


@pytest.mark.parametrize(
    "name", ["poles", *(pytest.param(name, marks=pytest.mark.scheduled) for name in ("console", "results"))]
)
def test_a_notebook_that_is_opened_again_shows_the_picture_and_what_to_do(served, name):
    """Not "Loading widget..." for ever; and the page that it was saved from keeps its explorer."""
    with browser.visit(served, f"small/{name}.ipynb") as seen:
        explorer_notebooks.show(seen)
        seen.page.evaluate(SAVE)
        settled(seen.page)
        assert seen.page.locator(".labcourse-explorer button").count() > 0
        seen.page.evaluate("() => window.jupyterapp.shell.currentWidget.sessionContext.shutdown()")
    with browser.visit(served, f"small/{name}.ipynb") as seen:
        output = seen.page.locator(".jp-OutputArea-output", has_text="run this cell")
        output.wait_for()
        assert "widget" not in output.inner_text()
        assert seen.page.get_by_text("Loading widget").count() == 0
        assert seen.page.get_by_text("model not found").count() == 0
        if name == "poles":
            image = output.locator("img")
            assert image.evaluate("one => one.complete && one.naturalWidth") > 500
            assert "Desired poles" in image.get_attribute("alt")
        assert not seen.errors
        explorer_notebooks.show(seen)  # and run again, it is there
