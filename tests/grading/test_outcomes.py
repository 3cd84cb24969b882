"""Levels and attainment, against the definition written down once more; what must not be shown of small groups."""

import csv
import random
import re
from collections import Counter
from dataclasses import replace
from datetime import UTC, datetime
from fractions import Fraction

import marked_class
import pytest
from gradebooks import enrol, record
from hypothesis import given, settings
from hypothesis import strategies as some
from made_courses import OURS
from marked_class import by_definition

from labcourse.errors import GradingError
from labcourse.grading import outcomes
from labcourse.grading.gradebook import Gradebook, StudentRecord
from labcourse.grading.marks import Mark
from labcourse.grading.outcomes import evidence, withheld, write_report
from labcourse.grading.settings import Assignment, LevelSettings, MarkSettings, OutcomeSettings, read

MAP = outcomes.read_map(OURS.folder, OURS.catalogue)
CODES = {code: {code} for code in OURS.catalogue.outcomes}
CRITERIA = {"A-1": {"A-1"}, "B-8": {"B-8"}, "1": {"A-1", "A-2", "A-3", "K-1", "K-2", "K-3"}}
LEVEL_OF = LevelSettings().level_of


ADA, ALL = StudentRecord("ada"), MarkSettings()


def standing(marks, about=ADA, counted=ALL):
    return outcomes.standing(about, marks, OURS.catalogue, counted)


# --- levels -----------------------------------------------------------------------------------------------------------


@pytest.mark.slow
@given(seed=some.integers(0, 2**32), waiting=some.sampled_from((0.0, 0.3, 1.0)))
def test_evidence_of_each_code_and_outcome_is_what_the_definition_says(seed, waiting):
    marks = marked_class.marks(random.Random(seed), waiting=waiting)
    one = standing(marks)
    for codes in ({**CODES, "all": set(CODES)} | CRITERIA).values():
        found = evidence(one.parts, codes)
        earned, decided, possible, waits = by_definition(marks, codes)
        assert found == (pytest.approx(earned), pytest.approx(decided), pytest.approx(possible), waits)
        assert found.share == (pytest.approx(earned / decided) if decided else None)


@pytest.mark.parametrize("possible", [1.0, 2.0, 4.4, 7.0])
def test_work_exactly_at_a_threshold_of_one_decimal_reaches_it(tmp_path, possible):
    for tenths in range(500, 901, 7):
        three = f"3 = {tenths // 10}.{tenths % 10}"
        levels = f"[levels]\nshares = {{4 = 95, {three}, 2 = 40}}\nthresholds = {{4 = 95, {three}, 2 = 40}}\n"
        (tmp_path / "course.toml").write_text(levels, encoding="utf-8")
        found = read(tmp_path).levels
        by_machine = float(Fraction(tenths, 1000) * Fraction(str(possible)))
        for points in (by_machine, found.shares[3] * possible):
            share = evidence(standing([Mark("2.2", "T", "partly right", points, possible, "")]).parts).share
            assert found.level_of(share) == found.level_of(points / possible) == 3, three
    assert LevelSettings(thresholds={3: 0.6666666667, 2: 0.3333333333, 1: 0.0}).level_of(2 / 3) == 3


def test_what_waits_is_not_decided_and_what_does_not_count_is_no_evidence():
    marks = [
        Mark("2.11", "omega_n", "not marked: key fault", 0, 2, ""),
        Mark("2.12", "J_l", "supplied by your instructor", 0, 1, ""),
        Mark("2.12", "K_s", "right", 2, 2, ""),
        Mark("3.8", "K", "right", 2, 2, ""),  # without a code
        Mark("0.1", "resolution", "right", 0, 0, ""),  # without points
        Mark("9.9", "gone", "right", 1, 1, ""),
    ]
    assert evidence(standing(marks).parts, {"B-7"}) == (2, 3, 5, 1)
    counted = standing(marks, counted=MarkSettings(drop=("2.11", "2.12 J_l"))).parts
    assert [part.mark.where for part in counted] == [("2.12", "K_s")]


def test_work_that_is_excused_or_not_due_and_not_there_is_no_evidence(tmp_path):
    dues = ((2020, "02_finding_stiffness"), (2020, "05_control_prelab"), (2900, "03_model_validation"))
    given = [Assignment(name, (name,), due=datetime(year, 1, 1, tzinfo=UTC)) for year, name in dues]
    course = replace(OURS, settings=replace(OURS.settings, assignments=tuple(given)))
    marks = [
        Mark("2.12", "J_l", "missing", 0, 1, ""),  # due
        Mark("2.16", "comparison", "missing", 0, 2, ""),  # not due
        Mark("2.1", "V", "right", 2, 2, ""),  # handed in, and not due: due with the last
        Mark("3.1", "explanation", "right", 1, 1, ""),  # excused
    ]
    with Gradebook(tmp_path / "book.sqlite") as book:
        record(book, marked_class.graded("ada", marks))
        book.excuse("ada", ["05_control_prelab"], reason="ill", actor="lea")
        (one,) = outcomes.standings(book, course)
    assert [part.mark.where for part in one.parts] == [("2.12", "J_l"), ("2.1", "V")]


