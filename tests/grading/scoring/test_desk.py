"""Who gets which answers next, what they give, and what they take back."""

from dataclasses import replace

import pytest
from gradebooks import graded, mark, prose, record, report_text
from scoring_class import COMPARED, LEVELS, WORDS, desk, fill, texts

from labcourse.grading.gradebook import Gradebook
from labcourse.grading.outcomes.levels import Judged, evidence
from labcourse.grading.scoring import progress, remarks
from labcourse.grading.scoring.desk import MOST_TOGETHER, Pick, key_of, seen, state
from labcourse.grading.settings import LevelSettings

ALIKE = ["It bends, for there is friction in the joint.", "It bends for there is friction in the joint"]


def desk_of(book, answers):
    fill(book, answers)
    return desk(book)


def picks(answers):
    return [Pick(key_of(one.student, one.where), seen(one)) for one in answers]


def scored(made, actor, count=1000, level=3):
    read = []
    while len(read) < count and (answers := made.next(actor, WORDS)):
        made.give(actor, WORDS, picks(answers), level=level)
        read += [one.student for one in answers]
    return read


def test_each_answer_comes_once_and_in_another_order_for_each_part(book):
    students = fill(book, texts(20))
    made = desk(book)
    one, other = ([answer.student for answer in made.due(where)] for where in (WORDS, COMPARED))
    assert scored(made, "Ann") == one
    assert sorted(one) == students
    assert one != students != other != one


def test_two_who_read_at_once_never_have_the_same(book):
    students = fill(book, [*texts(12), *ALIKE, *ALIKE])
    made = desk(book)
    read = []
    while True:
        both = {name: made.next(name, WORDS) for name in ("Ann", "Bea")}
        ours, theirs = ({one.student for one in answers} for answers in both.values())
        assert not ours & theirs
        read += [*ours, *theirs]
        if not read or not (ours | theirs):
            break
        for name, answers in both.items():
            if answers:
                assert made.give(name, WORDS, picks(answers), level=2).problems == []
    assert sorted(read) == students


def test_what_is_nearly_the_same_comes_together_and_is_scored_one_by_one(book):
    made = desk_of(book, [*texts(4), *ALIKE])
    cards = []
    while answers := made.next("Ann", WORDS):
        cards.append(answers)
        made.give("Ann", WORDS, picks(answers), level=4)
    (group,) = [answers for answers in cards if len(answers) > 1]
    written = [act.student for act in book.scores.acts() if act.given in ALIKE]
    assert written == [one.student for one in reversed(group)]  # the one that is claimed stands for all, to the last
    assert {one.mark.given for one in group} == set(ALIKE)
    assert len(cards) == 5
    assert len(book.scores.acts()) == 6  # each its own


def test_more_than_fit_on_a_page_come_on_the_next(book):
    made = desk_of(book, [ALIKE[0]] * (MOST_TOGETHER + 3))
    first = made.next("Ann", WORDS)
    assert len(first) == MOST_TOGETHER
    made.give("Ann", WORDS, picks(first), level=4)
    assert len(made.next("Ann", WORDS)) == 3


def test_an_answer_with_a_picture_is_read_alone(book):
    fill(book, [f"{ALIKE[0]} ![plot](attachment:a.png)"] * 3)
    assert len(desk(book).next("Ann", WORDS)) == 1


def test_what_was_unticked_comes_again(book):
    made = desk_of(book, ALIKE)
    both = made.next("Ann", WORDS)
    made.give("Ann", WORDS, picks(both[:1]), level=4)
    assert [one.student for one in made.next("Ann", WORDS)] == [both[1].student]


def test_what_was_skipped_comes_at_the_end(book):
    made = desk_of(book, texts(5))
    (first,) = made.next("Ann", WORDS)
    made.put_off("Ann", WORDS, key_of(first.student, WORDS))
    read = scored(made, "Ann")
    assert read[-1] == first.student
    assert len(read) == 5


def test_an_answer_has_a_number_in_place_of_a_name(book):
    students = fill(book, texts(9))
    hidden, open_ = desk(book), desk(book, names=True)
    labels = {hidden.label(student, WORDS) for student in students}
    assert labels == {f"Answer {n}" for n in range(1, 10)}
    assert open_.label("student-003", WORDS) == "student-003"
    numbers = [
        [made.label(student, where) for student in students] for made, where in ((hidden, WORDS), (hidden, COMPARED))
    ]
    assert numbers[0] != numbers[1]  # a student is not known again by their number


