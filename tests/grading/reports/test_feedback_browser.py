"""The feedback page in a browser: short on the screen, whole on paper, readable in light and dark."""

import pytest
from accessible import findings
from gradebooks import result
from made_courses import OURS

from labcourse.grading.accounts import account_of
from labcourse.grading.assignments import Handed
from labcourse.grading.gradebook import StudentRecord
from labcourse.grading.marks import Mark, Status
from labcourse.grading.reports import feedback

MARKS = (
    Mark("2.11", "omega_n", Status.RIGHT, 2.0, 2.0, "Folded reason.", "19.9 rad/s"),
    *(Mark("2.12", status.name, status, 0.0, 1.0, "Open reason.", "1.3") for status in Status),
)


@pytest.fixture(params=["light", "dark"])
def page(request, chromium, tmp_path):
    file = tmp_path / "feedback.html"
    account = account_of(OURS, Handed(StudentRecord("ada"), MARKS))
    made = result(*MARKS, account=account, problems=("2.12 stopped: " + "NameError, " * 200,))
    file.write_text(feedback.page(made, OURS), encoding="utf-8")
    context = chromium.new_context(color_scheme=request.param, viewport={"width": 800, "height": 900})
    opened, said = context.new_page(), []
    opened.on("console", lambda message: said.append(message.text))
    opened.goto(file.as_uri())
    yield opened
    context.close()
    assert said == []


def test_answers_are_folded_on_the_screen_and_not_on_paper(page):
    folded = [page.get_by_text(text).last for text in ("Folded reason.", "Open reason.")]
    assert not any(one.is_visible() for one in folded)
    page.emulate_media(media="print")
    assert all(one.is_visible() for one in folded)
    assert page.evaluate("getComputedStyle(document.documentElement).getPropertyValue('--page')").strip() == "#fff"


def test_a_link_opens_the_folds_that_it_points_into(page):
    page.locator('.first a[href="#q-2-12"]').last.click()
    assert page.get_by_text("Open reason.").last.is_visible() and not page.get_by_text("Folded reason.").is_visible()
    page.locator('a[href="#went-wrong"]').click()
    assert page.locator("#went-wrong").is_visible()


def test_nothing_on_the_page_keeps_somebody_from_using_it(page):
    page.evaluate("document.querySelectorAll('details').forEach((one) => { one.open = true })")
    assert findings(page) == []
    page.set_viewport_size({"width": 390, "height": 844})
    assert page.evaluate("document.documentElement.scrollWidth") <= 390
