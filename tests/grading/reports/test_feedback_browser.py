"""The feedback page in a browser: folded on the screen, unfolded on paper, readable in light and dark."""

import pytest
from accessible import findings
from contrast import CONTRASTS
from gradebooks import result
from made_courses import OURS

from labcourse.grading.gradebook import MarkRecord
from labcourse.grading.reports import feedback
from labcourse.grading.verdicts import Status

MARKS = (
    MarkRecord("2.11", "omega_n", Status.RIGHT, 2.0, 2.0, "Folded reason.", "19.9 rad/s"),
    *(MarkRecord("2.12", status.name, status, 0.0, 1.0, "Open reason.", "1.3") for status in Status),
)


@pytest.fixture(params=["light", "dark"])
def page(request, chromium, tmp_path):
    file = tmp_path / "feedback.html"
    file.write_text(feedback.page(result(*MARKS), OURS), encoding="utf-8")
    context = chromium.new_context(color_scheme=request.param, viewport={"width": 800, "height": 900})
    opened, said = context.new_page(), []
    opened.on("console", lambda message: said.append(message.text))
    opened.goto(file.as_uri())
    yield opened
    context.close()
    assert said == []


def test_what_is_all_well_is_folded_on_the_screen_and_not_on_paper(page):
    folded = page.get_by_text("Folded reason.")
    assert not folded.is_visible() and page.get_by_text("Open reason.").first.is_visible()
    page.emulate_media(media="print")
    assert folded.is_visible()
    assert page.evaluate("getComputedStyle(document.documentElement).getPropertyValue('--page')").strip() == "#fff"


def test_every_text_can_be_read_on_what_lies_behind_it(page):
    contrasts = page.evaluate(CONTRASTS)
    assert len(contrasts) > 40
    assert {name: round(ratio, 1) for name, ratio in contrasts if ratio < 4.5} == {}


def test_the_page_is_no_wider_than_the_window(page):
    page.set_viewport_size({"width": 390, "height": 800})
    assert page.evaluate("document.documentElement.scrollWidth") <= 390


def test_nothing_on_the_page_keeps_somebody_from_using_it(page):
    page.evaluate("document.querySelectorAll('details').forEach((one) => { one.open = true })")
    assert findings(page) == []
