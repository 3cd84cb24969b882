"""A first minute: `rotflex lab`, the page that opens, four presses of Shift+Enter, Start; the arm swings."""

import browser
import pytest

pytestmark = pytest.mark.skipif(browser.CHROMIUM is None, reason="chromium is not installed (apt-get install chromium)")

_NOW = """() => {
    const panel = window.jupyterapp && window.jupyterapp.shell.currentWidget;
    return panel && panel.context ? panel.context.path : '';
}"""


def test_the_arm_moves_at_the_first_press_of_start(jupyterlab, tmp_path):
    address = jupyterlab.address
    with browser.visit(address, "00_start.ipynb") as seen:
        page = seen.page
        page.goto(f"{address}/?token={browser.TOKEN}")  # where nothing is named, the first notebook comes
        page.wait_for_function(browser._READY)
        assert page.evaluate(_NOW) == "00_start.ipynb"
        page.locator(".jp-Notebook .jp-Cell").first.click()
        page.keyboard.press("Escape")
        for _ in range(4):
            page.keyboard.press("Shift+Enter")
        start = page.get_by_role("button", name="Start", exact=True)
        start.wait_for()
        assert start.is_enabled()
        canvas = page.locator(".rotflex-explorer canvas").first
        still = canvas.screenshot()
        start.click()
        page.get_by_text("The experiment is finished. The motor is at 0 V.").first.wait_for()
        assert canvas.screenshot() != still
        page.screenshot(path=str(tmp_path / "first.png"))
        assert not seen.abroad
        assert page.get_by_text("Jupyter news").count() == 0  # asked over the picture, as JupyterLab would by itself
