"""docs/guide says what holds: what it names is there, and what it counts is counted."""

from __future__ import annotations

import itertools
import json
import re
import tomllib

import pytest
from checkout import ROOT
from guide_pages import GUIDE, PAGES, anchor, fences, headings, links, rows, spans, text

from labcourse.answers import starts
from labcourse.grading import settings
from rotflex.course.questions import CATALOGUE as WHOLE
from rotflex.hil import bench_file

NAMES = [page.name for page in PAGES]
CATALOGUE = starts.with_optional(WHOLE, ())  # what every class has
NOTEBOOKS = {name[:2]: name for name in CATALOGUE.notebooks}


@pytest.mark.parametrize("name", NAMES)
def test_each_link_leads_to_a_file_and_a_heading(name):
    for link in links(name):
        if re.match(r"[a-z]+:", link):
            continue
        path, _, place = link.partition("#")
        target = (GUIDE / path).resolve() if path else GUIDE / name
        assert target.exists(), link
        if place:
            assert place in {anchor(words) for _, words in headings(target)}, link


def test_each_page_is_on_the_first_one():
    assert {link for link in links("index.md") if "/" not in link} == {*NAMES} - {"index.md"}


@pytest.mark.parametrize("name", NAMES)
def test_each_file_and_folder_of_the_checkout_is_there(name):
    kept = re.compile(r"(solutions|rotflex|docs|data|tools|notebooks|tests|labcourse)/[^ …<]*|pyproject\.toml")
    for span in spans(name):
        if kept.fullmatch(span):
            assert (ROOT / span).exists(), span
        if re.fullmatch(r"\d\d_\w+", span):
            assert span in WHOLE.notebooks or (ROOT / "solutions" / f"{span}.ipynb").exists(), span
        if re.fullmatch(r"\d\d", span):
            assert span in NOTEBOOKS, span


@pytest.mark.parametrize("name", NAMES)
def test_settings_are_understood_and_name_questions_that_there_are(name, tmp_path):
    inline = [f"[marks]\n{span}" for span in spans(name) if re.match(r"(drop|weights) = ", span)]
    inline += [f"[{table}] {rest}".replace("] ", "]\n") for table, rest in _entries(name)]
    for block in (*fences(name, "toml"), *inline):
        if "address" in tomllib.loads(block):
            (tmp_path / "bench.toml").write_text(block, encoding="utf-8")
            bench_file.load(tmp_path / "bench.toml")
        else:
            due = "" if "[late]" not in block or "[[deadline]]" in block else "[[deadline]]\ndue = 2026-11-21\n"
            (tmp_path / "course.toml").write_text(due + block, encoding="utf-8")
            settings.read(tmp_path, ("workbook", "real_bench"), catalogue=CATALOGUE)


def _entries(name: str) -> list[tuple[str, str]]:
    """`[reflect] asks = false` within a sentence."""
    found = [
        re.fullmatch(r"\[(reflect|feedback|late|levels|outcomes|report)\] (\w+ = .+)", span) for span in spans(name)
    ]
    return [(one[1], one[2]) for one in found if one]


TABLE_1 = {"01": 90, "02": 45, "03": 75, "04": 15, "05": 45, "07": 60, "08": 60, "09": 30, "10": 15}


def test_each_answer_of_the_workbook_has_its_solution():
    table = rows("workbook_sections.md", "## Answers")
    assert [row[0] for row in table] == [number for number in CATALOGUE.questions if number != "0.1"]
    for number, notebook, cell, _ in table:
        assert notebook.strip("`") == CATALOGUE.questions[number].notebook
        solved = json.loads((ROOT / "solutions" / f"{notebook.strip('`')}.ipynb").read_text(encoding="utf-8"))["cells"]
        (source,) = ["".join(one["source"]) for one in solved if one["id"] == cell.strip("`")]
        assert "BEGIN SOLUTION" in source


def minutes(number: str) -> int:
    """What a notebook states; check-course holds it against the formula."""
    cells = json.loads((ROOT / "solutions" / f"{NOTEBOOKS[number]}.ipynb").read_text(encoding="utf-8"))["cells"]
    first = next(cell for cell in cells if cell["cell_type"] == "markdown")
    return int(re.search(r"about (\d+) minutes", "".join(first["source"]))[1])


def points(questions) -> tuple[float, float]:
    """Points of questions, and how many of them a person gives."""
    parts = [part for question in questions for part in question.parts]
    return sum(part.points for part in parts), sum(part.points for part in parts if part.marked == "person")


def test_the_table_of_notebooks_is_counted():
    *table, last = rows("organisation.md", "## The notebooks")
    assert [row[0].strip("`") for row in table] == list(CATALOGUE.notebooks)
    for notebook, section, time, asked, worth, by_person, _ in table:
        there = [question for question in CATALOGUE.marked.values() if question.notebook == notebook.strip("`")]
        numbers = [question.number for question in there if question.number not in CATALOGUE.judged]
        said = asked.replace(" to ", ", ").split(", ")
        assert (said[0], said[-1]) == (numbers[0], numbers[-1])
        assert (float(worth), float(by_person)) == points(there)
        assert int(time) == minutes(notebook.strip("`")[:2])
        assert all(one.section.startswith(tuple(section.split(" and "))) for one in there) or not section
    sums = [sum(float(row[column]) for row in table) for column in (2, 4, 5)]
    assert [float(last[column]) for column in (2, 4, 5)] == sums


