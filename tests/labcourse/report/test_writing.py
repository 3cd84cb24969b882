"""What a report makes of a student's text, in both formats: each trap of the way through pandoc and typst."""

import html
import json
import re
from dataclasses import replace

import pypdfium2
import pytest
from report_texts import FRONT, HERE, of_text, png

from labcourse.report import pandoc, writing
from labcourse.report.document import Place, Section, Text
from labcourse.report.markup import Markup

LONG = " + ".join(f"a_{{{index}}}" for index in range(40))
TEXT = rf"""
By (speed) in Figure 1.2, and Figures 1.2 and 2, Table 3 and Table 2, also \eqref{{speed}} and [1, p. 3]:
* an item
* another one

$$ v = \frac{{s}}{{t}} \tag{{speed}} $$

$$ x = {LONG} $$

Table: Masses of the $m_1$ arms.

| arm | a heading that is longer than any line of a page is, so that the table has to be broken into several lines |
|---|---|
| {"W" * 90} | some words, some words, some words, some words, some words, some words, some words, some words |

![A picture of mine](attachment:mine.png)

In a line ![small](attachment:mine.png) it is. `#panic()` #panic() @nobody 3 < 4 \# $ 5 *
"""
HOSTILE = """
<script>alert(1)</script>

<b onclick="x()">bold</b> [js](javascript:alert(1)) [file](file:///etc/passwd) <!-- a comment --> first<br>second
[a page](https://example.org "title")

![system](/etc/passwd)

![far](https://example.org/a.png)

```{=typst}
#read("/etc/passwd")
```

`#read("/etc/passwd")`{=typst}

# A heading {onclick="x()"}

See figure 9, Table 7, Equation (nothing), [4], $\\foo{x}$.

$$ \\begin{array}{c|c} a & b \\\\ \\hline c & d \\end{array} $$

$$ \\text{"]; #panic(); ["} \\tag{"] #panic()} $$

`<equation-1>` @equation-1 ] $]$ #panic() [x]{#y}
"""
LEFT_OUT = ["<script>alert(1)</script>", '<b onclick="x()">', "'javascript:alert(1)'", "'file:///etc/passwd'"]
LEFT_OUT += ["'/etc/passwd'", "'https://example.org/a.png'", "\\hline", "no Figure 9", "no Table 7"]
LEFT_OUT += ["no equation (nothing)", "no source [4]", "\\foo{x}"]


@pytest.fixture(scope="module")
def made():
    return writing.write(of_text(TEXT, {"attachment:mine.png": png()}))


@pytest.fixture(scope="module")
def paper(made):
    return pypdfium2.PdfDocument(made.pdf)


def of_page(page):
    main = page[page.index("<main>") :].replace("\N{NO-BREAK SPACE}", " ")
    return main, html.unescape(re.sub(r"<[^<>]+>", "", main))


def of_pdf(data):
    pages = pypdfium2.PdfDocument(data) if isinstance(data, bytes) else data
    text = " ".join(" ".join(page.get_textpage().get_text_bounded().split()) for page in pages)
    return text.replace("\N{NO-BREAK SPACE}", " ")


def messages(made):
    return [notice.message for notice in made.markup.notices]


def test_the_cover_names_the_report_and_pages_after_it_have_numbers(made, paper):
    first, second = (page.get_textpage().get_text_bounded() for page in list(paper)[:2])
    for text in ("The first <report>", "A course", "2026", "Ada Lovelace, Charles Babbage", "ada", "2026-11-23"):
        assert text in first and html.escape(text) in made.page
    for heading in ("I Results", "I.1 Table 1", "II Analysis", "II.1 What follows", "References"):
        assert heading in second.replace("\N{NO-BREAK SPACE}", " ")
    assert f"2 / {len(paper)}" in second and f"1 / {len(paper)}" not in first
    assert made.pages == len(paper)


