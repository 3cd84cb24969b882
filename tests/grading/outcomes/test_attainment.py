"""Attainment of a class, against the definition written down once more; and what must not be shown of small groups."""

import csv
import random
import re
from collections import Counter
from dataclasses import replace

import marked_class
import pytest
from gradebooks import enrol
from hypothesis import given, settings
from hypothesis import strategies as some
from made_courses import OURS
from marked_class import by_definition

from labcourse.grading.gradebook import Gradebook, StudentRecord
from labcourse.grading.outcomes import attainment, class_report, levels, plots
from labcourse.grading.outcomes.small_groups import withheld
from labcourse.grading.settings import LevelSettings, MarkSettings, OutcomeSettings

LEVEL_OF = LevelSettings().level_of
CRITERIA = {"A-1": {"A-1"}, "B-8": {"B-8"}, "1": {"A-1", "A-2", "A-3", "K-1", "K-2", "K-3"}}


def a_class(sizes, seed, waiting=0.3):
    drawn = random.Random(seed)
    found = []
    for section, size in sizes.items():
        for number in range(size):
            marks = marked_class.marks(drawn, waiting=waiting)
            about = StudentRecord(f"{section}-{number}", section=section)
            one = levels.standing(marked_class.graded(about.student, marks), OURS.catalogue, about)
            found.append((one, marks))
    return found


def expected(people, codes, goal):
    """Figures of a group by the definition, from marks alone: students, provisional, levels, attained, mean."""
    shares, provisional = [], 0
    for _one, marks in people:
        earned, decided, _possible, waiting = by_definition(marks, codes)
        if decided:
            shares.append(earned / decided)
            provisional += waiting > 0
    least = {4: 0.9, 3: 0.75, 2: 0.5, 1: 1e-6, 0: 0.0}
    reached = [max(level for level, share in least.items() if one >= share - 1e-9) for one in shares]
    attained = len([level for level in reached if level >= goal.level])
    return len(shares), provisional, Counter(reached), attained, sum(shares) / len(shares)


@pytest.mark.slow
@settings(max_examples=15, deadline=None)
@given(
    seed=some.integers(0, 2**32),
    sizes=some.dictionaries(some.sampled_from("ABCD"), some.integers(6, 9), min_size=1),
    level=some.integers(2, 4),
)
def test_figures_of_the_class_and_its_sections_are_what_the_definition_says(seed, sizes, level):
    people = a_class(sizes, seed)
    goal = OutcomeSettings(level=level, fewest=1)
    found = attainment.attainments(
        [one for one, _marks in people], CRITERIA, LEVEL_OF, goal, lambda one: one.about.section
    )
    assert [one.criterion for one in found] == list(CRITERIA)
    for one in found:
        groups = {section: [who for who in people if who[0].about.section == section] for section in sizes}
        for cell, group in [(one.everybody, people), *((one.groups[name], groups[name]) for name in sizes)]:
            figures = cell.figures
            students, provisional, reached, attained, mean = expected(group, CRITERIA[one.criterion], goal)
            assert (figures.students, figures.provisional, figures.levels) == (students, provisional, reached)
            assert (figures.attained, figures.mean) == (attained, pytest.approx(mean))
            assert figures.attainment == pytest.approx(100 * attained / students)


def test_the_mean_of_each_question_is_of_its_own_parts_with_the_code():
    people = a_class({"A": 12}, 3)
    goal = OutcomeSettings(fewest=2)
    (found,) = attainment.attainments([one for one, _marks in people], {"K-1": {"K-1"}}, LEVEL_OF, goal)
    carry = {number for number, one in OURS.catalogue.marked.items() if any(p.outcome == "K-1" for p in one.parts)}
    assert found.questions.keys() == carry
    for number in carry:
        shares = []
        for _one, marks in people:
            earned, decided, *_rest = by_definition([mark for mark in marks if mark.question == number], {"K-1"})
            shares += [earned / decided] if decided else []
        assert found.questions[number] == (pytest.approx(sum(shares) / len(shares)), len(shares))


@given(
    sizes=some.dictionaries(some.text("abcdefg", min_size=1, max_size=3), some.integers(0, 12)),
    fewest=some.integers(1, 8),
)
def test_what_is_not_shown_cannot_be_worked_out_and_no_more_is_withheld_than_needed(sizes, fewest):
    hidden = withheld(sizes, fewest)
    assert {name for name, size in sizes.items() if 0 < size < fewest} <= hidden
    if not hidden:
        return
    rest = sum(sizes[name] for name in hidden)  # the whole class less all that is shown
    others = [name for name, size in sizes.items() if size and name not in hidden]
    assert not others or (len(hidden) > 1 and rest >= fewest)
    extra = sorted(sizes[name] for name in hidden if sizes[name] >= fewest)
    assert all(size <= sizes[name] for size in extra for name in others), "the smallest ones are"
    if extra:
        without = [name for name in hidden if sizes[name] < fewest]
        before_the_last = rest - extra[-1]
        assert len(hidden) == 2 or before_the_last < fewest, without


