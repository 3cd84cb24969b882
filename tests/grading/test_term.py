"""A term by the calendar, at six dates: every number in every page and file, against a calculator of its own.

What happens stands in ``term_table.py``; what it comes to is worked out in ``term_by_hand.py``; ``term_class.py`` does
it with the program. The numbers of the calculator are done on paper here, first.
"""

import re
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import pytest
from term_by_hand import ByHand, rounded
from term_class import TermClass
from term_table import ASSIGNMENTS, CLASS, PARTS, QUESTION, TERM

DAYS = range(1, len(TERM) + 1)

# --- the calculator, by hand ------------------------------------------------------------------------------------------

#: Day and student → so far, and out of.
ON_PAPER = {
    # Before anything is due.
    (1, "s1"): ("0.00", 0),
    # 2 + 2.5 + 4: 8.5 / 9 × 20 = 18.888…
    (2, "s1"): ("18.89", 20),
    # 0 + 1.5, and 0 for the mass by the key as it was: 1.5 / 9 × 20 = 3.333…
    (2, "s2"): ("3.33", 20),
    # Nothing, and it is due.
    (2, "s5"): ("0.00", 20),
    # Section B has one day more.
    (2, "s8"): ("0.00", 0),
    # 1 and 0.7 × 0: 1 / 9 × 20 = 2.222…; the mended key gives the mass its 4 points: (1 + 2.8) / 9 × 20 = 8.444…
    (3, "s4"): ("2.22", 20),
    (5, "s4"): ("12.44", 36),  # and 4 of the second lab; its remark waits
    (6, "s4"): ("13.94", 36),  # 5.5; the report cannot be read, and nobody has decided
    # An hour after the extension of the second notebook, within its grace: the assignment is not due.
    (3, "s6"): ("0.00", 0),
    (4, "s6"): ("20.00", 20),  # 2 + 3 + 4 of 9
    # Excused from the only thing that is due.
    (3, "s7"): ("0.00", 0),
    # The new words came after Lab A was given back.
    (4, "s2"): ("3.33", 20),
    # By the mended key, 5.5 / 9 × 20 = 12.222…; 5; 10.
    (5, "s2"): ("27.22", 36),
    # 4 / 9 × 20 = 8.888…; 0.9 × 4 = 3.6; an untouched report.
    (5, "s3"): ("12.49", 36),
    # 0.65 × (2 + 2 + 4) = 5.2; 5.2 / 9 × 20 = 11.555…; until 11-27 nothing else is due.
    (5, "s5"): ("11.56", 20),
    (6, "s5"): ("26.56", 36),  # 5; 10
    # 0.65 × 2 / 9 × 20 = 2.888…; 10; excused from the second lab until that is taken back.
    (5, "s8"): ("12.89", 30),
    (6, "s8"): ("12.89", 36),
    # Of the second lab 4, and its remark waits; no report.
    (6, "s7"): ("4.00", 16),
}


@pytest.mark.parametrize(("day", "student"), ON_PAPER)
def test_the_calculator_agrees_with_paper(day, student):
    earned, out_of = ByHand(day).so_far(student)
    assert (rounded(earned), out_of) == ON_PAPER[day, student]


# --- the program, against the calculator ------------------------------------------------------------------------------


@dataclass(frozen=True)
class Seen:
    """What the program wrote: grades.csv, marks.json, pages, the class's tasks, exports, what ``publish`` said."""

    grades: dict[str, dict[str, str]]
    data: dict[str, dict[str, Any]]
    pages: dict[str, tuple[str, list[list[str]]]]
    to_do: dict[str, tuple[set[str], Fraction | None]]
    exported: dict[tuple[str, str], dict[str, str]]
    published: str


@pytest.fixture(scope="module")
def term(tmp_path_factory):
    """Day → what is seen then."""
    seen = {}
    with pytest.MonkeyPatch.context() as patch:
        there = TermClass(tmp_path_factory.mktemp("term"), patch)
        for number, day in enumerate(TERM, 1):
            there.live(day)
            exported = {(p, title): there.exported(p, title) for p in ("Canvas", "Moodle") for title in ASSIGNMENTS}
            data, pages = ({who: read(who) for who in CLASS} for read in (there.data, there.page))
            seen[number] = Seen(there.grades(), data, pages, there.to_do(), exported, there.published)
    return seen


def parts_of(title):
    """The parts of an assignment that count."""
    return [part for name in ASSIGNMENTS[title][0] for part in PARTS[name]]


@pytest.mark.parametrize("day", DAYS)
def test_grades_csv_has_what_each_student_has_so_far_and_a_column_and_a_state_for_each_assignment(term, day):
    by_hand = ByHand(day)
    for student, row in term[day].grades.items():
        earned, out_of = by_hand.so_far(student)
        expected = (rounded(earned), str(out_of)) if out_of and student != by_hand.lost else ("", "")
        assert (row["so far"], row["so far out of"]) == expected, student
        for title, (_names, out_of) in ASSIGNMENTS.items():
            assert row[f"{title} state"] == by_hand.label(student, title), (student, title)
            assert row[title] == by_hand.column(student, title), (student, title)
            assert row[f"{title} out of"] == ("" if student == by_hand.lost else str(out_of)), (student, title)


@pytest.mark.parametrize("day", DAYS)
def test_undecided_points_are_empty_and_all_others_stand_by_question(term, day):
    by_hand = ByHand(day)
    for student, row in term[day].grades.items():
        for title in ASSIGNMENTS:
            is_open = by_hand.is_open(student, title) or (student, title) in by_hand.excused
            for part in parts_of(title):
                points = None if is_open or not by_hand.is_graded(student) else by_hand.earned(student, part)
                shown = "" if points is None else f"{float(points / (2 if part == 'total' else 1)):g}"
                assert row[QUESTION[part]] == shown, (student, part)


