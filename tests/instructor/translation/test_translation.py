"""Notebooks in another language: what is to be translated, what a translation must keep, and the way there and back."""

from __future__ import annotations

import copy
import json
import re
from collections import Counter
from pathlib import Path

import polib
import pytest
from checkout import ROOT
from hypothesis import given
from hypothesis import strategies as st

from rotflex.courseware import words
from rotflex.errors import GradingError
from rotflex.instructor.translation import paragraphs, po_files, unchanged
from rotflex.instructor.translation.translated import translated

NOTEBOOKS = sorted([*(ROOT / "solutions").glob("*.ipynb"), *(ROOT / "notebooks").glob("*.ipynb")])


def text(source: str, name: str = "text", **metadata: object) -> dict[str, object]:
    return {"cell_type": "markdown", "id": name, "metadata": metadata, "source": source}


def notebook(*cells: dict[str, object]) -> dict[str, object]:
    return {"cells": list(cells), "metadata": {}, "nbformat": 4, "nbformat_minor": 5}


def put(course: Path, name: str, made: dict[str, object], by_source: dict[str, str] | None = None) -> polib.POFile:
    """Bring the file of translations up to date, and put translations in; without any, each piece as it is."""
    po_files.update(made, name, course, "de")
    path = po_files.file_of(course, "de", name)
    found = polib.pofile(str(path))
    for entry in found:
        if by_source is None:
            entry.msgstr = entry.msgid
        elif entry.msgid in by_source:
            entry.msgstr = by_source[entry.msgid]
            entry.flags = []
    found.save(str(path))
    return found


def in_german(tmp_path: Path, source: str, by_source: dict[str, str]) -> tuple[str, tuple[str, ...]]:
    """A cell with its translation, and what is refused of it."""
    made = notebook(text(source))
    put(tmp_path, "01.ipynb", made, by_source)
    done, progress = translated(made, "01.ipynb", tmp_path, "de")
    return done["cells"][0]["source"], progress.refused


# --- there and back ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: f"{path.parent.name}/{path.stem}")
def test_each_notebook_translated_by_itself_is_the_same_to_the_last_byte(path, tmp_path):
    content = path.read_text(encoding="utf-8")
    made = json.loads(content)
    put(tmp_path, path.name, made)
    file = po_files.file_of(tmp_path, "de", path.name)
    before = file.read_bytes()
    po_files.update(made, path.name, tmp_path, "de")
    assert file.read_bytes() == before
    done, progress = translated(made, path.name, tmp_path, "de")
    assert json.dumps(done, indent=1, ensure_ascii=False) + "\n" == content
    assert progress.done == progress.cells
    assert not progress.refused and not progress.open and not progress.stale


PIECES = st.lists(
    st.one_of(
        st.sampled_from(
            [
                *(
                    "$\\alpha$",
                    "$$\nx=1\n\n+2\n$$",
                    "`K = 3`",
                    "```\ncode\n\nmore\n```",
                    "[a link](there.md)",
                    "2.5",
                    "\n\n",
                ),
                *(
                    "* an item",
                    "1. first",
                    "| a | b |\n|---|---|\n| `x` | two words |",
                    "# Heading",
                    "> said",
                    "\n",
                    " ",
                ),
                *("<details><summary>More</summary>", "</details>", "![a figure](attachment:a.png)", "<!-- a\n\nb -->"),
                *(words.BEGIN, words.END, "✎", "{name}", "https://example.org/a", "&nbsp;", "**bold**", "  indented"),
            ]
        ),
        st.text(st.characters(codec="utf-8", exclude_categories=("Cc", "Cs")), max_size=30),
    ),
    max_size=14,
)


@given(PIECES)
def test_any_text_is_its_pieces_in_a_row(parts):
    source = "\n".join(parts)
    assert "".join(piece.text for piece in paragraphs.pieces(source)) == source
    assert all(re.search(r"[^\W\d_]{2}", piece) for piece in paragraphs.to_translate(source))


