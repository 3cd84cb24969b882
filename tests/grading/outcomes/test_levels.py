"""Levels from marks, against the definition written down once more in plain Python, and by hand."""

import random
import re
from fractions import Fraction

import marked_class
import pytest
from checkout import ROOT
from hypothesis import given
from hypothesis import strategies as some
from made_courses import OURS
from marked_class import by_definition

from labcourse.grading.gradebook import Gradebook, MarkRecord, StudentRecord
from labcourse.grading.outcomes import levels, outcome_map
from labcourse.grading.settings import LevelSettings, MarkSettings, read

MAP = outcome_map.find(OURS.folder, OURS.catalogue)
SOMEBODY = StudentRecord("ada")
LEVEL_OF = LevelSettings().level_of


def standing(marks, counted=levels.ALL):
    return levels.standing(marked_class.graded("ada", marks), OURS.catalogue, SOMEBODY, counted)


@pytest.mark.slow
@given(seed=some.integers(0, 2**32), waiting=some.sampled_from((0.0, 0.3, 1.0)))
def test_evidence_of_each_code_and_outcome_is_what_the_definition_says(seed, waiting):
    marks = marked_class.marks(random.Random(seed), waiting=waiting)
    one = standing(marks)
    criteria = {code: {code} for code in OURS.catalogue.outcomes}
    criteria |= {"all": set(OURS.catalogue.outcomes), "1": {"A-1", "A-2", "A-3", "K-1", "K-2", "K-3"}}
    for name, found in one.by_criterion(criteria).items():
        earned, decided, possible, waits = by_definition(marks, criteria[name])
        assert (found.earned, found.decided, found.possible) == pytest.approx((earned, decided, possible))
        assert found.waiting == waits
        assert found.share == (pytest.approx(earned / decided) if decided else None)


def test_the_outcomes_shipped_have_the_customary_codes():
    assert {key: sorted(codes) for key, codes in MAP.criteria().items()} == {
        "1": ["A-1", "A-2", "A-3", "K-1", "K-2", "K-3"],
        "3": ["GS-1", "GS-2"],
        "6": ["B-5", "B-6", "B-7", "B-8", "B-9", "K-1", "K-2", "K-3"],
    }
    assert list(MAP.outcomes) == list("1234567")


def test_a_share_that_is_a_threshold_reaches_it_whatever_floats_make_of_it():
    marks = [MarkRecord("2.2", "T", "partly right", 0.1 + 0.2, 0.4, "")]  # 0.30000000000000004
    assert standing(marks).by_criterion({"A-2": {"A-2"}})["A-2"].share == 0.75
    thirds = [MarkRecord("2.1", "V", "right", 1.1 * 3, 4.4, "")]
    assert LEVEL_OF(standing(thirds).by_criterion({"A-2": {"A-2"}})["A-2"].share) == 3


@pytest.mark.parametrize("possible", [1.0, 2.0, 4.4, 7.0])
def test_work_exactly_at_a_threshold_of_one_decimal_reaches_it(tmp_path, possible):
    for tenths in range(500, 901):
        three = f"3 = {tenths // 10}.{tenths % 10}"
        given = f"[levels]\nshares = {{4 = 95, {three}, 2 = 40}}\nthresholds = {{4 = 95, {three}, 2 = 40}}\n"
        (tmp_path / "course.toml").write_text(given, encoding="utf-8")
        settings = read(tmp_path).levels
        by_machine = float(Fraction(tenths, 1000) * Fraction(str(possible)))
        for points in (by_machine, settings.shares[3] * possible):
            mark = MarkRecord("2.2", "T", "partly right", points, possible, "")
            share = standing([mark]).by_criterion({"A-2": {"A-2"}})["A-2"].share
            assert settings.level_of(share) == settings.level_of(points / possible) == 3, three


def test_a_threshold_of_many_digits_is_reached_by_the_share_that_it_stands_for():
    assert LevelSettings(thresholds={3: 0.6666666667, 2: 0.3333333333, 1: 0.0}).level_of(2 / 3) == 3
    assert LevelSettings(thresholds={3: 0.9, 2: 0.3333333333, 1: 0.0}).level_of(round(1 / 3, 9)) == 2


def test_what_could_not_be_marked_waits_and_what_was_supplied_earned_nothing():
    marks = [
        MarkRecord("2.11", "omega_n", "not marked: key fault", 0, 2, ""),
        MarkRecord("2.12", "J_l", "supplied by your instructor", 0, 1, ""),
        MarkRecord("2.12", "K_s", "right", 2, 2, ""),
    ]
    found = standing(marks).by_criterion({"B-7": {"B-7"}})["B-7"]
    assert (found.earned, found.decided, found.possible, found.waiting) == (2, 3, 5, 1)


def test_what_is_dropped_without_a_code_without_points_or_unknown_is_no_evidence():
    marks = [
        MarkRecord("2.11", "omega_n", "right", 2, 2, ""),
        MarkRecord("2.12", "J_l", "right", 1, 1, ""),
        MarkRecord("2.12", "K_s", "right", 2, 2, ""),
        MarkRecord("3.8", "K", "right", 2, 2, ""),
        MarkRecord("0.1", "resolution", "right", 0, 0, ""),
        MarkRecord("9.9", "gone", "right", 1, 1, ""),
    ]
    kept = standing(marks, MarkSettings(drop=("2.11", "2.12 J_l"))).parts
    assert [part.mark.where for part in kept] == [("2.12", "K_s")]


def test_everybody_with_marks_is_there_and_bears_what_the_roster_says(tmp_path):
    with Gradebook(marked_class.gradebook(tmp_path, {"A": 2, "B": 1})) as book:
        found = list(levels.standings(book, OURS.catalogue))
        assert [(one.about.student, one.about.section) for one in found] == [
            ("a-00", "A"),
            ("a-01", "A"),
            ("b-00", "B"),
        ]
        by_person = {part.mark.where for one in found for part in one.parts if part.by_a_person}
    assert by_person and by_person <= {
        (number, part.name)
        for number, question in OURS.catalogue.marked.items()
        for part in question.parts
        if part.marked == "person"
    }


def tables():
    text = (ROOT / "docs" / "outcomes.md").read_text(encoding="utf-8")
    example = text.partition("### An example to do by hand")[2].partition("\n## ")[0]
    for block in re.findall(r"(?:^\|.*\n)+", example, flags=re.MULTILINE):
        lines = [[cell.strip() for cell in line.strip("|\n").split("|")] for line in block.splitlines()]
        yield lines[2:]


def test_the_example_in_the_documentation_comes_out_as_it_says():
    parts, results = tables()
    marks = [
        MarkRecord(*place.rsplit(" ", 1), status, float(points), float(out_of), "")
        for place, _code, points, out_of, status in parts
    ]
    one = standing(marks)
    assert [part.code for part in one.parts] == [row[1] for row in parts], "all of them are of this course"
    assert [part.mark.out_of for part in one.parts] == [
        OURS.catalogue.marked[part.mark.question].part(part.mark.part).points for part in one.parts
    ]
    found = one.by_criterion({**levels.codes_of(OURS.catalogue), **MAP.criteria()})
    assert results == [
        [
            name,
            f"{found[name].earned:g}",
            f"{found[name].decided:g}",
            str(found[name].waiting),
            "none" if found[name].share is None else f"{100 * found[name].share:g}",
            "none" if found[name].share is None else str(OURS.settings.levels.level_of(found[name].share)),
        ]
        for name in (row[0] for row in results)
    ]
