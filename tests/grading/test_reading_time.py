"""How long a notebook takes: what counts, what is folded away, and texts that state it otherwise."""

import json
import shutil
from dataclasses import replace

import pytest
import reading_time
from checkout import ROOT
from made_courses import OURS
from nbformat import NotebookNode
from nbformat.v4 import new_code_cell, new_markdown_cell, new_notebook, new_output

from labcourse.answers.catalogue import Catalogue
from labcourse.answers.parts import Question, ReportItem, figure, number, prose

TEN = "one two three four five six seven eight nine ten"
COLLAPSED = {"jp-MarkdownHeadingCollapsed": True}


def text(source: str, **metadata) -> NotebookNode:
    return new_markdown_cell(source, metadata=metadata)


def code(source: str, pictures: int = 0, **metadata) -> NotebookNode:
    outputs = [new_output("display_data", {"image/png": "…"}) for _ in range(pictures)]
    return new_code_cell(source, outputs=outputs, metadata=metadata)


def time_of(*cells, questions=(), **more):
    return reading_time.reading_time(new_notebook(cells=list(cells)), "01_made", Catalogue(questions, **more))


def test_words_are_what_holds_a_letter_or_a_digit():
    assert time_of(text("A *word*, and $x = 3$ :\n\n| a | b |\n|---|---|")).words == 7
    assert time_of(text('<div class="alert"><b>Mind</b> this</div> <!-- not this -->')).words == 2


def test_a_hundred_and_twenty_words_take_a_minute_and_a_figure_another():
    found = time_of(text(" ".join([TEN] * 12)), code("", pictures=2), text("![](attachment:a.png)"))
    assert (found.words, found.figures) == (121, 3)
    assert found.minutes == pytest.approx(3 + 121 / 120)


@pytest.mark.parametrize(
    "cells",
    [
        [text(f"<details><summary>More</summary>\n\n{TEN}\n\n</details>")],
        [code(TEN, jupyter={"source_hidden": True})],
        [text("## More", **COLLAPSED), text(TEN), text(f"### Below\n\n{TEN}"), code(TEN, pictures=1)],
    ],
    ids=["details", "hidden source", "collapsed heading"],
)
def test_what_has_to_be_opened_is_not_counted(cells):
    found = time_of(*cells)
    assert (found.words, found.figures) == (1 if len(cells) > 1 else 0, 0)


def test_a_collapsed_heading_ends_with_the_next_of_its_level():
    below = [text("### More", **COLLAPSED), text(TEN)]
    assert time_of(*below, text(f"#### Deeper\n\n{TEN}")).words == 1
    assert time_of(*below, text(f"### Next\n\n{TEN}")).words == 1 + 1 + 10
    assert time_of(*below, text(f"## Higher\n\n{TEN}")).words == 1 + 1 + 10


def asked(*parts, number="1.1", notebook="01_made"):
    return Question(number, "1", notebook, "Made", (), parts)


def a_number(name="x", **more):
    return replace(number(name, "m", None, "", "A number."), **more)


def test_answers_take_their_time_by_their_kind():
    found = time_of(questions=[asked(a_number(), figure("plot", "", "A plot."), prose("why", "", "Why?"))])
    assert (found.answers, found.in_words, found.minutes) == (2, 1, 3 + 3 + 8)


def test_the_questions_of_other_notebooks_take_no_time_here():
    assert time_of(questions=[asked(a_number(), notebook="02_other")]).minutes == 0


def test_a_table_is_one_answer_whatever_it_carries_over():
    questions = [asked(a_number("x"), a_number("y"))]
    table = asked(*(a_number(name, shows=("1.1", name)) for name in "xy"), number="Table 1", notebook="02_table")
    catalogue = Catalogue(questions, tables=[table])
    assert reading_time.reading_time(new_notebook(), "02_table", catalogue).minutes == 3


@pytest.mark.parametrize("section", ["## 2 The report\n\n", ""])
def test_a_report_is_apart_with_the_section_that_leads_to_it(section):
    item = ReportItem("Report", "I", "Aim", "What for?", ("a",), part="aim")
    answer = {"labcourse": {"question": "Report", "part": "aim"}, "nbgrader": {"solution": True, "grade_id": "aim"}}
    solution = "<!-- BEGIN SOLUTION -->\nit\n<!-- END SOLUTION -->"
    found = time_of(
        text(TEN),
        *([text(f"{section}{TEN}")] if section else []),
        text(solution, **answer),
        report_items=[item],
        reports={"Report": ("1", "01_made", "Report")},
    )
    assert (found.words, found.minutes) == (10, 10 / 120)


@pytest.fixture
def copy(tmp_path):
    """This course's notebooks in a folder of their own."""
    shutil.copytree(ROOT / "solutions", tmp_path / "solutions", ignore=shutil.ignore_patterns("__pycache__", "*.json"))
    return replace(OURS, folder=tmp_path / "solutions")


def test_this_course_states_what_the_formula_gives():
    assert [str(finding) for finding in reading_time.other_times(OURS)] == []


def test_a_time_that_is_stated_otherwise_is_told_with_its_place(copy):
    said = [finding for name in ("02_finding_stiffness", "00_start") for finding in stating(copy, name, minutes=5)]
    assert any(line.startswith("02_finding_stiffness.ipynb, cell 'title': 02_finding_stiffness takes") for line in said)
    assert any("00_start.ipynb, cell 'map': 02_finding_stiffness takes" in line for line in said)
    assert all("by the formula" in line and "this text says 5." in line for line in said)


def stating(course, name, minutes):
    """What is found where a notebook states other times."""
    path = course.folder / f"{name}.ipynb"
    notebook = json.loads(path.read_text(encoding="utf-8"))
    for cell in notebook["cells"]:
        source = "".join(cell["source"])
        cell["source"] = reading_time._TIME_IN_TABLE.sub(
            lambda row: row[0].replace(f" {row['minutes']} min", f" {minutes} min"),
            reading_time._TIME_IN_TITLE.sub(f"about {minutes} minutes", source) if cell["id"] == "title" else source,
        )
    path.write_text(json.dumps(notebook), encoding="utf-8")
    return [str(finding) for finding in reading_time.other_times(course)]