@given(PIECES)
def test_any_text_translated_by_itself_is_the_same(tmp_path_factory, parts):
    folder = tmp_path_factory.getbasetemp() / "any"
    source = "\n".join(parts)
    made = notebook(text(source))
    po_files.file_of(folder, "de", "01.ipynb").unlink(missing_ok=True)
    put(folder, "01.ipynb", made)
    done, progress = translated(made, "01.ipynb", folder, "de")
    assert done == made and not progress.refused and progress.done == progress.cells


PROTECTED = ["$\\omega_n$", "`K_s`", "](there.md)", "<b>", "42", "{name}", "✎", "https://example.org/a", "&alpha;"]


@given(st.lists(st.sampled_from(PROTECTED), min_size=1, max_size=6), st.randoms(use_true_random=False))
def test_what_is_kept_may_move_but_neither_go_nor_come(kept, chance):
    moved = chance.sample(kept, len(kept))
    source, german = " words ".join(["So", *kept, "end"]), " Worte ".join(["Also", *moved, "Ende"])
    lost, doubled = (" Worte ".join(["Also", *those]) for those in (moved[1:], [moved[0], *moved]))
    assert unchanged.differences(source, german) == []
    assert unchanged.differences(source, lost) and unchanged.differences(source, doubled)


def test_all_but_the_words_is_the_sources(tmp_path):
    """Code, metadata, ids, order, attachments, outputs: compared cell by cell, on this course's German notebook."""
    made = json.loads((ROOT / "solutions" / "00_start.ipynb").read_text(encoding="utf-8"))
    before = copy.deepcopy(made)
    done, progress = translated(made, "00_start.ipynb", ROOT / "solutions", "de")
    assert made == before
    assert progress.done == progress.cells > 10 and not progress.stale and not progress.refused
    changed = 0
    for cell, german in zip(made["cells"], done["cells"], strict=True):
        assert {**german, "source": cell["source"]} == cell
        if cell["cell_type"] == "code":
            assert german["source"] == cell["source"]
        changed += german["source"] != cell["source"]
    assert changed == progress.cells


# --- what is translated -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("source", "wanted"),
    [
        ("## The bench\nIt stands here.", ["The bench", "It stands here."]),
        ("One\nparagraph.\n\nAnother.", ["One\nparagraph.", "Another."]),
        ("* first thing\n* second thing,\n  on two lines", ["first thing", "second thing,\n  on two lines"]),
        ("1. Let it go.\n2. Wait.", ["Let it go.", "Wait."]),
        ("| what | unit |\n|---|---|\n| `a` | metre |", ["| what | unit |", "| `a` | metre |"]),
        ("Then\n\n$$ x\n\n= y \\tag{1} $$\n\nholds.", ["Then", "holds."]),
        ("```python\nprint(1)\n\nprint(2)\n```\nThat prints.", ["That prints."]),
        ("<details><summary>More</summary>\n\nMuch.\n\n</details>", ["<details><summary>More</summary>", "Much."]),
        (f"Why?\n\n{words.BEGIN}\nBecause it bends.\n\nAnd so on.\n{words.END}", ["Why?"]),
        ("![](attachment:a.png)", []),
        ("$$ \\text{gain} $$", []),
        ("> Quoted words", ["Quoted words"]),
    ],
)  # fmt: skip
def test_words_are_taken_out_a_paragraph_at_a_time(source, wanted):
    assert paragraphs.to_translate(source) == wanted


def test_cells_for_instructors_and_code_are_not_translated():
    made = notebook(
        text("For students."),
        text("For instructors.", "marking", tags=["instructor"]),
        {"cell_type": "code", "id": "code", "metadata": {}, "source": "print('words')", "outputs": []},
    )
    assert po_files.keys(made) == [("text", "For students.")]


# --- what is refused --------------------------------------------------------------------------------------------------

