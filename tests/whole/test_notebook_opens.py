"""A notebook opens in JupyterLab: its first cells run once, by themselves, and only where that is safe."""

import browser
import pytest

pytestmark = pytest.mark.skipif(browser.CHROMIUM is None, reason="chromium is not installed (apt-get install chromium)")
NOTEBOOK = "04_modeling_results.ipynb"
FIRST = ["parameters", "setup", "play"]
_COUNTS = """() => Object.fromEntries(window.jupyterapp.shell.currentWidget.content.widgets
    .filter((cell) => cell.model.type === 'code').map((cell) => [cell.model.id, cell.model.executionCount]))"""
_COUNT = f"([id, count]) => ({_COUNTS})()[id] === count"
_IS_OPEN = "() => window.jupyterapp?.shell.currentWidget?.context?.isReady"
_RUN = """(id) => {
    const {content} = window.jupyterapp.shell.currentWidget;
    content.activeCellIndex = content.widgets.findIndex((cell) => cell.model.id === id);
    window.jupyterapp.commands.execute('notebook:run-cell');
}"""
_PRESS = """(id) => {
    const {content, sessionContext} = window.jupyterapp.shell.currentWidget;
    content.activeCellIndex = content.widgets.findIndex((cell) => cell.model.id === id);
    content.activate();
    return Boolean(sessionContext.session?.kernel);
}"""


def ran(page, cell, count):
    """Wait until a cell is what the kernel has run as its nth."""
    page.wait_for_function(_COUNT, arg=[cell, count])


def first_ran(page):
    """Wait until the first cells are what the kernel has run first."""
    for count, cell in enumerate(FIRST, 1):
        ran(page, cell, count)


def test_a_key_before_python_is_there_runs_after_the_first_cells(jupyterlab, chromium):
    jupyterlab.course("keys")
    page = chromium.new_page(viewport={"width": 720, "height": 720})
    page.set_default_timeout(browser.PATIENCE)
    try:
        waiting = []
        page.route(
            "**/api/sessions*",
            lambda route: waiting.append(route) if route.request.method == "POST" else route.continue_(),
        )
        page.goto(f"{jupyterlab.address}/lab/tree/keys/02_finding_stiffness.ipynb?token={browser.TOKEN}&reset")
        page.wait_for_function(_IS_OPEN)
        assert not page.evaluate(_PRESS, "q2-9")
        page.keyboard.press("Shift+Enter")
        page.get_by_text("Python is starting").wait_for()
        page.unroute("**/api/sessions*")
        for route in waiting:
            route.continue_()
        first_ran(page)
        ran(page, "q2-9", 4)
        page.get_by_text("Python is starting").wait_for(state="hidden")
        assert page.evaluate("() => window.jupyterapp.shell.leftCollapsed")  # all of a narrow page is the notebook's
    finally:
        page.close()
        browser.end_kernels(jupyterlab.address)


def test_each_kernel_runs_the_first_cells_once(jupyterlab, chromium):
    jupyterlab.course("once")
    address = f"{jupyterlab.address}/lab/tree/once/{NOTEBOOK}?token={browser.TOKEN}&reset"
    with browser.visit(jupyterlab.address, f"once/{NOTEBOOK}") as seen:
        page = seen.page
        first_ran(page)
        page.evaluate(_RUN, "parameters")
        ran(page, "parameters", 4)

        page.goto(address)
        page.wait_for_function(browser._READY)
        page.evaluate(_RUN, "parameters")  # after what runs by itself
        ran(page, "parameters", 5)
        second = chromium.new_page()
        second.goto(address)
        second.wait_for_function(browser._READY, timeout=browser.PATIENCE)
        second.evaluate(_RUN, "parameters")
        ran(second, "parameters", 6)
        page.evaluate("() => { window.jupyterapp.commands.execute('kernelmenu:restart'); }")
        page.locator(".jp-Dialog .jp-mod-accept").click()
        first_ran(page)
        second.evaluate(_RUN, "parameters")  # it waits for nothing: the other page has restarted Python
        ran(second, "parameters", 4)
        second.close()

        page.evaluate("() => { window.jupyterapp.commands.execute('notebook:restart-run-all'); }")
        page.locator(".jp-Dialog .jp-mod-accept").click()
        first_ran(page)
        cells = list(page.evaluate(_COUNTS))
        ran(page, cells[-1], len(cells))
        assert list(page.evaluate(_COUNTS).values()) == [*range(1, len(cells) + 1)]
        assert not seen.errors and not seen.abroad


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('"from rotflex.units import HZ', '"from rotflex.units import Hz'),
        pytest.param('"id": "play"', '"id": "plays"', marks=pytest.mark.scheduled),
        pytest.param(r'"bench = \"virtual\"', r'"bench = \"quanser:q2_usb\"', marks=pytest.mark.scheduled),
    ],
)
def test_where_it_is_not_sure_nothing_runs_and_the_page_says_which_key(jupyterlab, old, new):
    path = jupyterlab.course(f"changed-{abs(hash(new))}") / NOTEBOOK
    before = path.read_text(encoding="utf-8")
    assert before.count(old) == 1
    path.write_text(before.replace(old, new), encoding="utf-8")
    with browser.visit(jupyterlab.address, f"{path.parent.name}/{NOTEBOOK}") as seen:
        notice = seen.page.locator("[data-labcourse=opening]")
        notice.filter(has_text="press Shift+Enter 3 times").wait_for()
        seen.page.evaluate(_RUN, "parameters")  # after what runs by itself
        ran(seen.page, "parameters", 1)
        assert notice.is_visible()
