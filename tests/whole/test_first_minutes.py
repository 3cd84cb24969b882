"""A first minute: `rotflex lab`, the page that opens, Start, without a key before; the arm swings, all in view."""

import json

import browser
import pytest

pytestmark = pytest.mark.skipif(browser.CHROMIUM is None, reason="chromium is not installed (apt-get install chromium)")

_NOW = """() => {
    const panel = window.jupyterapp && window.jupyterapp.shell.currentWidget;
    return panel && panel.context ? panel.context.path : '';
}"""


def test_arm_start_and_curve_are_there_by_themselves_and_start_moves_the_arm(jupyterlab):
    address = jupyterlab.address
    with browser.visit(address, "10_control_results.ipynb") as seen:
        page = seen.page
        page.set_viewport_size({"width": 1280, "height": 720})
        page.goto(f"{address}/?token={browser.TOKEN}&reset")  # where nothing is named, the first notebook comes
        page.wait_for_function(browser._READY)
        assert page.evaluate(_NOW) == "00_start.ipynb"
        start = page.get_by_role("button", name="Start", exact=True)
        start.wait_for()
        assert start.is_enabled()
        notebook, canvas = (
            page.locator(".jp-WindowedPanel-outer").first,
            page.locator(".labcourse-explorer canvas").first,
        )
        bottom = notebook.bounding_box()["y"] + notebook.bounding_box()["height"]
        top, stage = start.bounding_box(), canvas.bounding_box()
        assert notebook.bounding_box()["y"] <= top["y"]
        # Arm, θ and α are in the upper three quarters of the picture, and the voltage in the lowest.
        assert stage["y"] + 0.75 * stage["height"] <= bottom
        still = canvas.screenshot()
        start.click()
        page.get_by_text("The experiment is finished. The motor is at 0 V.").first.wait_for()
        assert canvas.screenshot() != still
        page.evaluate("() => window.jupyterapp.commands.execute('docmanager:save')")
        page.wait_for_function("() => !window.jupyterapp.shell.currentWidget.context.model.dirty")
        saved = json.dumps(browser.get(address, "/api/contents/00_start.ipynb")["content"])
        assert "To use the explorer, run this cell." in saved and "widget-view" not in saved
        assert not seen.errors and not seen.abroad
        assert page.get_by_text("Jupyter news").count() == 0  # asked over the picture, as JupyterLab would by itself