def test_a_level_is_worth_its_share_of_the_points(book):
    made = desk_of(book, texts(1))
    for where, worth in ((WORDS, 0.75), (COMPARED, 1.5)):
        answers = made.next("Ann", where)
        (act,) = made.give("Ann", where, picks(answers), level=3, remark="Well.").acts
        assert (act.level, act.points, act.remark) == (3, worth, "Well.")
        assert book.scores.answers([where])[0].mark.points == worth


@pytest.mark.parametrize(("share", "level"), [(0.667, 3), (0.5625, 2), (0.9, 4), (0.6, 3)])
@pytest.mark.parametrize("out_of", [0.05, 1.5, 1.6, 1.95, 2.0, 3.0])
def test_a_level_is_the_same_level_where_its_points_are_judged(tmp_path, share, level, out_of):
    """Where the course's threshold is the level's share, nothing of it may be lost by rounding."""
    with Gradebook(tmp_path / "class.sqlite") as book:
        record(book, graded("ada", mark(), replace(prose(), out_of=out_of)))
        made = desk(book)
        made.levels = LevelSettings({**LEVELS.shares, level: share}, {**LEVELS.thresholds, level: share})
        (answer,) = made.next("Ann", WORDS)
        (act,) = made.give("Ann", WORDS, picks([answer]), level=level).acts
        (now,) = book.scores.answers([WORDS])
        assert made.levels.level_of(evidence([Judged("A", now.mark)]).share) == level
        assert len(str(act.points)) < 9  # and not 0.8999999999999999, for feedback writes points in full


def test_a_mark_by_hand_is_the_mark_and_not_the_level_before_it(book):
    made = desk_of(book, texts(1))
    shown = picks(made.next("Ann", WORDS))
    made.give("Ann", WORDS, shown, level=3)
    (answer,) = book.scores.answers([WORDS])
    assert answer.decision == answer.last() and state(answer).startswith("Ann gave it level 3, 0.75 of 1 point at")
    book.set_mark("student-000", *WORDS, 0.2, "copied", "Prof")
    (answer,) = book.scores.answers([WORDS])
    assert answer.decision is None
    assert state(answer).startswith("Prof gave it 0.2 of 1 point at") and state(answer).endswith("UTC: “copied”")
    assert "Prof gave it 0.2 of 1 point" in made.give("Bea", WORDS, shown, level=4).problems[0]
    found = progress.tally([answer])
    assert (found.done, found.other, sum(found.levels.values())) == (1, 1, 0)


def test_a_mark_by_hand_decides_what_was_asked(book):
    made = desk_of(book, texts(1))
    made.ask("Ann", WORDS, picks(made.next("Ann", WORDS)), "Is it?")
    assert state(book.scores.answers([WORDS])[0]).startswith("Ann asked")
    book.set_mark("student-000", *WORDS, 0.2, "It is not.", "Prof")
    assert state(book.scores.answers([WORDS])[0]).startswith("Prof gave")


def test_who_gives_the_same_by_hand_has_given_it(book):
    made = desk_of(book, texts(1))
    made.give("Ann", WORDS, picks(made.next("Ann", WORDS)), level=3, remark="Well.")
    book.set_mark("student-000", *WORDS, 0.2, "copied", "Prof")
    book.set_mark("student-000", *WORDS, 0.75, "Well.", "Prof")
    assert book.scores.answers([WORDS])[0].decision is None


def test_what_another_decided_since_is_not_replaced_and_told(book):
    made = desk_of(book, texts(1))
    answers = made.next("Ann", WORDS)
    shown = picks(answers)
    made.give("Bea", WORDS, shown, level=1)
    done = made.give("Ann", WORDS, shown, level=4)
    assert done.acts == []
    (problem,) = done.problems
    assert "Bea gave it level 1, 0.25 of 1 point at" in problem
    assert "Nothing of yours was written" in problem
    assert "student-000" not in problem
    assert book.scores.answers([WORDS])[0].mark.points == 0.25


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
    assert "left blank" in problem


def test_who_asks_the_instructor_leaves_the_answer_waiting_and_out_of_the_queue(book):
    made = desk_of(book, texts(2))
    answers = made.next("Ann", WORDS)
    made.ask("Ann", WORDS, picks(answers), "Is this a cause?")
    assert len(scored(made, "Bea")) == 1
    (asked,) = [one for one in book.scores.answers([WORDS]) if one.asked]
    assert asked.student == answers[0].student
    done = made.give("Prof", WORDS, picks([asked]), level=2)
    assert done.problems == []
    assert not any(one.waiting for one in book.scores.answers([WORDS]))