REFUSED = {
    "a formula changed": ("So $\\alpha=2x$ holds.", "Also gilt $\\alpha=x$.", "the formula $\\alpha=2x$ is missing"),
    "a formula added": ("So it holds.", "Also gilt $x$.", "the formula $x$ is not in the source"),
    "code": ("Call `lab.check()` now.", "Rufe `lab.prüfe()` auf.", "the code `lab.check()` is missing"),
    "a link's target": ("See [there](a.md).", "Siehe [dort](b.md).", "the link's target ](a.md) is missing"),
    "a picture": ("It ![x](a.png) is.", "Es [x](a.png) ist.", "the picture's sign ! is missing"),
    "a tag": ("Press <kbd>B</kbd> now.", "Drücke B jetzt.", "the tag <kbd> is missing"),
    "an attribute": ('<b style="x">So</b> it is.', '<b style="y">So</b> ist es.', 'the tag <b style="x"> is missing'),
    "nesting": ("<b>so <i>it</i> is</b>", "<b>so <i>ist</b> es</i>", "its tags are not closed"),
    "a comment": ("Here <!-- kept --> it is.", "Hier ist es.", "the comment <!-- kept --> is missing"),
    "a placeholder": ("Of {name} it is.", "Von {Name} ist es.", "the placeholder {name} is missing"),
    "a number": ("Turn by 40 degrees.", "Drehe um 4 Grad.", "the number 40 is missing"),
    "a decimal comma": ("It takes 0.5 s.", "Es dauert 0,5 s.", "the number 0,5 is not in the source"),
    "the sign of an answer": ("A line with ✎ in it.", "Eine Zeile darin.", "the sign ✎ is missing"),
    "two paragraphs": ("One paragraph.", "Zwei\n\nAbsätze.", "it should be one paragraph"),
    "a heading": ("No heading.", "# Eine Überschrift", "it should be one paragraph"),
    "a row": ("| what | unit |", "| was und Einheit |", "the row has 2 signs |, and should have 3"),
}  # fmt: skip


@pytest.mark.parametrize(("source", "german", "why"), REFUSED.values(), ids=REFUSED)
def test_a_translation_that_changes_what_it_must_not_is_refused_and_the_cell_stays(tmp_path, source, german, why):
    made, refused = in_german(tmp_path, source, {source: german})
    assert made == source
    assert len(refused) == 1 and refused[0].startswith("cell 'text': “") and why in refused[0]


@pytest.mark.parametrize(
    ("source", "german"),
    [
        ("See [the bench](a.md) and $x$ then.", "Sieh $x$ und dann [den Prüfstand](a.md) an."),
        ('<img src="a.png" alt="A bench"> it is', '<img src="a.png" alt="Ein Prüfstand"> ist es'),
        ("![The bench](a.png) is shown", "Zu sehen ist ![der Prüfstand](a.png)"),
        ("A | sign in a sentence", "Ein Strich im Satz"),
        ("**Bold** words", "Fette *Worte*"),
    ],
)
def test_words_of_links_and_pictures_and_their_order_are_the_translators(tmp_path, source, german):
    assert in_german(tmp_path, source, {source: german}) == (german, ())


def test_a_cell_is_translated_as_a_whole_or_not_at_all(tmp_path):
    source = "One thing.\n\nAnother thing."
    made = notebook(text(source))
    put(tmp_path, "01.ipynb", made, {"One thing.": "Eines."})
    done, progress = translated(made, "01.ipynb", tmp_path, "de")
    assert done == made and progress.open == ("text",) and not progress.refused
    assert str(progress) == "01.ipynb: 0 of 1 text cells are translated, 1 wait for a translation"


def test_a_heading_of_an_answer_that_would_not_be_read_as_one_is_refused(tmp_path):
    source = f"{words.heading('Your answer: 1.1, why')}\n\nWhy?"
    by_source = dict.fromkeys(paragraphs.to_translate(source))
    heading, why = by_source
    by_source = {heading: heading.replace("Your answer:", "Deine *Antwort:"), why: "Warum?"}
    made, refused = in_german(tmp_path, source, by_source)
    assert made == source and "the line with ✎" in refused[0]


def test_the_forms_in_which_a_file_has_a_text_stay(tmp_path):
    made = notebook({**text(""), "source": ["One thing,\n", "on two lines.\n", "\n", "More."]})
    put(tmp_path, "01.ipynb", made, {"One thing,\non two lines.": "Eines.", "More.": "Mehr."})
    assert translated(made, "01.ipynb", tmp_path, "de")[0]["cells"][0]["source"] == ["Eines.\n", "\n", "Mehr."]


# --- the notebook is changed ------------------------------------------------------------------------------------------