def cells(sizes, fewest=5):
    people = a_class(sizes, 1, waiting=0.0)
    goal = OutcomeSettings(fewest=fewest)
    (found,) = attainment.attainments(
        [one for one, _marks in people], {"A-2": {"A-2"}}, LEVEL_OF, goal, lambda one: one.about.section
    )
    return found


def test_a_single_small_section_takes_the_next_smallest_with_it():
    found = cells({"A": 9, "B": 4, "C": 6})
    assert found.everybody.figures.students == 19
    assert {name for name, cell in found.groups.items() if cell.figures is None} == {"B", "C"}
    assert found.groups["B"].why == "fewer than 5: not shown"
    assert found.groups["C"].why == "not shown: it would tell of a group of fewer than 5"


def test_a_section_of_just_enough_is_shown_with_its_questions():
    found = cells({"A": 5, "B": 5})
    assert all(cell.figures.students == 5 for cell in found.groups.values())
    assert all(cells({"A": 5}).questions.values())


def test_a_class_that_is_too_small_is_not_shown_at_all():
    found = cells({"A": 4})
    assert found.everybody.figures is None and found.groups["A"].figures is None
    assert all(mean is None for mean in found.questions.values())


def course(**outcomes):
    return replace(OURS, settings=replace(OURS.settings, outcomes=OutcomeSettings(**outcomes), term="2026 autumn"))


@pytest.fixture
def book(tmp_path):
    with Gradebook(marked_class.gradebook(tmp_path, {"North": 7, "South": 6, "Tiny": 3})) as opened:
        yield opened


def table(path):
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def test_the_table_has_each_criterion_of_everybody_and_each_section_and_hides_small_ones(book, tmp_path):
    class_report.write(tmp_path, course(), book)
    rows = table(tmp_path / "attainment.csv")
    assert len(rows) == (13 + 3) * 4
    hidden = [row for row in rows if row["group"] in ("Tiny", "South")]
    assert hidden and all(row["note"] and not row["students"] and not row["mean share %"] for row in hidden)
    whole = {row["criterion"]: row for row in rows if row["group"] == "everybody"}
    people = [(None, list(one.marks)) for one in book.all_current()]
    students, provisional, reached, attained, mean = expected(people, {"A-1"}, OutcomeSettings())
    row = whole["A-1"]
    assert (row["term"], row["students"], row["of these provisional"]) == (
        "2026 autumn",
        str(students),
        str(provisional),
    )
    assert [row[f"at level {level}"] for level in (4, 3, 2, 1)] == [str(reached[level]) for level in (4, 3, 2, 1)]
    assert row["attained"] == str(attained) and row["mean share %"] == f"{100 * mean:.1f}"
    assert row["reached"] == ("yes" if attained / students >= 0.7 else "no")


def test_a_target_that_is_just_reached_is_reached(book, tmp_path):
    class_report.write(tmp_path, course(level=0, share=100.0), book)  # which everybody has
    rows = [row for row in table(tmp_path / "attainment.csv") if row["group"] == "everybody" and row["students"]]
    assert len(rows) > 8 and {row["reached"] for row in rows} == {"yes"}
    class_report.write(tmp_path, course(level=4, share=100.0), book)
    assert "no" in {row["reached"] for row in table(tmp_path / "attainment.csv")}


def test_each_students_levels_stand_in_a_file_of_their_own(book, tmp_path):
    class_report.write(tmp_path, course(), book)
    rows = {(row["student"], row["criterion"]): row for row in table(tmp_path / "students.csv")}
    assert len(rows) == 16 * (13 + 3)
    marks = list(book.current("c-01").marks)
    earned, decided, possible, waiting = by_definition(marks, {"B-7"})
    row = rows["c-01", "B-7"]
    assert (row["earned"], row["decided"], row["possible"]) == (f"{earned:g}", f"{decided:g}", f"{possible:g}")
    assert row["parts that wait"] == str(waiting) and row["level"] == str(LEVEL_OF(earned / decided))


def test_the_page_names_nobody_and_tells_nothing_of_small_sections(book, tmp_path):
    done = class_report.write(tmp_path, course(), book)
    page = (tmp_path / "attainment.html").read_text(encoding="utf-8")
    assert done.students == 16 and "16 students have marks." in page
    assert "c-0" not in page and "Tiny" in page and "Student 1" not in page
    (by_section,) = re.findall(r'<tr><th scope="row">A-2</th><td>\d+ % of 7.*', page)
    assert by_section.count("not shown: it would tell of a group of fewer than 5") == 1  # South
    assert by_section.count("fewer than 5: not shown") == 1 and by_section.count(" %") == 1  # Tiny
    assert "2 (engineering design)" in page and "2026 autumn" in page


