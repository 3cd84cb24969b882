"""The derivation as a page: formulas drawn, nothing from a network, in step with its notebook."""

import html
import re

import export_derivation
import nbformat
import pytest

NOTEBOOK = nbformat.read(export_derivation.NOTEBOOK, as_version=4)


@pytest.fixture(scope="module")
def page():
    return export_derivation.page(NOTEBOOK)


def words(page):
    """What a page says to somebody who has it read to them: a formula by its description."""
    body = page[page.index("<body>") :]
    spoken = re.sub(r'<svg[^>]*aria-label="([^"]*)".*?</svg>', r"\1", body, flags=re.DOTALL)
    return html.unescape(re.sub(r"<[^>]*>|\s+", " ", spoken)).split()


def test_needs_no_network_and_no_script(page):
    assert not re.search(r"https?:|<script|<link|<img|@import|url\(", page)


def test_every_formula_of_the_notebook_is_drawn(page):
    shown = [
        output.data["text/latex"]
        for cell in NOTEBOOK.cells
        for output in cell.get("outputs", [])
        if "text/latex" in output.get("data", {})
    ]
    assert len(shown) > 30
    assert page.count('<div class="formula">') == len(shown)
    assert "$" not in " ".join(words(page))
    assert all(re.search(r"M[-\d]+ [-\d]+[LQC]", drawing) for drawing in re.findall(r'<path d="[^"]*"', page))


def test_page_in_docs_is_in_step_with_the_notebook(page):
    stored = export_derivation.PAGE.read_text(encoding="utf-8")
    assert words(stored) == words(page), "say python tools/export_derivation.py"


def test_a_formula_carries_its_description_and_its_size():
    drawing = export_derivation.picture(r"K_s > 0 \quad")
    assert 'aria-label="K_s &gt; 0 \\quad"' in drawing
    wide = export_derivation.picture(r"K_s K_s K_s")
    width = [float(re.search(r"width: ([\d.]+)em", image)[1]) for image in (export_derivation.picture("K_s"), wide)]
    assert 2 * width[0] < width[1] < 3.5 * width[0]


def test_matrices_are_laid_out_by_rows_and_columns():
    latex = r"B = \left[\begin{matrix}0 & a & 2\\\frac{1}{J} & b & c\end{matrix}\right] u"
    drawn = export_derivation.displayed(latex)
    assert "repeat(3, auto)" in drawn
    assert re.findall(r'aria-label="([^"]*)"', drawn) == ["B =", "0", "a", "2", r"\dfrac{1}{J}", "b", "c", "u"]


def test_what_cannot_be_drawn_is_an_error():
    with pytest.raises(ValueError, match="unheardof"):
        export_derivation.displayed(r"\unheardof{x}")
