"""Who gets which answers next, what they give, and what they take back."""

from dataclasses import replace

import pytest
from gradebooks import graded, mark, prose, record, report_text
from scoring_class import COMPARED, LEVELS, RUBRIC, WORDS, desk, fill, texts

from labcourse.grading.gradebook import Gradebook
from labcourse.grading.outcomes import Judged, evidence
from labcourse.grading.scoring.desk import MOST_AT_ONCE, Pick, key_of, seen, state, tally
from labcourse.grading.settings import LevelSettings

EQUAL = ["It bends, for there is friction in the joint.", "it  bends for there is friction in the joint"]
PDF = f"[PDF: report.pdf, SHA-256 {64 * '0'}]"  # of two students the same file


def desk_of(book, answers):
    fill(book, answers)
    return desk(book)


def picks(answers):
    return [Pick(key_of(one.student, one.where), seen(one)) for one in answers]


def scored(made, actor):
    read = []
    while answers := made.next(actor, WORDS):
        made.give(actor, WORDS, picks(answers), level=3)
        read += [one.student for one in answers]
    return read


def test_each_answer_comes_once_to_two_who_read_at_once_and_in_another_order_for_each_part(book):
    students = fill(book, [*texts(16), *EQUAL, *EQUAL])
    made = desk(book)
    one, other = ([answer.student for answer in made.due(where)] for where in (WORDS, COMPARED))
    assert students != one != other != students
    read = []
    while any(both := {name: made.next(name, WORDS) for name in ("Ann", "Bea")}.values()):
        read += [answer.student for answers in both for answer in answers]
        for name, answers in zip(("Ann", "Bea"), both, strict=True):
            assert made.give(name, WORDS, picks(answers), level=2).problems == []
    assert sorted(read) == students


def test_equal_answers_come_together_and_each_is_scored(book):
    made = desk_of(book, [*texts(4), *EQUAL])
    cards = []
    while answers := made.next("Ann", WORDS):
        cards.append(answers)
        made.give("Ann", WORDS, picks(answers), level=4)
    (group,) = [answers for answers in cards if len(answers) > 1]
    written = [act.student for act in book.scores.acts() if act.given in EQUAL]
    assert written == [one.student for one in reversed(group)]  # the one that is claimed stands for all, to the last
    assert {one.mark.given for one in group} == set(EQUAL)
    assert (len(cards), len(book.scores.acts())) == (5, 6)


@pytest.mark.parametrize(
    ("one", "other"),
    [
        ("It is stable", "It is not stable"),
        ("ω² / K", "ω₂ / K"),
        ("at 2 mA", "at 2 MA"),
        ("y' = K", "y'' = K"),
        ("(K + m)/J", "K + m/J"),
        ("See ![plot](attachment:a.png)", "See ![plot](attachment:a.png)"),
        pytest.param(PDF, PDF, id="PDF"),
    ],
)
def test_answers_that_differ_in_a_sign_or_have_a_picture_or_a_pdf_are_read_alone(book, one, other):
    assert len(desk_of(book, [one, other]).next("Ann", WORDS)) == 1


def test_answers_of_an_excused_student_come_to_nobody(book):
    made = desk_of(book, texts(3))
    book.excuse("student-001", ["02_finding_stiffness"], reason="ill", actor="lea")
    assert sorted(scored(made, "Ann")) == ["student-000", "student-002"]
    assert tally(made.answers([WORDS])).total == 2 and len(made.due(COMPARED)) == 3
    assert made.part_after(COMPARED) is None
    book.excuse("student-001", ["02_finding_stiffness"], reason="well again", actor="lea", excused=False)
    assert made.part_after(COMPARED) == WORDS and scored(made, "Ann") == ["student-001"]