def test_references_and_captions_have_the_numbers_of_the_report(made, paper):
    text = "By (1) in Figure 1, and Figures 1 and 2, Table 1 and Table 2, also (1) and [1, p. 3]:"
    main, words = of_page(made.page)
    assert text in of_pdf(paper) and text in words
    targets = {"equation-1", "figure-1", "figure-2", "table-1", "table-2", "source-1"}
    assert set(re.findall(r'href="#([^"]+)"', main)) == targets
    assert all(f'id="{target}"' in main for target in targets)
    assert "#panic() #panic() @nobody" in of_pdf(paper)
    assert re.search(r"<ul>\s*<li>an item</li>\s*<li>another one</li>\s*</ul>", main)  # without a blank line before
    for shown in (of_pdf(paper), words):
        for caption in ("Figure 1. The speed", "Table 1. Results.", "Table 2. Masses of the", "Figure 2. A picture of"):
            assert caption in shown
    assert 'data-number="2"' in main and "(2)" in of_pdf(paper)


def test_ways_to_refer():
    shown = {
        "Equation (speed) holds.": "Equation (1) holds.",
        "See (Figure 1.2), figures 1.2 and 1.": "See (Figure 1), figures 1 and 1.",
        "Or fig. 1.2 and table 3.": "Or fig. 1 and table 1.",
        "And Figure 2.8 of [1], not of this report.": "And Figure 2.8 of [1], not of this report.",
        r"From $$ x = {a $$ behind a broken one (speed).": "behind a broken one (1).",
        r"As MathJax has it: $\eqref{speed}$.": "As MathJax has it: (1).",
    }
    made = writing.write(of_text("\n\n".join([*shown, "$$ v = 1 \\tag{speed} $$"])))
    for text in (of_page(made.page)[1], of_pdf(made.pdf)):
        assert [one for one in shown.values() if one not in text] == []
    assert not messages(made)


def test_a_tag_of_equations_in_two_other_texts_gives_a_notice():
    document = of_text("By (v).")
    others = tuple(
        Section(
            f"II.{n}",
            "More",
            (Text(f"$$ v = {n} \\tag{{v}} $$\n\nSo (v).", place := Place(HERE.notebook, f"{n}")),),
            place,
        )
        for n in (2, 3)
    )
    (notice,) = Markup(replace(document, sections=(*document.sections, *others))).notices
    assert notice.place == HERE and "the tag v" in notice.message


def test_a_picture_without_a_caption_is_a_figure_with_a_description():
    pictures = {"attachment:mine.png": png()}
    made = writing.write(of_text("![](attachment:mine.png)\n\nIn a line ![](attachment:mine.png).", pictures))
    assert [(item.number, item.captioned) for item in made.markup.numbered["II.1"]] == [(2, False)]
    assert [alt for name, alt in made.markup.alt.items() if name.endswith("png") and not alt] == []
    assert len(made.markup.pictures) == made.page.count("<img") == 3


def test_a_table_has_the_caption_above_or_below_it():
    table = "| {0} |\n|---|\n| 1 |\n\n"
    text = f"Table: The first.\n\n{table}Table: The second.\n\n{table}And:\n\n{table}Table: The third.\n"
    captions = re.findall(r"Table (\d)\. The (\w+)", of_page(writing.write(of_text(text)).page)[1])
    assert captions == [("2", "first"), ("3", "second"), ("4", "third")]


def test_nothing_reaches_over_the_margin_or_its_number(paper):
    for page in paper:
        text = page.get_textpage()
        boxes = [text.get_charbox(index) for index in range(text.count_chars())]
        assert max(box[2] for box in boxes) <= page.get_width() - 2.3 / 2.54 * 72
        if "39" in text.get_text_bounded() and (found := text.search("(2)").get_next()):
            number = boxes[found[0]]
            row = [box for box in boxes if box[2] > box[0] and abs(box[1] - number[1]) < 6 and box[0] < number[0]]
            assert max(box[2] for box in row) <= number[0]


def test_everything_that_is_not_text_has_a_description_and_the_same_report_is_the_same_file(made):
    assert b"pdfuaid" in made.pdf
    assert all(re.search(r'alt="[^"]+"', image) for image in re.findall(r"<img[^>]*>", made.page))
    assert made.page.count("<img") == 3
    assert set(made.markup.alt) == {*made.markup.pictures, *made.markup.formulas}
    again = writing.write(of_text(TEXT, {"attachment:mine.png": png()}))
    assert (again.pdf, again.page) == (made.pdf, made.page)


