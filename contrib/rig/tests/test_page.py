"""The page of the laboratory, in a browser."""

import browser
import pytest
from rigs import until
from rotflex_rig.queue import LABORATORY

from rotflex import experiments
from rotflex.errors import LimitExceeded

pytestmark = pytest.mark.browser
K = (18.2356, -17.1547, 1.5893, 0.6327)


@pytest.fixture
def page():
    opened = browser.chromium().new_context(viewport={"width": 1280, "height": 720}).new_page()
    yield opened
    opened.context.close()


def enter(page, rig, token):
    page.goto(rig.url)
    page.fill("input", token)
    page.click("#enter button")


def test_it_opens_with_the_laboratorys_token_only(page, rig):
    enter(page, rig, rig.admit("ada"))
    page.wait_for_function("document.querySelector('#state').textContent.includes('laboratory')")
    assert page.is_hidden("main")


def test_it_shows_queue_and_runs_and_pauses_and_confirms_presence(page, rig, monkeypatch, tmp_path):
    said = []
    page.on("console", lambda message: said.append(message.text))
    rig.work()
    rig.enter(monkeypatch, "ada <b>")
    with rig.bench() as bench:
        experiments.tracking(bench, K, duration=4.0)
        with pytest.raises(LimitExceeded):
            experiments.tracking(bench, (-18, 17, -1.5, -0.6))
    enter(page, rig, rig.token[LABORATORY])
    page.wait_for_selector("#last svg")
    assert page.locator("#last tr").count() == 3
    assert "unstable" in page.inner_text("#last") and "ada <b>" in page.inner_text("#last")
    assert page.locator("svg polyline").count() == 3
    page.click("#pause")
    until(lambda: rig.queue.overview()["paused"])
    rig.queue.put("ben", b"{}", "tracking", 10.0)
    page.wait_for_selector("#queue >> text=ben")
    assert "paused" in page.inner_text("#state")
    page.screenshot(path=tmp_path / "page.png", full_page=True)
    page.click("#pause")
    page.click("#leave")
    until(lambda: not rig.queue.overview()["present"])
    page.click("#present")
    until(lambda: rig.queue.overview()["present"])
    assert said == []