def test_more_than_fit_on_a_page_come_on_the_next_and_what_was_unticked_comes_again(book):
    made = desk_of(book, [EQUAL[0]] * (MOST_AT_ONCE + 3))
    first = made.next("Ann", WORDS)
    assert len(first) == MOST_AT_ONCE
    made.give("Ann", WORDS, picks(first[:-1]), level=4)
    assert first[-1].student in [one.student for one in made.next("Ann", WORDS)]
    assert len(made.next("Ann", WORDS)) == 4


def test_an_answer_that_was_skipped_comes_at_the_end(book):
    made = desk_of(book, texts(5))
    (first,) = made.next("Ann", WORDS)
    made.put_off("Ann", key_of(first.student, WORDS))
    read = scored(made, "Ann")
    assert (read[-1], len(read)) == (first.student, 5)


def test_an_answer_has_a_number_in_place_of_a_name(book):
    students = fill(book, texts(9))
    hidden, open_ = desk(book), desk(book, names=True)
    numbers = [[hidden.label(student, where) for student in students] for where in (WORDS, COMPARED)]
    assert set(numbers[0]) == {f"Answer {n}" for n in range(1, 10)}
    assert numbers[0] != numbers[1]  # a student is not known again by their number
    assert open_.label("student-003", WORDS) == "student-003"


@pytest.mark.parametrize(("share", "level"), [(0.667, 3), (0.5625, 2), (0.9, 4), (0.6, 3)])
def test_a_level_is_the_same_level_where_its_points_are_judged(tmp_path, share, level):
    """Where the course's threshold is the level's share, nothing of it may be lost by rounding."""
    for out_of in (0.05, 1.5, 1.6, 1.95, 2.0, 3.0):
        with Gradebook(tmp_path / f"{out_of}.sqlite") as book:
            record(book, graded("ada", mark(), replace(prose(), out_of=out_of)))
            made = desk(book)
            made.levels = LevelSettings({**LEVELS.shares, level: share}, {**LEVELS.thresholds, level: share})
            (act,) = made.give("Ann", WORDS, picks(made.next("Ann", WORDS)), level=level).acts
            (now,) = book.scores.answers([WORDS])
        assert made.levels.level_of(evidence([Judged("A", now.mark)]).share) == level
        assert len(str(act.points)) < 9  # and not 0.8999999999999999, for feedback writes points in full


def test_points_by_a_key_alone_have_the_level_as_their_reason_and_are_still_without_a_remark(book):
    made = desk_of(book, texts(3))
    rubrics, typed = f"Level 3: {RUBRIC[WORDS].level_3}", "In which direction?"
    for level, remark, reason in ((2, typed, typed), (0, "", "Level 0."), (3, "", rubrics)):
        (answer,) = made.next("Ann", WORDS)
        made.give("Ann", WORDS, picks([answer]), level=level, remark=remark)
        (now,) = (one for one in book.scores.answers([WORDS]) if one.student == answer.student)
        assert (now.mark.reason, now.remark, now.decision) == (reason, remark, now.last())
    book.set_mark(now.student, *WORDS, 0.75, reason="As I see it.", actor="Ann")  # the same points, by the same person
    assert made.undo("Ann").problems and [act.level for act in made.undo("Ann").acts] == [0]


def test_a_mark_by_hand_is_the_mark_and_not_the_level_or_the_question_before_it(book):
    made = desk_of(book, texts(1))
    shown = picks(made.next("Ann", WORDS))
    made.give("Ann", WORDS, shown, level=3)
    (answer,) = book.scores.answers([WORDS])
    assert answer.decision == answer.last() and state(answer).startswith("Ann gave it level 3, 0.75 of 1 point at")
    made.ask("Ann", WORDS, picks([answer]), "Is it?")
    (answer,) = book.scores.answers([WORDS])
    assert state(answer).startswith("Ann asked")
    found = tally([answer])
    assert (found.total, found.done, found.waiting, found.referred) == (1, 0, 0, 1)
    book.set_mark("student-000", *WORDS, 0.2, reason="copied", actor="Prof")
    (answer,) = book.scores.answers([WORDS])
    assert answer.decision is None
    assert state(answer).startswith("Prof gave it 0.2 of 1 point at") and state(answer).endswith("UTC: “copied”")
    assert "Prof gave it 0.2 of 1 point" in made.give("Bea", WORDS, shown, level=4).problems[0]
    found = tally([answer])
    assert (found.done, found.other, sum(found.levels.values())) == (1, 1, 0)


