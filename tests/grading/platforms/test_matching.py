"""Whose row is whose: by ID, login or e-mail; nobody is guessed."""

from dataclasses import replace

import pytest
from their_exports import BRIGHTSPACE, CANVAS, FILES, WORKSHEET

from labcourse.grading.gradebook import StudentRecord
from labcourse.grading.platforms import matching, rules
from labcourse.grading.platforms.their_file import read

CLASS = (
    StudentRecord("s1001", "Ada Lovelace", "ada@x.org", aliases=("alovelace", "71", "Participant 501")),
    StudentRecord("s1002", "Bob O'Neil", "bob@x.org", aliases=("boneil", "72", "Participant 502")),
    StudentRecord("s1003", "Cleo Ünal", "cleo@x.org", aliases=("cunal", "73", "Participant 503")),
    StudentRecord("s1004", "Eve Eden", "eve@x.org", aliases=("eeden", "74", "Participant 504")),
)


def match(content, *students):
    found = rules.recognised(read(content if isinstance(content, bytes) else content.encode()))
    matches = matching.match(found, students or CLASS)
    return found, matches


def by_line(found, matches):
    return {found.table.line(row): one.student for row, one in matches.found.items()}


@pytest.mark.parametrize(
    ("platform", "lines", "unknown", "missing"),
    [
        ("Canvas", {4: "s1001", 5: "s1002", 6: "s1003", 7: "s1004"}, 1, []),
        ("Moodle", {2: "s1001", 4: "s1002", 5: "s1003"}, 1, ["s1004"]),
        ("Moodle's grading worksheet", {2: "s1001", 3: "s1002", 4: "s1003", 5: "s1004"}, 0, []),
        ("Blackboard", {2: "s1001", 3: "s1002", 4: "s1003", 5: "s1004"}, 0, []),
        ("Brightspace", {2: "s1001", 3: "s1002", 4: "s1003"}, 1, ["s1004"]),
    ],
)
def test_students_are_found_and_who_is_not_is_known(platform, lines, unknown, missing):
    found, matches = match(FILES[platform])
    assert by_line(found, matches) == lines
    assert len(matches.unknown) == unknown and not matches.refused
    assert [one.student for one in matches.missing] == missing


def test_each_thing_that_a_student_is_known_by_finds_them_alone():
    for known in (
        {"student": "S1001"},
        {"student": "x", "email": "ADA@x.org"},
        {"student": "x", "aliases": ("alovelace",)},
    ):
        one = StudentRecord(**known)
        _, canvas = match(CANVAS, one)
        _, brightspace = match(BRIGHTSPACE, one)
        assert list(brightspace.found.values()) == [one]
        assert list(canvas.found.values()) == ([] if one.email else [one])  # Canvas's file has no e-mail


def test_a_name_finds_nobody():
    _, matches = match(CANVAS, StudentRecord("x", "Ada Lovelace"))
    assert not matches.found and len(matches.unknown) == 5 and len(matches.missing) == 1


def test_what_may_be_one_or_another_is_refused_and_said():
    both = (CLASS[0], replace(CLASS[1], aliases=("alovelace",)))
    found, matches = match(CANVAS, *both)
    ((row, why),) = matches.refused.items()
    assert found.table.line(row) == 4 and not matches.missing
    assert why == "it may be one or another: SIS User ID is that of s1001; SIS Login ID is that of s1001, s1002."
    assert by_line(found, matches) == {5: "s1002"}


def test_two_lines_of_one_student_are_both_refused():
    twice = WORKSHEET + '"Participant 900","Ada L.",ada@x.org,,,50.00,Yes,-,-,\n'
    found, matches = match(twice)
    assert set(matches.refused.values()) == {"several lines lead to 's1001'."}
    assert [found.table.line(row) for row in matches.refused] == [2, 6] and "s1001" not in by_line(
        found, matches
    ).values()


def test_a_number_of_canvass_own_that_is_by_chance_anothers_id_is_not_taken():
    by_chance = StudentRecord("71", "Otto Other")
    found, matches = match(CANVAS, by_chance)
    assert not matches.found and "who has another name" in next(iter(matches.refused.values()))
    found, matches = match(CANVAS, by_chance, CLASS[0])  # and where the ID leads to somebody, it does not count at all
    assert by_line(found, matches) == {4: "s1001"}
    found, matches = match(CANVAS, StudentRecord("71", "A. Lovelace"))
    assert by_line(found, matches) == {4: "71"}


@pytest.mark.parametrize("platform", ["Moodle", "Brightspace"])
def test_a_participants_number_hides_no_other_students_id(platform):
    both = (StudentRecord("x", "Xenia Xu", aliases=("Participant 1001",)), StudentRecord("1001", "Ada Lovelace"))
    found, matches = match(FILES[platform].replace(b"s1001", b"1001"), *both)
    assert by_line(found, matches) == {2: "1001"} and not matches.refused


def test_where_marking_is_blind_moodles_number_is_all_there_is():
    blind = "\n".join(
        ",".join(cell for place, cell in enumerate(line.split(",")) if place not in (1, 2))
        for line in ("Identifier,Full name,Email address,Status,Grade,Maximum Grade", "Participant 501,,,,,50.00")
    )
    found, matches = match(blind)
    assert by_line(found, matches) == {2: "s1001"}