def test_the_optional_notebook_is_counted():
    (name,) = WHOLE.optional
    asked = [question for question in WHOLE.marked.values() if question.notebook == name]
    solved = json.loads((ROOT / "solutions" / f"{name}.ipynb").read_text(encoding="utf-8"))["cells"]
    title = next("".join(cell["source"]) for cell in solved if cell["id"] == "title")
    time = re.search(r"about (\d+) minutes", title)[1]
    worth, by_person = (f"{value:g}" for value in points(asked))
    said = re.sub(r"\s+", " ", text("organisation.md"))
    assert f"It takes about {time} minutes at the bench." in said
    questions = f"{asked[0].number} to {asked[-1].number}"
    assert f"Its questions {questions} have {worth} points, {by_person} of these by a person." in said
    assert f"`{name}` takes {time} minutes more" in re.sub(r"\s+", " ", text("time.md"))


def test_the_parts_of_the_course_are_worth_what_is_said():
    section = {"pre-lab, modelling": "2.2", "in-lab, modelling": "2.3", "Table 2": "2.4", "report, modelling": "5.1"}
    section |= {"pre-lab, control": "3.3", "in-lab, control": "3.4", "Table 3": "3.5", "report, control": "5.2"}
    table = rows("marking.md", "## Pre-lab, in-lab, report")
    assert {row[0] for row in table} == {*section}
    for what, asked, worth, by_person, _ in table:
        there = [one for one in CATALOGUE.marked.values() if one.section.startswith(section[what])]
        assert (float(worth), float(by_person)) == points(there), what
        if asked:
            assert asked.split(" to ") == [there[0].number, there[-1].number]
    read = {row[0]: row[4] for row in table}
    for what, name in (("report, modelling", "Modeling report"), ("report, control", "Control report")):
        assert f"{len(CATALOGUE.reports[name].parts)} texts" in read[what]


def test_times_beside_the_workbooks_table_1():
    *table, last = rows("time.md", "## How long it takes")
    assert {row[3].strip("`"): int(row[2]) for row in table} == {number: minutes(number) for number in NOTEBOOKS}
    assert {row[3].strip("`"): int(row[1]) for row in table if row[1] != "–"} == TABLE_1
    assert [int(last[1]), int(last[2])] == [sum(TABLE_1.values()), sum(minutes(number) for number in NOTEBOOKS)]


@pytest.mark.parametrize("plan", [words for _, words in headings("time.md") if re.match("Three|Two|Six", words)])
def test_a_plan_adds_up_has_each_notebook_and_fits_its_sessions(plan):
    had: list[str] = []
    for row in rows("time.md", f"## {plan}"):
        for cell, total in itertools.pairwise(row):
            numbers = re.findall(r"`(\d\d)`", cell)
            if numbers and total.isdigit():
                assert int(total) == sum(minutes(number) for number in numbers), row
                had += numbers
            long = re.search(r"\((\d+) min\)", row[0])
            if long and total.isdigit():
                assert int(total) <= int(long[1])
    assert sorted(had) == sorted(NOTEBOOKS)


def test_the_python_that_is_required_and_extras_are_those_of_the_packages():
    said = text("requirements.md")
    ours, theirs = (
        tomllib.loads((ROOT / folder / "pyproject.toml").read_text(encoding="utf-8"))["project"]
        for folder in (".", "labcourse")
    )
    assert ours["requires-python"] == theirs["requires-python"] == f">={re.search('Python ([0-9.]+) or', said)[1]}"
    for name, extra in re.findall(r"`(rotflex|labcourse)\[(\w+)\]`", said):
        assert extra in (ours if name == "rotflex" else theirs)["optional-dependencies"]


def test_classes_that_begin_in_the_middle_have_the_notebooks_and_points_that_are_said():
    table = {row[0].strip('`"'): row for row in rows("middle.md", "A course on control")}
    assert [*table] == [start.name for start in CATALOGUE.starts]
    for start in CATALOGUE.starts:
        _, _given, released, worth, which = table[start.name]
        first, begin, last = re.findall(r"`(\d\d)`", released)
        left = [number for number in NOTEBOOKS if NOTEBOOKS[number] not in start.skips]
        assert left == [first, *(number for number in NOTEBOOKS if begin <= number <= last)]
        assert float(worth) == points(starts.narrowed(CATALOGUE, start).marked.values())[0]
        own = [one for one in CATALOGUE.starts if one.name == "stiffness" or one is start]
        assert set(re.findall(r"\d\.\d+", " ".join(table[one.name][1] for one in own))) == {
            one for one, _ in start.gives
        }
        assert (which == "any") == (start.on_own_bench is not None)