BEFORE = notebook(text("The arm swings to and fro.\n\nIt stops.", "swing"), text("The end.", "end"))
GERMAN = {"The arm swings to and fro.": "Der Arm schwingt.", "It stops.": "Er hält an.", "The end.": "Schluss."}


def entries(course: Path) -> dict[str, polib.POEntry]:
    return {entry.msgid: entry for entry in polib.pofile(str(po_files.file_of(course, "de", "01.ipynb")))}


def test_what_is_translated_stays_when_the_notebook_changes_around_it(tmp_path):
    put(tmp_path, "01.ipynb", BEFORE, GERMAN)
    after = notebook(text("The arm swings there and back.\n\nIt stops.", "swing"), text("New words here.", "new"))
    assert translated(after, "01.ipynb", tmp_path, "de")[1].stale
    po_files.update(after, "01.ipynb", tmp_path, "de")
    found = entries(tmp_path)
    assert found["It stops."].msgstr == "Er hält an." and not found["It stops."].fuzzy
    changed = found["The arm swings there and back."]
    assert changed.fuzzy and changed.msgstr == "Der Arm schwingt."
    assert changed.previous_msgid == "The arm swings to and fro."
    assert found["New words here."].msgstr == ""
    assert found["The end."].obsolete and found["The end."].msgstr == "Schluss."
    done, progress = translated(after, "01.ipynb", tmp_path, "de")
    assert done == after and progress.open == ("swing", "new") and not progress.stale

    po_files.update(BEFORE, "01.ipynb", tmp_path, "de")  # the words come back, and with them their translation
    assert entries(tmp_path)["The end."].msgstr == "Schluss." and not entries(tmp_path)["The end."].obsolete


def test_words_that_moved_to_another_cell_keep_their_translation(tmp_path):
    put(tmp_path, "01.ipynb", BEFORE, GERMAN)
    moved = notebook(text("It stops.", "elsewhere"), text("The end.", "end"))
    po_files.update(moved, "01.ipynb", tmp_path, "de")
    assert [cell["source"] for cell in translated(moved, "01.ipynb", tmp_path, "de")[0]["cells"]] == [
        *("Er hält an.", "Schluss."),
    ]


def test_the_source_of_a_proposal_stays_the_one_that_was_translated(tmp_path):
    put(tmp_path, "01.ipynb", BEFORE, GERMAN)
    for source in ("The arm swings to and back.", "The arms swing to and back."):
        po_files.update(notebook(text(source, "swing")), "01.ipynb", tmp_path, "de")
    assert entries(tmp_path)["The arms swing to and back."].previous_msgid == "The arm swings to and fro."


def test_what_a_tool_wrote_beside_stays(tmp_path):
    put(tmp_path, "01.ipynb", BEFORE, GERMAN)
    path = po_files.file_of(tmp_path, "de", "01.ipynb")
    found = polib.pofile(str(path))
    found.metadata["Last-Translator"] = "Ann"
    found[0].tcomment = "as in the lecture"
    found.save(str(path))
    po_files.update(BEFORE, "01.ipynb", tmp_path, "de")
    found = polib.pofile(str(path))
    assert found.metadata["Last-Translator"] == "Ann" and found[0].tcomment == "as in the lecture"


def test_a_file_that_is_none_is_told(tmp_path):
    path = po_files.file_of(tmp_path, "de", "01.ipynb")
    path.parent.mkdir(parents=True)
    path.write_text("this is no file of translations\n")
    with pytest.raises(GradingError, match=r"01\.po cannot be read as a file of translations"):
        translated(BEFORE, "01.ipynb", tmp_path, "de")


def test_the_same_words_twice_in_a_cell_are_one_entry(tmp_path):
    made = notebook(text("Again and again.\n\nBetween.\n\nAgain and again."))
    put(tmp_path, "01.ipynb", made, {"Again and again.": "Immer wieder.", "Between.": "Dazwischen."})
    assert (
        Counter(entry.msgid for entry in polib.pofile(str(po_files.file_of(tmp_path, "de", "01.ipynb"))))[
            "Again and again."
        ]
        == 1
    )
    done = translated(made, "01.ipynb", tmp_path, "de")[0]
    assert done["cells"][0]["source"] == "Immer wieder.\n\nDazwischen.\n\nImmer wieder."
