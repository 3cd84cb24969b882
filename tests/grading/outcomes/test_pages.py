"""The room's pages as they are seen: contrast, width, and what a reader of the screen is told."""

import random
import re

import marked_class
import pytest
from accessible import findings
from made_courses import OURS

from labcourse.grading.gradebook import Gradebook, StudentRecord
from labcourse.grading.outcomes import class_report, levels, pages, sheet_files, sheet_layout
from labcourse.grading.outcomes.sheet import filled


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    folder = tmp_path_factory.mktemp("pages")
    with Gradebook(marked_class.gradebook(folder, {"North": 8, "South": 7, "A long name of a section": 6})) as book:
        class_report.write(folder, OURS, book)
    marks = marked_class.marks(random.Random(4))
    one = levels.standing(marked_class.graded("ada", marks), OURS.catalogue, StudentRecord("ada", "Ada L."))
    layouts = sheet_layout.read(OURS.folder, OURS.catalogue)
    widest = max(layouts, key=lambda layout: len(layout.columns))
    content = sheet_files.content(filled(widest, one, OURS.settings.levels.level_of), OURS)
    (folder / "sheet.html").write_text(pages.page("sheet.html", **content), encoding="utf-8")
    return folder


def test_the_report_loads_nothing_and_runs_nothing(written):
    page = (written / "attainment.html").read_text(encoding="utf-8")
    assert "<script" not in page and "default-src 'none'" in page
    assert not re.findall(r"""(?:src|href)=["'](?!#)""", page.replace("xlink:href", "href"))
    assert page.count('role="img" aria-label="Levels of the class. A-1, has a strategy') == 1
    assert page.count("<table>") == page.count("<caption>") == 6
    ids = re.findall(r' id="([^"]+)"', page)
    assert len(re.findall(r"<svg ", page)) == 4 and not re.search(r"#0[a-d]0[\da-f]{3}", page), (
        "all colours are the page's"
    )
    used = set(re.findall(r"url\(#([^)]+)\)|href=\"#([^\"]+)\"", page))
    assert {one or other for one, other in used} <= set(ids)


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_pages_fit_and_no_word_is_cut(chromium, written, scheme):
    page = chromium.new_context(viewport={"width": 1280, "height": 720}, color_scheme=scheme).new_page()
    told = []
    page.on("console", lambda message: told.append(message.text))
    page.on("request", lambda request: told.append(request.url) if not request.url.startswith("file:") else None)
    for name in ("attainment.html", "sheet.html"):
        page.goto(f"file://{written / name}")
        assert page.evaluate("document.documentElement.scrollWidth") <= 1280
        wide = "[...document.querySelectorAll('.wide')].map(one => one.scrollWidth - one.clientWidth)"
        assert set(page.evaluate(wide)) == {0}
        outside = """[...document.querySelectorAll('svg.plot')].flatMap(svg => {
            const frame = svg.getBoundingClientRect();
            return [...svg.querySelectorAll('text')].filter(one => {
                const box = one.getBoundingClientRect();
                return box.left < frame.left - 1 || box.right > frame.right + 1 || box.top < frame.top - 1;
            }).map(one => one.textContent);
        })"""
        assert page.evaluate(outside) == []
        assert findings(page) == []
    assert told == []
