"""A first minute: `rotflex lab`, the page that opens, one press of Shift+Enter, Start; the arm swings, all in view."""

import contextlib
import subprocess
import sys

import browser
import numpy as np
import pytest

from rotflex.recording import Recording

pytestmark = pytest.mark.skipif(browser.CHROMIUM is None, reason="chromium is not installed (apt-get install chromium)")

_NOW = """() => {
    const panel = window.jupyterapp && window.jupyterapp.shell.currentWidget;
    return panel && panel.context ? panel.context.path : '';
}"""


def test_one_press_shows_arm_start_and_curve_and_start_moves_the_arm(jupyterlab):
    address = jupyterlab.address
    with browser.visit(address, "00_start.ipynb") as seen:
        page = seen.page
        page.set_viewport_size({"width": 1280, "height": 720})
        page.goto(f"{address}/?token={browser.TOKEN}&reset")  # where nothing is named, the first notebook comes
        page.wait_for_function(browser._READY)
        assert page.evaluate(_NOW) == "00_start.ipynb"
        page.keyboard.press("Shift+Enter")
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
        assert not seen.abroad
        assert page.get_by_text("Jupyter news").count() == 0  # asked over the picture, as JupyterLab would by itself


@contextlib.contextmanager
def busy(processes):
    """Processes that keep all cores busy until the block ends."""
    started = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(processes)]
    try:
        yield
    finally:
        for one in started:
            one.kill()
            one.wait()


@pytest.mark.scheduled
def test_however_busy_the_computer_is_each_start_records_the_same_to_the_last_bit(jupyterlab):
    course = jupyterlab.course("busy")
    saved = course / "console_free_decay.mat"
    recordings = []
    with browser.visit(jupyterlab.address, f"{course.name}/00_start.ipynb") as seen, busy(6):
        page = seen.page
        page.keyboard.press("Shift+Enter")
        start = page.get_by_role("button", name="Start", exact=True)
        start.wait_for()
        for _ in range(5):
            start.click()
            page.get_by_text("This experiment first waits").first.wait_for()
            page.get_by_text("The experiment is finished. The motor is at 0 V.").first.wait_for()
            page.get_by_role("button", name="Save the recording").click()
            for _ in range(1000):
                if saved.exists():  # under this name it is whole
                    break
                page.wait_for_timeout(100)
            recordings.append(Recording.load(saved))
            saved.unlink()
    assert len(recordings[0]) > 1000
    for one in recordings[1:]:
        assert all(np.array_equal(one[name], recordings[0][name]) for name in recordings[0].channels)