def test_hostile_text_brings_in_nothing():
    hostile = writing.write(of_text(HOSTILE))
    assert "default-src 'none'" in hostile.page
    main, text = of_page(hostile.page)
    assert not re.search(r"<script|<[^>]*\s(?:on\w+=|href=\"(?:javascript|file):|src=\"(?!data:))", main)
    assert 'href="https://example.org"' in main and "title=" not in main and "<br" in main
    assert "root:" not in text and "root:" not in of_pdf(hostile.pdf)
    assert "=typst" not in main.replace("{=typst}", "")  # it is text, and no attribute
    assert {notice.place for notice in hostile.markup.notices} == {HERE}
    assert len(messages(hostile)) == len(LEFT_OUT)
    assert all(fragment in message for fragment, message in zip(LEFT_OUT, messages(hostile), strict=True))


def test_no_raw_markup_is_written():
    texts = (TEXT, HOSTILE, "> quoted[^1]\n\n---\n\n1. one\n\n[^1]: A *note*.\n\n~~out~~ **in**\n\n    code\n")
    assert not [text for text in texts if '"Raw' in json.dumps(Markup(of_text(text)).blocks)]


def test_an_equation_that_is_shrunk_too_much_gives_a_notice(made, paper):
    (notice,) = made.markup.notices
    assert notice.place == HERE and re.search(r"Equation \(2\).*\d\d %", notice.message)
    wide = " + ".join(f"a_{{{index}}}" for index in range(18))
    lines = r"\begin{aligned} x &= " + r" \\ &+ ".join([wide] * 3) + r"\end{aligned}"
    assert messages(writing.write(of_text(f"$$ x = {wide} $$\n\n$$ {lines} $$\n"))) == []


def test_spaces_that_pandoc_would_lose_are_replaced():
    meant = {
        r"a\;b": r"a\:b",
        r"a \\; b": r"a \\; b",
        r"a\!b": "ab",
        r"a\thinspace b": r"a\,  b",
        r"\begin{array}{cc} a & b \end{array}": r"\begin{array}{cc} a \quad & b \end{array}",
        r"v = 1 \tag{law} \label{x}": "v = 1",
    }
    made = Markup(of_text(" and ".join(f"${latex}$" for latex in meant)))
    assert [latex for name, latex in made.alt.items() if name.startswith("formula")][1:] == list(meant.values())
    assert "#h(" not in pandoc.write(made.blocks, "typst")[0]


def test_a_formula_that_typst_refuses_is_shown_as_typed_with_a_notice(monkeypatch):
    """As pandoc may write what typst does not know: here, another name."""
    real = pandoc.write

    def with_a_slip(blocks, to, template="", **values):
        text, refused = real(blocks, to, template, **values)
        return (re.sub(r"(?<!\\)Omega", "nosuchsymbol", text) if to == "typst" else text), refused

    monkeypatch.setattr(pandoc, "write", with_a_slip)
    made = writing.write(of_text("Good: $x_1$. Bad: $\\Omega_2$, and\n\n$$ \\Omega_3 = 1 $$\n"))
    assert ["\\Omega_2" in messages(made)[0], "\\Omega_3" in messages(made)[1], len(messages(made))] == [True, True, 2]
    text = of_pdf(made.pdf)
    assert "\\Omega_2" in text and "\\Omega_3 = 1 (1)" in text


def test_a_character_without_a_font_stops_no_report():
    """Whether a computer has a font for Chinese is not known; for private use, there is none."""
    document = of_text("Before \U0010fffd after 😀.")
    made = writing.write(replace(document, cover=document.cover | {"authors": "王丽"}))
    (notice,) = made.markup.notices
    assert "\U0010fffd" in notice.message and notice.place == Place(FRONT.notebook)
    text = of_pdf(made.pdf)
    assert "Before" in text and ("王丽" in text or "王" in notice.message) and "王丽" in made.page


def test_a_report_that_cannot_be_written_is_not_made(monkeypatch):
    with pytest.raises(pandoc.ReportError, match="within each other"):
        writing.write(of_text(">" * 3000 + " deep"))
    monkeypatch.setattr(writing, "_resource", lambda name: "#panic()" if name.endswith("typ") else "$body$")
    with pytest.raises(pandoc.ReportError, match="typst"):
        writing.write(of_text("Words $x$."))
    real = pandoc.write
    monkeypatch.undo()
    monkeypatch.setattr(pandoc, "write", lambda *what, **how: (real(*what, **how)[0].replace("Words", "#nothing"), {}))
    with pytest.raises(pandoc.ReportError, match="typst"):
        writing.write(of_text("Words $x$."))  # no formula is to blame
