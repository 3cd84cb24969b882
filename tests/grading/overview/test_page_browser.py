"""The page of a class in a browser: the summary at one look at 1280 × 720, readable in light and dark."""

import pytest
from accessible import findings
from contrast import CONTRASTS
from day_class import fill, score
from made_courses import OURS

from labcourse.grading.gradebook import Gradebook
from labcourse.grading.overview import glance, shown


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    folder = tmp_path_factory.mktemp("class")
    with Gradebook(folder / "gradebook.sqlite") as book:
        fill(book, folder)
        score(book)
        book.requests.publish("lea")
        (folder / "class.html").write_text(shown.page(glance.at(book, OURS)), encoding="utf-8")
    return (folder / "class.html").as_uri()


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_the_summary_is_seen_at_once_and_every_word_stands_out(chromium, page, scheme):
    there = chromium.new_page(viewport={"width": 1280, "height": 720}, color_scheme=scheme)
    asked = []
    there.on("request", lambda request: asked.append(request.url))
    there.goto(page)
    bottom = there.eval_on_selector("nav", "node => node.getBoundingClientRect().bottom")
    assert bottom < 720
    assert there.evaluate("document.documentElement.scrollWidth") <= 1280
    contrasts = there.evaluate(CONTRASTS)
    assert len(contrasts) > 100 and [one for one in contrasts if one[1] < 4.5] == []
    dark = there.evaluate("getComputedStyle(document.body).backgroundColor") == "rgb(22, 24, 27)"
    assert dark is (scheme == "dark")
    assert asked == [page]
    assert findings(there) == []
    there.close()


def test_a_narrow_window_scrolls_tables_and_not_the_page(chromium, page):
    there = chromium.new_page(viewport={"width": 400, "height": 720})
    there.goto(page)
    assert there.evaluate("document.documentElement.scrollWidth") <= 400
    there.close()
