"""What a report makes of a student's text, in both formats: each trap of the way through pandoc and typst."""

import html
import re
from dataclasses import replace

import pypdfium2
import pytest
from report_texts import of_text, png

from labcourse.report import pandoc, writing
from labcourse.report.contents import Heading, Text
from labcourse.report.markup import Markup

LONG = " + ".join(f"a_{{{index}}}" for index in range(40))
TEXT = rf"""
By (speed) in Figure 1.2, and Figures 1.2 and 2, Table 3, and [1, p. 3]:
* an item
* another one

$$ v = \frac{{s}}{{t}} \tag{{speed}} $$

$$ x = {LONG} $$

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

See figure 9, Table 7, [4], $\\foo{x}$.

$$ \\begin{array}{c|c} a & b \\\\ \\hline c & d \\end{array} $$

$$ \\text{"]; #panic(); ["} \\tag{"] #panic()} $$

`<equation-1>` @equation-1 ] $]$ #panic() [x]{#y}
"""
LEFT_OUT = ["<script>alert(1)</script>", '<b onclick="x()">', "'javascript:alert(1)'", "'file:///etc/passwd'"]
LEFT_OUT += ["'/etc/passwd'", "'https://example.org/a.png'", "\\foo{x}"]


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


def test_the_cover_names_the_report_and_has_the_contents_and_pages_have_numbers(made, paper):
    first = paper[0].get_textpage().get_text_bounded().replace("\N{NO-BREAK SPACE}", " ")
    for text in ("The first <report>", "A course", "2026", "Ada Lovelace, Charles Babbage", "ada", "2026-11-23"):
        assert text in first and html.escape(text) in made.page
    for heading in ("I Results", "I.1 Table 3: Results", "II.1 What follows", "References"):
        assert heading in first
    assert f"1 / {len(paper)}" in first and made.pages == len(paper)


def test_tables_keep_the_workbooks_numbers_and_figures_are_counted_also_in_links_and_bookmarks(made, paper):
    text = "By (speed) in Figure 1, and Figures 1 and 2, Table 3, and [1, p. 3]:"
    main, words = of_page(made.page)
    assert text in of_pdf(paper) and text in words
    targets = set(re.findall(r'href="#([^"]+)"', main))
    assert len(targets) == 4 and all(main.count(f'id="{target}"') == 1 for target in targets)
    links = re.findall(r'<a\s+href="#[^"]+"[^>]*>([^<]+)</a>', main)
    assert [link.replace("\N{NO-BREAK SPACE}", " ") for link in links] == ["Figure 1", "Figures 1", "2", "Table 3", "1"]
    assert "#panic() #panic() @nobody" in of_pdf(paper)
    assert re.search(r"<ul>\s*<li>an item</li>\s*<li>another one</li>\s*</ul>", main)  # without a blank line before
    for shown in (of_pdf(paper), words):
        for caption in ("Figure 1. The speed", "Table 3. Results.", "Figure 2. A picture of"):
            assert caption in shown
    assert 'data-tag="(speed)"' in main and of_pdf(paper).count("(speed)") == 2
    titles = [item.get_title() for item in paper.get_toc()]
    assert titles[:2] == ["I Results", "I.1 Table 3: Results"]
    assert sum(pypdfium2.raw.FPDFPage_GetAnnotCount(page) for page in list(paper)[1:]) == 5  # without the contents


def test_ways_to_refer():
    shown = {
        "See (Figure 1.2), figures 1.2 and 1, Figure 1.": "See (Figure 1), figures 1 and 1, Figure 1.",
        "Or fig. 1.2 and table 3.": "Or fig. 1 and table 3.",
        "In Figs. 1.2, 1 or 1.2-1, behind.": "In Figs. 1, 1 or 1-1, behind.",
        "And Figure 1.2 of [1], not of this report.": "And Figure 1.2 of [1], not of this report.",
        "A list [1, 7] and [see 1], Figure 9.": "A list [1, 7] and [see 1], Figure 9.",
        r"From $$ x = {a $$ behind a broken one.": "behind a broken one.",
    }
    made = writing.write(of_text("\n\n".join(shown)))
    main, words = of_page(made.page)
    for text in (words, of_pdf(made.pdf)):
        assert [one for one in shown.values() if one not in text] == []
    assert len(re.findall(r'<a\s+href="#', main)) == 4 + 2 + 4 + 1 + 1 and not made.problems


