"""What a report makes of a student's text, in both formats: each trap of the way through pandoc and typst."""

import html
import re
from dataclasses import replace

import pypdfium2
import pytest
from report_texts import FRONT, HERE, of_text, png

from labcourse.report import counting, pandoc, writing
from labcourse.report.document import Place
from labcourse.report.dress import spaced
from labcourse.report.setting import Read, Setting
from labcourse.report.writing import Html, written

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
| 1 | some words, some words, some words, some words, some words, some words, some words, some words, some words |

![A picture of mine](attachment:mine.png)

`#panic()` #panic() @nobody 3 < 4 \# $ 5 *
"""
HOSTILE = """
<script>alert(1)</script>

<b onclick="x()">bold</b> [js](javascript:alert(1)) [file](file:///etc/passwd)
[a page](https://example.org "title")

![system](/etc/passwd)

![far](https://example.org/a.png)

```{=typst}
#read("/etc/passwd")
```

# A heading {onclick="x()"}

See figure 9, Table 7, Equation (nothing), [4], $\\foo{x}$.

$$ \\begin{array}{c|c} a & b \\\\ \\hline c & d \\end{array} $$
"""


@pytest.fixture(scope="module")
def made():
    return written(of_text(TEXT, {"attachment:mine.png": png()}))


@pytest.fixture(scope="module")
def hostile():
    return written(of_text(HOSTILE))


@pytest.fixture(scope="module")
def paper(made):
    return pypdfium2.PdfDocument(made.pdf)


def shown_in(page):
    main = page[page.index("<main>") :].replace("\N{NO-BREAK SPACE}", " ")
    return main, html.unescape(re.sub(r"<[^<>]+>", "", main))


def words_of(paper):
    return " ".join(" ".join(page.get_textpage().get_text_bounded().split()) for page in paper)


def test_the_cover_says_what_whose_and_when_and_pages_after_it_are_numbered(made, paper):
    first, second = (page.get_textpage().get_text_bounded() for page in list(paper)[:2])
    for said in ("The first <report>", "A course", "2026", "Ada Lovelace, Charles Babbage", "ada", "2026-11-23"):
        assert said in first
    assert "Contents" in second
    assert f"2 / {len(paper)}" in second
    assert f"1 / {len(paper)}" not in first
    assert made.pages == len(paper)


def test_parts_and_sections_are_those_of_the_report_in_the_contents_too(paper):
    contents = list(paper)[1].get_textpage().get_text_bounded()
    for heading in ("I Results", "I.1 Table 1", "II Analysis", "II.1 What follows", "References"):
        assert heading in contents.replace("\N{NO-BREAK SPACE}", " ")


def test_references_have_the_numbers_of_the_report(made, paper):
    text = "By (1) in Figure 1, and Figures 1 and 2, Table 1 and Table 2, also (1) and [1, p. 3]:"
    assert text in words_of(paper).replace("\N{NO-BREAK SPACE}", " ")
    main, words = shown_in(made.page)
    assert text in words
    targets = set(re.findall(r'href="#([^"]+)"', main))
    assert targets == {"equation-1", "figure-1", "figure-2", "table-1", "table-2", "source-1"}
    assert all(f'id="{target}"' in main for target in targets)


@pytest.mark.parametrize(
    ("written_so", "shown"),
    [
        ("Equation (speed) holds.", "Equation (1) holds."),  # as notebook 04 says that it be written
        ("See figure 1.2 and figures 1.2 and 1.", "See figure 1 and figures 1 and 1."),
        ("See fig. 1.2 and table 3.", "See fig. 1 and table 1."),
    ],
)
def test_a_reference_may_begin_with_its_word_in_large_or_small_letters(written_so, shown):
    set_ = written(of_text(f"{written_so}\n\n$$ v = 1 \\tag{{speed}} $$\n"))
    assert shown in shown_in(set_.page)[1]
    assert not set_.told


def test_figures_tables_and_equations_are_numbered_with_their_captions(paper):
    text = words_of(paper)
    captions = ("Figure 1. The speed", "Table 1. Results.", "Table 2. Masses of the", "Figure 2. A picture of mine")
    for caption in captions:
        assert caption in text
    assert text.index("(1)") < text.index("Table 2. Masses")


def test_each_of_two_tables_has_the_caption_above_it():
    page = written(of_text("".join(f"Table: The {n}.\n\n| {n} |\n|---|\n| 1 |\n\n" for n in ("first", "second")))).page
    captions = re.findall(r"Table (\d)\. The (\w+)", re.sub(r"<[^>]*>", "", page))
    assert captions == [("2", "first"), ("3", "second")]


def test_a_wide_equation_does_not_reach_its_number(paper):
    for page in paper:
        text = page.get_textpage()
        if text.search("a39").get_next() or "39" in text.get_text_bounded():
            break
    found = text.search("(2)").get_next()
    assert found
    left = text.get_charbox(found[0])[0]
    right = text.get_charbox(found[0] + 2)[2]
    row = text.get_charbox(found[0])
    beside = [
        text.get_charbox(index)
        for index in range(text.count_chars())
        if not found[0] <= index < found[0] + 3 and abs(text.get_charbox(index)[1] - row[1]) < 6
    ]
    assert max(box[2] for box in beside if box[2] > box[0]) <= left
    assert right <= page.get_width() - 2.3 / 2.54 * 72


def test_a_long_row_of_a_table_stays_on_the_page(paper):
    for page in paper:
        text = page.get_textpage()
        rights = [text.get_charbox(index)[2] for index in range(text.count_chars())]
        assert max(rights) <= page.get_width() - 2.3 / 2.54 * 72


def test_everything_that_is_no_text_has_a_description(made):
    assert b"/UAID" in made.pdf or b"pdfuaid" in made.pdf
    assert all(re.search(r'alt="[^"]+"', image) for image in re.findall(r"<img[^>]*>", made.page))
    assert made.page.count("<img") == 2


def test_the_same_report_is_the_same_file(made):
    again = written(of_text(TEXT, {"attachment:mine.png": png()}))
    assert again.pdf == made.pdf
    assert again.page == made.page


def test_a_page_loads_nothing_and_runs_nothing(hostile):
    assert "default-src 'none'" in hostile.page
    main = hostile.page[hostile.page.index("<main>") :]
    assert not re.search(r"<script|<[^>]*\s(?:on\w+=|href=\"(?:javascript|file):|src=\"(?!data:))", main)
    assert 'href="https://example.org"' in main
    assert "root:" not in main


def test_what_is_left_out_is_told_with_its_cell(hostile):
    assert {place for _what, place in hostile.told} == {HERE}
    fragments = ["<script>alert(1)</script>", '<b onclick="x()">', "'javascript:alert(1)'", "'file:///etc/passwd'"]
    fragments += ["no Figure 9", "no Table 7", "no equation (nothing)", "no source [4]", "\\hline", "\\foo{x}"]
    told = [what for what, _place in hostile.told]
    assert len(told) == len(fragments) and all(what.startswith("Section II.1: ") for what in told[:-1])
    assert all(fragment in what for fragment, what in zip(fragments, told, strict=True))


def test_of_a_text_without_faults_only_an_equation_as_wide_as_two_pages_is_told_and_it_is_shown_as_typed(made, paper):
    ((what, place),) = made.told
    assert place == HERE and re.search(r"Equation \(2\).*\d\d %", what)
    assert re.search(r"<ul>\s*<li>an item</li>\s*<li>another one</li>\s*</ul>", made.page)  # without a blank line
    assert "#panic() #panic() @nobody" in words_of(paper)


def test_an_equation_that_is_shrunk_a_little_is_not_told_and_one_in_lines_neither():
    wide = " + ".join(f"a_{{{index}}}" for index in range(18))
    lines = r"\begin{aligned} x &= " + r" \\ &+ ".join([wide] * 3) + r"\end{aligned}"
    assert written(of_text(f"$$ x = {wide} $$\n\n$$ {lines} $$\n")).told == ()


def test_a_long_word_of_a_table_covers_no_value_and_is_told():
    word = "W" * 90
    made = written(of_text(f"Table: Words.\n\n| a | b | c |\n|---|---|---|\n| {word} | 4711 | Geschwindigkeit |\n"))
    ((what, place),) = made.told
    assert place == HERE and what.startswith("Section II.1: Table 2: “WWW")
    for page in pypdfium2.PdfDocument(made.pdf):
        text = page.get_textpage()
        if found := text.search("4711").get_next():
            break
    boxes = [text.get_charbox(at) for at in range(text.count_chars()) if text.get_text_range(at, 1) == "W"]
    ends = max(box[2] for box in boxes if box[3] - box[1] > 0 and box[1] < text.get_charbox(found[0])[3] + 1)
    assert len(boxes) >= 90 and ends < text.get_charbox(found[0])[0]
    assert "Geschwindigkeit" in text.get_text_bounded()


@pytest.mark.parametrize(
    ("latex", "meant"),
    [
        (r"a\;b", r"a\:b"),
        (r"a \\; b", r"a \\; b"),
        (r"a\!b", "ab"),
        (r"a\thinspace b", r"a\, b"),
        (r"a\hspace{1cm}b", r"a\quad b"),
        (r"\theta\;\;\alpha", r"\theta\:\:\alpha"),
    ],
)
def test_spaces_that_pandoc_would_lose_are_others(latex, meant):
    assert re.sub(r" +", " ", spaced(latex)) == meant


def test_no_space_of_a_formula_is_lost_or_negative_and_columns_keep_apart():
    def in_typst(latex):
        math = {"t": "Math", "c": [{"t": "DisplayMath"}, spaced(latex)]}
        return pandoc.write([{"t": "Para", "c": [math]}], "typst")[0]

    assert "#h(" not in in_typst(r"a\;b\!c\,d\:e\quad f")
    assert "a quad & b" in in_typst(r"\begin{array}{cc} a & b \end{array}")  # without brackets


def test_a_formula_that_typst_refuses_stands_there_as_it_is_typed_and_is_told(monkeypatch):
    """As pandoc may write what typst does not know: here, one name more."""
    real = pandoc.write

    def with_a_slip(blocks, into, options=()):
        text, refused = real(blocks, into, options)
        return (re.sub(r"(?<!\\)Omega", "nosuchsymbol", text) if into == "typst" else text), refused

    monkeypatch.setattr(pandoc, "write", with_a_slip)
    made = written(of_text("Good: $x_1$. Bad: $\\Omega_2$, and\n\n$$ \\Omega_3 = 1 $$\n"))
    assert [what for what, _place in made.told if "\\Omega_2" in what] and len(made.told) == 2
    text = words_of(pypdfium2.PdfDocument(made.pdf))
    assert "\\Omega_2" in text and "\\Omega_3 = 1 (1)" in text


def test_a_name_that_typst_has_no_font_for_stops_no_report():
    """Whether a computer has a font for Chinese is not known: it is shown, or told."""
    made = written(replace(of_text("We met 😀."), authors=("王丽",)))
    text = words_of(pypdfium2.PdfDocument(made.pdf))
    assert "王丽" in text or any("王" in what for what, _place in made.told)
    assert "王丽" in made.page


def test_a_character_that_no_font_has_is_told_and_the_report_is_made():
    nowhere = "\U0010fffd"  # for private use: no font of a computer has it
    made = written(of_text(f"Before {nowhere} after."))
    assert [place for what, place in made.told if nowhere in what and "empty box" in what] == [Place(FRONT.notebook)]
    text = words_of(pypdfium2.PdfDocument(made.pdf))
    assert "Before" in text and "after." in text


def test_a_report_that_typst_refuses_for_another_reason_is_not_made(monkeypatch):
    monkeypatch.setattr(writing, "_template", lambda: "#panic()")
    with pytest.raises(pandoc.ReportError, match="typst"):
        written(of_text("Words."))


@pytest.mark.parametrize(
    "text",
    [
        TEXT,
        HOSTILE,
        "a $$x$$ b $$y$$ c",
        "```\n$$ code $$\n| a |\n|---|\n```\n\n$$ z $$",
        "a $$ x = {a $$ b\n\n$$ y $$",
        "a $$ x = {a $$ text $$ y $$",
        "$$ x } $$ t",
        "$$ a $ b $$ c",
        "$$ {a $$ b} $$ and \\\\$$ c $$ $$$ d $$$",
        "$$ a\n\nb $$ and $$ c $$",
        "`$$ code $$` and \\$$ 5 $$ x $$",
        "> quoted\n>\n> $$ x $$\n\n* item\n\n  $$ y $$\n",
        "| a | b |\n| - | - |\n| 1 | 2 |\n\n**Table:** Of $x$.\n\n| c |\n|---|\n| $$ d $$ |\n",
        "![one](attachment:mine.png) and words\n\n![two](attachment:mine.png)\n",
        "",
    ],
)
def test_a_text_is_counted_as_it_is_numbered(text):
    pictures = {"attachment:mine.png": png()}
    document = of_text(text, pictures)
    setting = Setting(document, Read.of(document), Html())
    setting.blocks()
    numbered = (setting._counts.equation, setting._counts.table - 1, setting._counts.figure - 1)
    found = list(counting.counted(text))
    kinds = [one.kind for one in found if one.kind != counting.PICTURE_ALONE or one.name in pictures]
    assert numbered == tuple(map(kinds.count, (counting.EQUATION, counting.TABLE, counting.PICTURE_ALONE)))


def test_a_reference_behind_a_broken_equation_has_the_number_of_the_report():
    text = "$$ x = \\frac{a}{b $$\n\n$$ y = 1 \\tag{mine} $$\n\nBy (mine)."
    assert "By (1)." in words_of(pypdfium2.PdfDocument(written(of_text(text)).pdf))


@pytest.mark.parametrize("typed", [r"\cite{abc}", r"\ref{}", r"\citep[p. 3]{a, b}", r"\autoref{fig:a}"])
def test_a_command_that_stays_as_it_is_typed_is_told(typed):
    made = written(of_text(f"See {typed} there."))
    ((what, place),) = made.told
    assert typed in what and "as it is typed" in what and place == HERE
    assert typed in words_of(pypdfium2.PdfDocument(made.pdf))
