"""The course bar in JupyterLab: what is answered, the commands as buttons, links, and what a saved notebook has."""

import json

import browser
import pytest

NOTEBOOK = "02_finding_stiffness.ipynb"
pytestmark = pytest.mark.skipif(browser.CHROMIUM is None, reason="chromium is not installed (apt-get install chromium)")
_RUN = """async ([id, source]) => {
    const {content} = window.jupyterapp.shell.currentWidget;
    content.activeCellIndex = content.widgets.findIndex((cell) => cell.model.id === id);
    if (source) content.activeCell.model.sharedModel.setSource(source);
    await window.jupyterapp.commands.execute('notebook:run-cell');
}"""
_HAS_ARROW = """(link) => {
    const range = document.createRange();
    range.selectNode(link.lastChild);
    const [arrow, title] = [range, link.firstElementChild].map((one) => one.getBoundingClientRect());
    return arrow.width > 5 && arrow.left >= title.right && arrow.top < title.bottom && title.top < arrow.bottom;
}"""
_IS_SAVED = "() => !window.jupyterapp.shell.currentWidget.context.model.dirty"
_PATH = "() => window.jupyterapp.shell.currentWidget.context.path"
_IN_VIEW = """(id) => {
    const {content} = window.jupyterapp.shell.currentWidget;
    const cell = content.widgets.find((cell) => cell.model.id === id).node.getBoundingClientRect();
    const page = content.node.getBoundingClientRect();
    return cell.bottom > page.top && cell.top < page.bottom;
}"""


def test_the_bar_follows_answers_runs_check_refuses_unsaved_work_and_leads_on(jupyterlab):
    folder = jupyterlab.course("bar")
    with browser.visit(jupyterlab.address, f"bar/{NOTEBOOK}") as seen:
        page = seen.page
        page.set_viewport_size({"width": 1280, "height": 720})
        for cell in ("parameters", "setup"):
            page.evaluate(_RUN, [cell, ""])
        bar = page.locator(".labcourse-bar")
        bar.get_by_label("2.12: empty").wait_for()
        assert "3 of 12" in bar.inner_text() and "ada" in bar.inner_text()
        assert bar.bounding_box()["height"] <= 90

        page.evaluate(_RUN, ["q2-12", "J_l, K_s = 0.004, 1.5"])
        page.evaluate(_RUN, ["q2-12-answer", ""])
        bar.get_by_label("2.12: answered").wait_for(state="attached")

        bar.locator("[data-name=submit]").click()
        bar.get_by_text("This notebook is not saved").wait_for()
        assert not (folder.parent / "ada.zip").exists()

        page.keyboard.press("Control+s")  # the button has the focus
        page.wait_for_function(_IS_SAVED)
        saved = json.dumps(browser.get(jupyterlab.address, f"/api/contents/bar/{NOTEBOOK}")["content"])
        assert "2.12: answered" in saved and "As it was saved" in saved
        assert "widget-view" not in saved and "labcourse_bar" not in saved

        page.evaluate(_RUN, ["parameters", ""])
        assert not page.evaluate(_IS_SAVED)  # but what counts of it is
        bar.locator("[data-name=check]").click()
        bar.get_by_text("Check runs").wait_for()
        assert not bar.locator(".notice").inner_text()  # nothing of what was pressed before
        bar.locator("[data-name=check]").click()
        bar.get_by_text("Check still runs").wait_for()
        bar.locator(".pane[aria-busy=false]").wait_for()
        said = bar.locator(".pane").inner_text()
        assert "Complete: 1 of 51 questions" in said and "2.9 " not in said.partition("By notebook")[0]
        assert "still runs" not in said and "not saved" not in said

        page.set_viewport_size({"width": 720, "height": 720})
        assert bar.get_by_title("→").evaluate(_HAS_ARROW)
        bar.get_by_label("2.12: answered").click()
        page.wait_for_function(_IN_VIEW, arg="q2-12-answer")
        bar.get_by_title("→").evaluate("link => link.click()")
        page.wait_for_function(f"() => ({_PATH})() === 'bar/03_model_validation.ipynb'")
        assert not seen.errors and not seen.abroad