# --- the map ----------------------------------------------------------------------------------------------------------

GOOD = """
scheme = "Ours"
[outcomes]
design = "designs things"
talk = "speaks well"
[codes]
A-1 = ["design"]
GS-1 = ["talk", "design", "talk"]
"""
#: What is replaced, by what → the place that the message names.
FAULTS = [
    ("GS-1 =", "GS1 =", "codes.GS1"),
    ('"talk", "design", "talk"', '"speech"', "codes.GS-1"),
    ('scheme = "Ours"', "year = 3", "year"),
    ('talk = "speaks well"', "talk = 3", "outcomes.talk"),
    ('["design"]', '"design"', "codes.A-1"),
    ("A-1 = [", "X-1 = [1, ", "codes.X-1.0"),
]


def read_map(folder, text):
    (folder / "outcomes.toml").write_text(text, encoding="utf-8")
    return outcomes.read_map(folder, OURS.catalogue)


def test_the_map_as_shipped_has_the_customary_codes_and_another_can_replace_it(tmp_path):
    assert {*MAP.criteria} == {"1", "3", "6"} and {*MAP.criteria["1"]} == CRITERIA["1"]
    assert read_map(tmp_path, GOOD).criteria == {"design": ["A-1", "GS-1"], "talk": ["GS-1"]}
    without = read_map(tmp_path, GOOD.replace('["design"]', "[]").replace('"design", ', ""))
    codes, unused = without.notes(OURS.catalogue)
    assert codes.startswith("A-1, A-2") and "GS-1" not in codes and "design (designs things)" in unused


@pytest.mark.parametrize(("old", "new", "place"), FAULTS)
def test_each_fault_of_the_map_is_listed(tmp_path, old, new, place):
    assert old in GOOD
    with pytest.raises(GradingError, match=f"{re.escape(place)}: "):
        read_map(tmp_path, GOOD.replace(old, new))


# --- attainment -------------------------------------------------------------------------------------------------------


def a_class(sizes, seed, waiting=0.3):
    drawn = random.Random(seed)
    found = []
    for section, size in sizes.items():
        for number in range(size):
            marks = marked_class.marks(drawn, waiting=waiting)
            found.append((standing(marks, StudentRecord(f"{section}-{number}", section=section)), marks))
    return found


def attainments(people, criteria, sections=True, **goal):
    term = replace(OURS.settings, outcomes=OutcomeSettings(**goal), levels=LevelSettings())
    of = (lambda one: one.about.section) if sections else None
    return outcomes.attainments([one for one, _marks in people], criteria, term, of)


def expected(people, codes, level=3):
    """Figures of a group by the definition, from marks alone: students, provisional, levels, attained, mean."""
    shares, provisional = [], 0
    for _one, marks in people:
        earned, decided, _possible, waiting = by_definition(marks, codes)
        if decided:
            shares.append(earned / decided)
            provisional += waiting > 0
    least = {4: 0.9, 3: 0.75, 2: 0.5, 1: 1e-6, 0: 0.0}
    reached = [max(level for level, share in least.items() if one >= share - 1e-9) for one in shares]
    attained = sum(one >= level for one in reached)
    return len(shares), provisional, Counter(reached), attained, pytest.approx(sum(shares) / len(shares))


@pytest.mark.slow
@settings(max_examples=15, deadline=None)
@given(
    seed=some.integers(0, 2**32),
    sizes=some.dictionaries(some.sampled_from("ABCD"), some.integers(6, 9), min_size=1),
    level=some.integers(2, 4),
)
def test_figures_of_the_class_and_its_sections_are_what_the_definition_says(seed, sizes, level):
    people = a_class(sizes, seed)
    found = attainments(people, CRITERIA, level=level, fewest=1)
    assert list(found) == list(CRITERIA)
    for name, groups in found.items():
        codes = CRITERIA[name]
        assert groups.pop("everybody") == expected(people, codes, level)
        for section, figures in groups.items():
            assert figures == expected([who for who in people if who[0].about.section == section], codes, level)


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
        assert len(hidden) == 2 or rest - extra[-1] < fewest


# --- the report -------------------------------------------------------------------------------------------------------


def course(**goal):
    return replace(OURS, settings=replace(OURS.settings, outcomes=OutcomeSettings(**goal), term="2026 autumn"))


@pytest.fixture(scope="module")
def book(tmp_path_factory):
    folder = tmp_path_factory.mktemp("class")
    with Gradebook(marked_class.gradebook(folder, {"North": 7, "South": 6, "Tiny": 3})) as opened:
        yield opened


