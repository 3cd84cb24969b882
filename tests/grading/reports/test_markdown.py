"""Students' words as people read them: formulas and pictures are there, and nothing that does anything."""

import base64
import io
import re
from html.parser import HTMLParser

import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from labcourse.answers.words import MAX_STORED
from labcourse.grading.reports import markdown
from labcourse.grading.reports.markdown import MOST_BYTES, FormulaError, as_html, as_mathml

USUAL = re.compile("p|strong|em|s|code|pre|[uo]l|li|blockquote|[hb]r|img|span|table|thead|tbody|t[rhd]")
MATHS = re.compile(
    "math|m(row|i|n|o|text|su[bp]|subsup|frac|sqrt|root|over|under|underover|table|t[rd]|style|space|padded|phantom)"
)
ATTRIBUTES = {"src", "alt", "class", "start", "style"}


class Elements(HTMLParser):
    def __init__(self, page):
        super().__init__()
        self.names, self.attributes, self.words = set(), [], []
        self.feed(str(page))

    def handle_starttag(self, tag, attrs):
        self.names.add(tag)
        self.attributes += [(tag, *pair) for pair in attrs]

    def handle_data(self, data):
        self.words.append(data)


def harmless(page):
    """Look at all that a page has, and give the words in it."""
    found = Elements(page)
    assert [name for name in found.names if not USUAL.fullmatch(name) and not MATHS.fullmatch(name)] == []
    for tag, name, value in found.attributes:
        if USUAL.fullmatch(tag):
            assert name in ATTRIBUTES, (tag, name)
            assert name != "src" or value.startswith("data:image/png;base64,")
            assert name != "style" or re.fullmatch(r"text-align:(left|right|center)", value)
        else:
            assert not re.search(r"[:()/<>\"']", value or ""), (tag, name, value)
    return " ".join("".join(found.words).split())


def png():
    packed = io.BytesIO()
    Image.new("RGB", (4, 3)).save(packed, "PNG")
    return packed.getvalue()


def test_paragraphs_lists_tables_and_emphasis_are_shown():
    page = as_html("Größe **wichtig**, *oder* ~~nicht~~\n\n1. eins\n2. zwei\n\n| a | b |\n|--:|---|\n| 1 | `x` |")
    for piece in ("<strong>wichtig</strong>", "<em>oder</em>", "<s>nicht</s>", "<ol>", "<th", "<code>x</code>"):
        assert piece in page
    harmless(page)


def test_formulas_become_mathml_in_a_line_and_on_lines_of_their_own():
    page = as_html("So $\\omega_n=\\sqrt{K_s/J_l}$.\n\n$$\nx_1\n- y = \\frac{a}{b}\n$$\n\nand $$a*b*c$$ too")
    assert page.count("<math") == 3
    assert "<msub><mi>ω</mi><mi>n</mi></msub>" in page and "<msqrt>" in page and "<mfrac>" in page
    assert "<li>" not in page and "<em>" not in page
    assert page.count('display="block"') == 2
    matrix = as_html("\\begin{bmatrix}\na & b \\\\\nc & d\n\\end{bmatrix}")
    assert "<mtable>" in matrix and "<p>" in matrix


@pytest.mark.parametrize("text", ["$$ab$$", "$$ab\n$$", "$$\nab$$", "so\n\n$$ab$$\n\nand"])
def test_a_formula_on_lines_of_its_own_is_whole_wherever_its_signs_stand(text):
    page = as_html(text)
    assert page.count("<math") == 1 and "$" not in page
    assert re.findall(r"<mi>(\w+)</mi>", page) == ["a", "b"]


@pytest.mark.parametrize("text", ["It costs $5.", "`$x$` is typed so", "5 \\$ and 6 \\$", "$ $", "$$"])
def test_what_is_no_formula_stays(text):
    page = as_html(text)
    assert "<math" not in page
    assert "$" in page


@pytest.mark.parametrize("latex", [r"\frac{", r"\begin{matrix} a", "{" * 500, "x" * 1001])
def test_a_formula_that_is_not_understood_is_shown_as_it_was_typed(latex):
    with pytest.raises(FormulaError):
        as_mathml(latex)
    assert f"<code>${latex}$</code>" in as_html(f"a ${latex}$ b")


def test_pictures_that_came_along_are_shown_once_each():
    pictures = {"attachment:my%20plot.png": png(), "plots/ü.png": png()}
    page = as_html("![the *plot*](attachment:my%20plot.png) ![](plots/ü.png) ![x](attachment:my%20plot.png)", pictures)
    assert page.count("<img ") == 2 and 'alt="the *plot*"' in page
    assert "[picture as above: x]" in page
    harmless(page)


def test_pictures_from_elsewhere_are_words():
    page = as_html(
        "![plot](https://example.org/a.png) ![b](file:///etc/passwd) ![c](attachment:none.png) ![d](attachment:d)",
        {"attachment:d": b"<svg onload='alert(1)'/>"},
    )
    assert "<img" not in page
    assert "[picture not available: plot]" in page and "[picture not available: c]" in page


def test_links_are_shown_as_they_were_typed():
    page = as_html("[see](https://example.org/%3Cimg%20src=x%20onerror=alert(1)%3E) <https://example.org/y>")
    assert "[see](https://example.org/%3Cimg" in page and "&lt;https://example.org/y&gt;" in page
    assert "href" not in page and "<a" not in page and "<img" not in page


def test_headings_are_the_pages_own():
    assert as_html("# Title\n\nand\n===") == "<p><strong>Title</strong></p>\n<p><strong>and</strong></p>\n"