def test_a_unit_stays_with_its_number():
    text = "A speed of 20 deg/s at 5 V, by 3\n% of $K_s = 2$ N·m/rad, and in 20 experiments. Then 4·10⁻³ kg, (2 ± 1) s."
    words = re.sub(r"<[^<>]+>", "", re.search(r"<p>A speed.*?</p>", writing.write(of_text(text)).page, re.DOTALL)[0])
    tied = re.findall("(\\S*)\N{NO-BREAK SPACE}(\\S*)", words)
    assert [unit for _number, unit in tied] == ["deg/s", "V,", "%", "N·m/rad,", "kg,", "s."]


def test_a_picture_without_a_caption_is_a_figure_with_a_description():
    pictures = {"attachment:mine.png": png()}
    text = "Of Figure 2.\n\n![](attachment:mine.png)\n\nIn a line ![](attachment:mine.png)."
    made = writing.write(of_text(text, pictures))
    assert made.page.count("<img") == 3 and made.page.count("<figcaption") == 2 and 'href="#figure-2"' in made.page
    assert all(re.search(r'alt="[^"]+"', image) for image in re.findall(r"<img[^>]*>", made.page))


def test_nothing_reaches_over_the_margin(paper):
    for page in paper:
        text = page.get_textpage()
        boxes = [text.get_charbox(index) for index in range(text.count_chars())]
        assert max(box[2] for box in boxes) <= page.get_width() - 2.3 / 2.54 * 72


def test_everything_that_is_not_text_has_a_description_and_the_same_report_is_the_same_file(made):
    assert b"pdfuaid" in made.pdf
    assert all(re.search(r'alt="[^"]+"', image) for image in re.findall(r"<img[^>]*>", made.page))
    assert made.page.count("<img") == 3
    markup = Markup(of_text(TEXT, {"attachment:mine.png": png()}))
    assert set(markup.alt) == {*markup.pictures, *markup.formulas}
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
    assert len(hostile.problems) == len(LEFT_OUT)
    assert all(fragment in problem for fragment, problem in zip(LEFT_OUT, hostile.problems, strict=True))


def test_hostile_words_stay_words_wherever_they_stand():
    words = '"] #panic() $ #read("/etc/passwd") \\ <b>'
    report = of_text("Text.", title=words, authors=words, student=words, date=words)
    caption = replace(report.pieces[3], caption=words, alt=words)
    report = replace(report, pieces=(Heading(1, words), caption, *report.pieces[4:], Text(words, source=words)))
    made = writing.write(report)
    assert of_pdf(made.pdf).count("#panic()") >= 6 and "root:" not in of_pdf(made.pdf) + made.page


def test_spaces_that_pandoc_would_lose_are_replaced():
    meant = {r"a\;b": r"a\:b", r"a \\; b": r"a \\; b", r"a\!b": "ab", r"a\thinspace b": r"a\,  b"}
    meant |= {r"\eqref{law}": r"\text{(law)}", r"v = 1 \tag{law}": "v = 1"}
    made = Markup(of_text(" and ".join(f"${latex}$" for latex in meant)))
    assert [latex for name, latex in made.alt.items() if name.startswith("formula")][3:] == list(meant.values())
    assert "#h(" not in pandoc.write(made.blocks, "typst")[0]


def test_a_formula_that_is_not_understood_is_shown_as_typed(monkeypatch):
    """By pandoc, or by typst, as pandoc may write what typst does not know: here, another name."""
    real = pandoc.write

    def with_a_slip(blocks, to, template="", **values):
        text, refused = real(blocks, to, template, **values)
        return (re.sub(r"(?<!\\)Omega", "nosuchsymbol", text) if to == "typst" else text), refused

    monkeypatch.setattr(pandoc, "write", with_a_slip)
    made = writing.write(of_text("Good: $x_1$. Bad: $\\foo{x}$, $\\Omega_2$, and\n\n$$ \\Omega_3 = 1 $$\n"))
    assert len(made.problems) == 3
    text = of_pdf(made.pdf)
    for latex, problem in zip((r"\foo{x}", r"\Omega_2", r"\Omega_3"), made.problems, strict=True):
        assert latex in problem and latex in text


def test_a_character_without_a_font_stops_no_report():
    """Whether a computer has a font for Chinese is not known; for private use, there is none."""
    made = writing.write(of_text("Before \U0010fffd after 😀.", authors="王丽"))
    (problem,) = made.problems
    assert "10fffd" in problem
    text = of_pdf(made.pdf)
    assert "Before" in text and ("王丽" in text or "王" in problem) and "王丽" in made.page


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