def test_who_is_a_moment_too_late_replaces_nothing_either(book, monkeypatch):
    """Between what is looked at and what is written somebody else decides: only the gradebook sees that."""
    made = desk_of(book, texts(1))
    shown = picks(made.next("Ann", WORDS))
    give = book.scores.give

    def after_bea(student, where, points, actor, **more):
        give(student, where, 0.25, "Bea", level=1)
        return give(student, where, points, actor, **more)

    monkeypatch.setattr(book.scores, "give", after_bea)
    done = made.give("Ann", WORDS, shown, level=4)
    assert done.acts == []
    assert "Bea gave it level 1" in done.problems[0]
    assert book.scores.answers([WORDS])[0].mark.points == 0.25


def test_another_answer_than_was_read_is_not_scored(book):
    made = desk_of(book, texts(1))
    shown = picks(made.next("Ann", WORDS))
    record(book, graded("student-000", mark(), prose(given="Quite another."), report_text(), submission="second"))
    assert made.give("Ann", WORDS, shown, level=4).acts == []
    record(book, graded("student-000", mark(), prose("missing", given=""), report_text(), submission="third"))
    (problem,) = made.give("Ann", WORDS, shown, level=4).problems
    assert "has 0 of 1 point now (missing)" in problem


def test_undo_takes_back_what_was_done_in_one_go_and_before_it_one_by_one(book):
    made = desk_of(book, [*texts(2), *EQUAL])
    cards = []
    while answers := made.next("Ann", WORDS):
        cards.append([one.student for one in answers])
        made.give("Ann", WORDS, picks(answers), level=4)
    for card in reversed(cards):
        assert {act.student for act in made.undo("Ann").acts} == set(card)
    assert all(one.waiting for one in book.scores.answers([WORDS]))
    assert made.undo("Ann").problems == ["There is nothing of yours to undo."]


def test_undo_goes_on_behind_what_another_decided_since(book):
    made = desk_of(book, texts(2))
    (first,) = made.next("Ann", WORDS)
    made.give("Ann", WORDS, picks([first]), level=4)
    (other,) = made.next("Ann", WORDS)
    made.ask("Ann", WORDS, picks([other]), "Is it?")
    (asked,) = [one for one in book.scores.answers([WORDS]) if one.referred]
    (theirs,) = made.give("Prof", WORDS, picks([asked]), level=2).acts
    assert "Prof gave it level 2" in made.undo("Ann").problems[0]
    done = made.undo("Ann")
    assert [act.student for act in done.acts] == [first.student] and done.problems == []
    assert made.undo("Ann").problems == ["There is nothing of yours to undo."]
    book.scores.undo(theirs.number, "Prof")  # and so it is as Ann left it
    assert [act.student for act in made.undo("Ann").acts] == [other.student]


def test_remarks_are_the_rubrics_first_and_then_those_that_are_written_most_and_not_taken_back(book):
    made = desk_of(book, texts(6))
    for remark in ("Rare.", "Often.\nShow it in your own recording.", "Often.", "Often.", "Rare too.", "A slpi."):
        made.give("Ann", WORDS, picks(made.next("Ann", WORDS)), level=2, remark=remark)
    made.undo("Ann")
    assert list(made.remarks(WORDS).values()) == [*RUBRIC[WORDS].remarks, "Often.", "Rare too.", "Rare."]
    assert "".join(made.remarks(WORDS)) == "abcde"