HOSTILE = [
    "<script>alert(1)</script>",
    "<img src=x onerror=alert(1)>",
    "<svg/onload=alert(1)>\n\n<style>*{display:none}</style>",
    "[x](javascript:alert(1)) [y](data:text/html,<script>alert(1)</script>) <javascript:alert(1)>",
    '![x](javascript:alert(1)) ![" onerror="alert(1)](attachment:a) ![x](attachment:a "t\\" onload=\\"alert(1)")',
    '[x]: https://evil.example/ "onmouseover=alert(1)"\n\n[x] ![x]',
    "$<script>alert(1)</script>$ $\\text{<img src=x onerror=alert(1)>}$",
    '$\\href{javascript:alert(1)}{x}$ $\\style{background:url(//evil.example)}{x}$ $\\class{a" onload="b}{x}$',
    '$\\color{red" onload="alert(1)}x$ $\\unicode{60}script\\unicode{62}$ $&lt;script&gt;$ $\\&\\#60;$',
    '```<script>\n<script>alert(1)</script>\n```\n~~~ " onload=alert(1)\nx\n~~~',
    "&lt;script&gt; &#60;script&#62; \x1b[31m\u202e\u2066 right &#x202e; left",
    "</div></body></html><!-- <iframe src=//evil.example> -->",
    "| <script> | b |\n|---|---|\n| <img onerror=x> | [a](javascript:x) |",
    "<details open ontoggle=alert(1)> <math><mi xlink:href=javascript:alert(1)>x</mi></math>",
]


@pytest.mark.parametrize("text", HOSTILE, ids=range(len(HOSTILE)))
def test_nothing_that_runs_loads_or_leads_away_is_left(text):
    page = as_html(text, {"attachment:a": png()})
    harmless(page)
    assert "\x1b" not in page and "\u202e" not in page


@given(st.text(alphabet="$\\{}^_&<>\"'[]()!*`~#|-+> \n1a:/%=", max_size=300))
def test_no_text_becomes_anything_that_does_something(text):
    harmless(as_html(text, {"attachment:a": png()}))


DEEP = {
    "quotes": ">" * 5000,
    "a thousand levels of lists": "- " * 1000 + "x",
    "pictures": "![" * 2500,
    "stars": "*a **b " * 700,
    "table": "|" * 2400 + "\n" + "|-" * 1200 + "|\n" + "|\n" * 100,
    "dollars": "$" * 5000,
    "formulas": "$\\frac{a}{b}$ " * 350,
    "braces": "$" + "{" * 900 + "}" * 900 + "$",
    "fractions": "$" + "\\frac" * 190 + "$",
    "scripts": "$" + "a^" * 450 + "a$",
    "environments": "$" + "\\begin{matrix}" * 60 + "$",
    "definitions": "$\\def\\a{\\b\\b}\\def\\b{\\c\\c}\\newcommand{\\c}{\\d\\d}\\a\\a$",
    "entities": "&amp;" * 1000,
    "the same picture": "![](attachment:a)" * 290,
}


@pytest.mark.timeout(60)
@pytest.mark.parametrize("text", DEEP.values(), ids=DEEP)
def test_what_is_built_to_be_large_takes_little_room(text):
    page = as_html(text, {"attachment:a": png()})
    assert len(page) < MOST_BYTES + 1000
    harmless(page)


FITS = pytest.mark.parametrize("fits", [True, False], ids=["fits", "one more"])


@FITS
@pytest.mark.parametrize(("opening", "closing", "levels"), [("{", "}", 1), (r"\frac{", "}2", 2)])
def test_groups_of_a_formula_in_each_other(fits, opening, closing, levels):
    around = 3  # the formula, its row, and what stands in the innermost group
    depth = (markdown._DEEPEST_FORMULA - around) // levels + (not fits)
    latex = opening * depth + "x" + closing * depth
    assert ("<math" in as_html(f"${latex}$")) == fits


TYPED = 'class="words-source"'


@FITS
def test_characters_of_words(fits):
    page = as_html("y" * (markdown.LONGEST + (not fits)))
    assert (TYPED in page) != fits and page.count("y" * markdown.LONGEST) == 1


@FITS
def test_bars_in_a_line(fits):
    columns = markdown._WIDEST - 1 + (not fits)
    wide = "\n".join("|" + cell * columns for cell in ("a|", "-|", "b|"))
    assert ("<table" in as_html(wide)) == fits


@FITS
def test_bytes_of_a_page_without_its_pictures(monkeypatch, fits):
    text, pictures = "So. ![a](a.png)", {"a.png": png()}
    size = len(re.sub('src="[^"]*"', 'src="0"', as_html(text, pictures)))
    monkeypatch.setattr(markdown, "MOST_BYTES", size - (not fits))
    markdown._rendered.cache_clear()
    assert (TYPED in as_html(text, pictures)) != fits


@FITS
def test_bytes_of_a_picture(fits):
    data = png() + bytes(MAX_STORED - len(png()) + (not fits))
    page = as_html("![a](a.png)", {"a.png": data})
    assert ("<img" in page, "picture not available" in page) == (fits, not fits)


def test_a_text_is_rendered_once_and_its_pictures_are_those_of_now(monkeypatch):
    text = "So. ![a](a.png) ![b](b.png) ![a](a.png)"
    first = as_html(text, {"a.png": png(), "b.png": png()})
    monkeypatch.setattr(markdown, "_reader", None)  # it is not needed again
    other = png() + b"more"
    again = as_html(text, {"a.png": other, "b.png": png()})
    assert first == as_html(text, {"a.png": png(), "b.png": png()}) != again
    assert again.count(base64.b64encode(other).decode()) == 1 and 'src="0"' not in again
    monkeypatch.undo()
    assert "<img" not in as_html('<img src="0" alt="x"> ![a](a.png)', {})
    assert as_html('<img src="0" alt="x"> ![a](a.png)', {"a.png": png()}).count("base64") == 1