def test_how_much_is_withheld_and_what_decides_it_is_told(book, tmp_path):
    first = class_report.write(tmp_path, course(), book).notes[0]
    rows = table(tmp_path / "attainment.csv")
    hidden = sum("not shown" in row["note"] for row in rows)
    there = sum(row["note"] != "nothing decided yet" for row in rows)
    assert 0 < hidden < there
    assert first.startswith(f"Withheld: {hidden} of {there} rows, as it is of fewer than 5 students")
    assert "(fewest, in [outcomes] of course.toml)" in first
    assert first.partition(",")[0] in (tmp_path / "attainment.html").read_text(encoding="utf-8")


def test_a_report_in_which_nothing_is_shown_says_so_and_one_that_shows_all_says_nothing(book, tmp_path):
    first = class_report.write(tmp_path, course(fewest=17), book).notes[0]
    rows = table(tmp_path / "attainment.csv")
    there = sum(row["note"] != "nothing decided yet" for row in rows)
    assert first.startswith(f"This report shows no figures at all: each of its {there} rows is withheld")
    assert "fewer than 17 students" in first and not any(row["students"] for row in rows)
    notes = class_report.write(tmp_path, course(fewest=1), book).notes
    assert not any("withheld" in one.casefold() for one in notes)


def test_a_section_is_one_however_its_letters_are_written(tmp_path):
    with Gradebook(marked_class.gradebook(tmp_path, {"lab a": 6, "Lab A": 6, "B": 7})) as book:
        class_report.write(tmp_path, course(), book)
    rows = [row for row in table(tmp_path / "attainment.csv") if row["criterion"] == "A-1"]
    assert {row["group"]: row["students"] for row in rows} == {"everybody": "19", "B": "7", "lab a": "12"}


def test_no_two_of_many_sections_have_mark_and_colour_in_common():
    names = [f"Section {number}" for number in range(14)]
    figures = attainment.Figures(6, 0, {4: 6}, 6, 1.0)
    cells = {name: attainment.Cell(figures) for name in names}
    found = [attainment.Attainment(code, attainment.Cell(figures), cells) for code in OURS.catalogue.outcomes]
    drawn = str(plots.groups(found, 70, "one"))
    shown = re.findall(r'xlink:href="#(\w+)"[^>]*style="fill: (var\(--look\d\))', drawn[drawn.index('id="legend') :])
    assert len(shown) == len(set(shown)) == len(names)


def test_with_none_in_place_of_sections_there_are_no_sections(book, tmp_path):
    class_report.write(tmp_path, course(), book, by_section=False)
    assert "By section" not in (tmp_path / "attainment.html").read_text(encoding="utf-8")
    assert {row["group"] for row in table(tmp_path / "attainment.csv")} == {"everybody"}


def test_who_has_no_marks_what_waits_what_is_dropped_and_no_map_are_told(book, tmp_path):
    enrol(book, tmp_path, ("eve", "Eve", "", "North"))
    lost = replace(course(), folder=tmp_path)
    lost = replace(lost, settings=replace(lost.settings, marks=MarkSettings(drop=("3.17",))))
    notes = " ".join(class_report.write(tmp_path, lost, book).notes)
    assert "In the gradebook, and in no figure: 1 student without marks" in notes
    waiting = sum(
        mark.status == "for a person" for one in book.all_current() for mark in one.marks if mark.question != "3.17"
    )
    assert f"could not be marked: {waiting} parts of 16 students. Levels may change." in notes
    assert "Dropped by course.toml, and no evidence: 3.17." in notes and "no outcomes.toml" in notes
    assert {row["kind"] for row in table(tmp_path / "attainment.csv")} == {"code"}
    page = (tmp_path / "attainment.html").read_text(encoding="utf-8")
    assert "3.17:" not in page and "no outcomes.toml" in page


@pytest.mark.parametrize("name", ["<script>alert(1)</script>", "$x^{$", "_hidden", '=HYPERLINK("x")', "a & b"])
def test_a_sections_name_is_text_wherever_it_stands(tmp_path, name):
    with Gradebook(marked_class.gradebook(tmp_path, {name: 6, "other": 6})) as book:
        class_report.write(tmp_path, course(), book)
    page = (tmp_path / "attainment.html").read_text(encoding="utf-8")
    assert "<script" not in page and name.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;") in (
        page.replace("&#34;", '"')
    )
    assert {row["group"] for row in table(tmp_path / "attainment.csv")} >= {f"'{name}" if name[0] == "=" else name}