def table(path):
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def test_the_tables_have_each_criterion_of_each_group_and_student(book, tmp_path):
    count, notes = write_report(tmp_path, course(), book)
    rows = table(tmp_path / "attainment.csv")
    assert count == 16 and len(rows) == (13 + 3) * 4
    hidden = [row for row in rows if row["group"] in ("Tiny", "South")]
    assert hidden and all(row["note"] and not row["students"] and not row["mean share %"] for row in hidden)
    (row,) = [row for row in rows if (row["group"], row["criterion"]) == ("everybody", "A-1")]
    people = [(None, list(one.marks)) for one in book.all_current()]
    students, provisional, reached, attained, mean = expected(people, {"A-1"})
    shown = [row[name] for name in ("term", "students", "of these provisional", "attained")]
    assert shown == ["2026 autumn", str(students), str(provisional), str(attained)]
    assert [row[f"at level {level}"] for level in (4, 3, 2, 1)] == [str(reached[level]) for level in (4, 3, 2, 1)]
    assert float(row["mean share %"]) / 100 == pytest.approx(mean.expected, abs=6e-4)
    assert row["reached"] == ("yes" if attained / students >= 0.7 else "no")
    withheld_rows = sum("not shown" in row["note"] for row in rows)
    there = sum(row["note"] != "nothing decided yet" for row in rows)
    assert 0 < withheld_rows < there and notes[0].startswith(f"Withheld: {withheld_rows} of {there} rows")
    own = {(row["student"], row["criterion"]): row for row in table(tmp_path / "levels.csv")}
    assert len(own) == 16 * (13 + 3)
    earned, decided, _possible, waiting = by_definition(list(book.current("c-01").marks), {"B-7"})
    row = own["c-01", "B-7"]
    assert [row[name] for name in ("points", "decided", "waiting")] == [f"{n:g}" for n in (earned, decided, waiting)]
    assert row["level"] == str(LEVEL_OF(earned / decided))
    assert "c-0" not in (tmp_path / "attainment.csv").read_text(encoding="utf-8")
    assert {row["scheme"] for row in rows if row["kind"] == "outcome"} == {MAP.scheme}


def test_targets_small_classes_and_missing_sections(book, tmp_path):
    def reached(**goal):
        first = write_report(tmp_path, course(**goal), book)[1][0]
        rows = [row for row in table(tmp_path / "attainment.csv") if row["group"] == "everybody" and row["students"]]
        return first, {row["reached"] for row in rows}

    assert reached(level=0, share=100.0)[1] == {"yes"}  # which everybody just has
    assert "no" in reached(level=4, share=100.0)[1]
    first, rows = reached(fewest=17)
    assert first.startswith("This report shows no figures at all") and "fewer than 17" in first and not rows
    assert "ithheld" not in reached(fewest=1)[0]
    write_report(tmp_path, course(), book, by_section=False)
    assert {row["group"] for row in table(tmp_path / "attainment.csv")} == {"everybody"}


def test_a_section_is_one_however_its_letters_are_written_and_its_name_is_no_formula(tmp_path):
    names = ["<script>alert(1)</script>", '=HYPERLINK("x")', "a & b"]
    with Gradebook(marked_class.gradebook(tmp_path, {"lab a": 6, "Lab A": 6, **dict.fromkeys(names, 6)})) as book:
        write_report(tmp_path, course(), book)
    rows = [row for row in table(tmp_path / "attainment.csv") if row["criterion"] == "A-1"]
    groups = {"everybody": "30", "lab a": "12", names[0]: "6", f"'{names[1]}": "6", names[2]: "6"}
    assert {row["group"]: row["students"] for row in rows} == groups


def test_who_has_no_marks_what_waits_what_is_dropped_and_no_map_are_noted(tmp_path):
    with Gradebook(marked_class.gradebook(tmp_path, {"North": 6})) as book:
        enrol(book, tmp_path, ("eve", "Eve", "", "North"))
        lost = replace(course(), folder=tmp_path)
        lost = replace(lost, settings=replace(lost.settings, marks=MarkSettings(drop=("3.17",))))
        notes = " ".join(write_report(tmp_path, lost, book)[1])
        marks = [mark for one in book.all_current() for mark in one.marks if mark.question != "3.17"]
    waiting = sum(mark.status == "for a person" for mark in marks)
    assert "In the gradebook, and in no figure: 1 student without marks" in notes
    assert f"could not be marked: {waiting} parts of 6 students. Levels may change." in notes
    assert "Dropped by course.toml, and no evidence: 3.17." in notes and "no outcomes.toml" in notes
    assert {row["kind"] for row in table(tmp_path / "attainment.csv")} == {"code"}
