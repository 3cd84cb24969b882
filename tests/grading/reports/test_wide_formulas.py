"""A student's formula widens no page, and covers nothing beside it."""

import pytest
from checkout import ROOT

from labcourse.grading.reports.markdown import as_html

STYLES = ("reports/templates/feedback.css", "scoring/page/scoring.css")
WIDE = [r"\hspace{99999em}", r"\hspace{-9999em} x", r"\qquad" * 160, r"\rule{99999em}{1em}", "x" * 900]


@pytest.mark.browser
@pytest.mark.parametrize("style", STYLES)
def test_a_wide_formula_scrolls_in_its_box(chromium, style):
    css = (ROOT / "labcourse" / "grading" / style).read_text(encoding="utf-8")
    formulas = [f"{sign}{formula}{sign}" for formula in WIDE for sign in ("$", "$$")]
    words = "".join(f'<div class="given words">{as_html(f"a {formula} b")}</div>' for formula in formulas)
    page = chromium.new_page(viewport={"width": 1280, "height": 720})
    page.set_content(f"<!doctype html><style>{css}</style><body>{words}</body>")
    assert page.locator("math").count() > len(WIDE)
    assert page.evaluate("document.documentElement.scrollWidth") <= 1280
    page.close()