def test_undo_takes_back_what_was_done_in_one_go_and_before_it_one_by_one(book):
    made = desk_of(book, [*texts(2), *ALIKE])
    cards = []
    while answers := made.next("Ann", WORDS):
        cards.append([one.student for one in answers])
        made.give("Ann", WORDS, picks(answers), level=4)
    for card in reversed(cards):
        assert {act.student for act in made.undo("Ann").acts} == set(card)
    assert all(one.waiting for one in book.scores.answers([WORDS]))
    assert made.undo("Ann").problems == ["There is nothing of yours to take back."]


def test_undo_takes_back_nothing_that_another_decided_since(book):
    made = desk_of(book, texts(1))
    made.give("Ann", WORDS, picks(made.next("Ann", WORDS)), level=4)
    (now,) = book.scores.answers([WORDS])
    made.give("Bea", WORDS, picks([now]), level=1)
    done = made.undo("Ann")
    assert done.acts == []
    assert "Bea gave it level 1" in done.problems[0]
    assert book.scores.answers([WORDS])[0].mark.points == 0.25


def test_undo_goes_on_behind_what_another_decided_since(book):
    made = desk_of(book, texts(2))
    (first,) = made.next("Ann", WORDS)
    made.give("Ann", WORDS, picks([first]), level=4)
    (other,) = made.next("Ann", WORDS)
    made.ask("Ann", WORDS, picks([other]), "Is it?")
    (asked,) = [one for one in book.scores.answers([WORDS]) if one.asked]
    (theirs,) = made.give("Prof", WORDS, picks([asked]), level=2).acts
    assert "Prof gave it level 2" in made.undo("Ann").problems[0]
    done = made.undo("Ann")
    assert [act.student for act in done.acts] == [first.student] and done.problems == []
    assert made.undo("Ann").problems == ["There is nothing of yours to take back."]
    book.scores.undo(theirs.number, "Prof")  # and so it is as Ann left it
    assert [act.student for act in made.undo("Ann").acts] == [other.student]


def test_an_answer_that_another_holds_is_told_when_it_is_renewed(book):
    made = desk_of(book, texts(1))
    key = key_of("student-000", WORDS)
    assert made.next("Ann", WORDS)
    assert made.renew("Ann", WORDS, key) == ""
    assert "Ann is reading this one" in made.renew("Bea", WORDS, key)


def test_tallies_count_levels_points_without_one_and_what_waits(book):
    made = desk_of(book, texts(6))
    for more in ({"level": 4}, {"level": 4}, {"level": 0}, {"points": 0.3}):
        made.give("Ann", WORDS, picks(made.next("Ann", WORDS)), **more)
    made.ask("Ann", WORDS, picks(made.next("Ann", WORDS)))
    found = progress.tally(book.scores.answers([WORDS]))
    assert (found.total, found.done, found.waiting, found.asked, found.other) == (6, 4, 1, 1, 1)
    assert found.levels == {4: 2, 3: 0, 2: 0, 1: 0, 0: 1}


def test_remarks_are_the_rubrics_first_and_then_those_that_are_written_most(book):
    made = desk_of(book, texts(6))
    for remark in ("Rare.", "Often.\nShow it.", "Often.", "Often.", "Rare too."):
        made.give("Ann", WORDS, picks(made.next("Ann", WORDS)), level=2, remark=remark)
    found = remarks.used(("Of the rubric.", "Show it."), book.scores.acts(), WORDS)
    assert [text for _key, text in found] == ["Of the rubric.", "Show it.", "Often.", "Rare too.", "Rare."]
    assert [key for key, _text in found] == list("abcde")
    assert remarks.used((), book.scores.acts(), COMPARED) == []


def test_remarks_that_were_taken_back_are_not_used_again(book):
    made = desk(book)
    fill(book, texts(1))
    for remark in ("With a slpi.", "Without."):
        made.give("Ann", WORDS, picks(made.next("Ann", WORDS)), level=2, remark=remark)
        assert remarks.used((), book.scores.acts(), WORDS) == [("a", remark)]
        made.undo("Ann")
        assert remarks.used((), book.scores.acts(), WORDS) == []