@pytest.mark.parametrize("day", DAYS)
def test_marks_json_has_only_what_was_given_back(term, day):
    by_hand = ByHand(day)
    shown = by_hand.published or set(ASSIGNMENTS)
    parts = {part for title in shown for part in parts_of(title)}
    for student, data in term[day].data.items():
        assert bool(data) == by_hand.is_graded(student)
        if not data:
            continue
        assert {mark["part"] for mark in data["marks"]} - {"unit"} == parts, student
        assert ("load" in parts and not by_hand.mended and "load" in by_hand.answers(student)) == any(
            "3.1, load is not marked" in problem for problem in data["problems"]
        )
        earned, out_of = by_hand.so_far(student, shown)
        assert data["account"]["earned"] == float(rounded(earned)), student
        assert data["account"]["out_of"] == out_of, student
        for entry in data["account"]["assignments"]:
            title = entry["title"]
            assert entry["points"] == (by_hand.column(student, title) if title in shown else ""), (student, title)
            assert entry["state"] == by_hand.states(student)[title], (student, title)
            assert bool(entry["excused"]) == ((student, title) in by_hand.excused), (student, title)
            late = max(by_hand.days_late(student, name) for name in ASSIGNMENTS[title][0])
            assert (entry["days_late"], entry["out_of"]) == (late, ASSIGNMENTS[title][1]), (student, title)


@pytest.mark.parametrize("day", DAYS)
def test_a_students_page_begins_with_what_counts_and_has_a_line_for_each_assignment(term, day):
    by_hand = ByHand(day)
    shown = by_hand.published or set(ASSIGNMENTS)
    for student in filter(by_hand.is_graded, CLASS):
        (first, lines), (earned, out_of) = term[day].pages[student], by_hand.so_far(student, shown)
        so_far = f"So far {rounded(earned)} of {out_of} points." if out_of else "Nothing is due yet."
        assert so_far in first, student
        for (title, (_names, most)), line in zip(ASSIGNMENTS.items(), lines, strict=True):
            points = by_hand.column(student, title) if title in shown else ""
            points = "" if (student, title) in by_hand.excused else f"{points} of {most}".strip()
            assert (line[0], line[2]) == (title, points), student
            assert line[1].startswith(by_hand.label(student, title)), (student, title)


#: Tasks that are not about the state of somebody's work, by how they begin → on which days, and who.
OTHER_TASKS = {
    "a request to look again at 1.2 why": {3: {"s4"}, 4: {"s4"}},
    "marks of Lab A moved": {4: {"s3", "s5"}, 5: {"s2", "s3", "s4", "s5", "s8"}},
    "a newer file is empty": {4: {"s6"}},
    "Lab A: a version came after you gave it back": {4: {"s2"}, 5: {"s2"}, 6: {"s2"}},
}


@pytest.mark.parametrize("day", DAYS)
def test_the_class_page_lists_what_a_person_must_do_with_its_worth_and_nothing_else(term, day):
    expected, found = ByHand(day).to_do(), term[day].to_do
    for beginning, (who, worth) in expected.items():
        (task,) = (what for what in found if what.startswith(beginning))
        assert found.pop(task) == (who, worth), task
    for beginning, days in OTHER_TASKS.items():
        those = [what for what in found if what.startswith(beginning)]
        assert [found.pop(what)[0] for what in those] == [days[number] for number in days if number == day], beginning
    assert not found


@pytest.mark.parametrize("platform", ["Canvas", "Moodle"])
@pytest.mark.parametrize("day", DAYS)
def test_a_platforms_column_has_what_is_decided_and_nothing_else(term, day, platform):
    by_hand = ByHand(day)
    for title in ASSIGNMENTS:
        column = term[day].exported[platform, title]
        for student, cell in column.items():
            if platform == "Canvas" and (student, title) in by_hand.excused:
                assert cell == "EX", (student, title)
                continue
            out_of = 30 if (platform, title) == ("Canvas", "Lab B") else ASSIGNMENTS[title][1]
            points = by_hand.column(student, title, out_of)
            expected = f"{float(points):g}" if points else {"Canvas": "", "Moodle": "-"}[platform]
            assert cell == expected, (student, title)


#: Day → assignment that was given back before → on which day last.
GIVEN_BACK = {5: {"Lab A": 3}, 6: {"Lab A": 3, "Lab B": 5}}


@pytest.mark.parametrize("day", GIVEN_BACK)
def test_publish_lists_the_marks_that_moved_since_they_were_given_back(term, day):
    now = ByHand(day)
    moved = {}
    for title, before in GIVEN_BACK[day].items():
        then = ByHand(before)
        for student in CLASS:
            for part in parts_of(title):
                points = now.earned(student, part)
                if points != then.earned(student, part) and (student, title) not in now.excused:
                    moved[student, part] = "not decided" if points is None else f"{float(points):g}"
    lines = re.findall(r"tell (\w+): (.*)", term[day].published)
    listed = {(who, part): after for who, line in lines for part, after in re.findall(r"(\w+): [^,]*→ ([^ ,]+)", line)}
    assert moved.items() <= listed.items()
    # Of who had nothing when it was given back, all marks are new.
    assert {where for where in listed if where[1] != "unit" and where[0] != "s8"} <= moved.keys()
