"""Scoring in a gradebook: levels, claims, asking, taking back; students' requests; on both databases."""

from concurrent.futures import ThreadPoolExecutor
from datetime import timedelta

import pytest
from gradebooks import graded, mark, prose, record, report_text
from hypothesis import given, settings
from hypothesis import strategies as st

from labcourse import clock
from labcourse.errors import GradebookError
from labcourse.grading.gradebook import Gradebook
from labcourse.grading.gradebook.store import NO_LONGER
from labcourse.grading.marks import Status

WORDS = ("2.11", "explanation")  # 1 point
COMPARED = ("2.16", "comparison")  # 2 points
NUMBER = ("2.11", "omega_n")
HOUR = 3600.0


@pytest.fixture
def class_of_three(book):
    record(book, *map(graded, ("ada", "bob", "eve")))
    return book


def mark_now(book, student, where):
    return {one.where: one for one in book.current(student).marks}[where]


def test_answers_are_those_that_a_person_reads_by_student_and_part(book):
    blank = prose(status="missing", given="")
    record(book, graded("bob"), graded("ada", mark(), blank, report_text()))
    found = [(one.student, one.where) for one in book.scores.answers()]
    assert found == [("ada", COMPARED), ("bob", WORDS), ("bob", COMPARED)]  # blank ones are done
    assert [one.student for one in book.scores.answers([WORDS])] == ["bob"]
    assert book.scores.answers([]) == []
    assert all(one.waiting and not one.referred and one.last() is None for one in book.scores.answers())


def test_answers_include_those_for_which_a_person_replaced_the_softwares_mark(class_of_three):
    class_of_three.set_mark("ada", *NUMBER, 1, reason="The unit was in the text.", actor="prof")
    (answer,) = class_of_three.scores.answers([NUMBER])
    assert (answer.student, answer.mark.points, answer.waiting) == ("ada", 1.0, False)


def test_a_level_becomes_the_mark_with_its_remark_and_a_line_in_the_audit_trail(class_of_three):
    before = clock.now()
    act = class_of_three.scores.give("ada", COMPARED, 1.5, "kim", level=3, remark="Say how much.")
    after = clock.now()
    now = mark_now(class_of_three, "ada", COMPARED)
    assert (now.status, now.points, now.reason) == (Status.BY_A_PERSON, 1.5, "Say how much.")
    line = class_of_three.audit("ada")[-1]
    assert (line.actor, line.after.points, line.reason) == ("kim", 1.5, "Say how much.")
    assert (act.level, act.points, act.out_of, act.given) == (3, 1.5, 2.0, "It was fine.")
    assert before <= act.when <= after
    answer = {one.student: one for one in class_of_three.scores.answers([COMPARED])}["ada"]
    assert not answer.waiting and answer.last() == act


def test_the_second_of_two_scorers_learns_who_was_first_and_changes_nothing(class_of_three):
    seen = mark_now(class_of_three, "ada", COMPARED)
    class_of_three.scores.give("ada", COMPARED, 2, "kim", level=4, expected=seen)
    for late in (
        lambda: class_of_three.scores.give("ada", COMPARED, 1, "lee", level=2, expected=seen),
        lambda: class_of_three.scores.ask("ada", COMPARED, "lee", expected=seen),
    ):
        with pytest.raises(GradebookError, match=r"2 points .*by now, from kim"):
            late()
    assert mark_now(class_of_three, "ada", COMPARED).points == 2
    assert len(class_of_three.scores.acts()) == 1


def test_an_answer_that_changed_since_it_was_read_is_not_scored(class_of_three):
    seen = mark_now(class_of_three, "ada", COMPARED)
    record(class_of_three, graded("ada", report_text(given="Another text."), submission="second"))
    with pytest.raises(GradebookError, match="Nothing was changed"):
        class_of_three.scores.give("ada", COMPARED, 2, "kim", expected=seen)


def test_a_score_holds_only_for_the_same_text_and_comes_back_with_it(class_of_three):
    class_of_three.scores.give("ada", COMPARED, 2, "kim", level=4)
    record(class_of_three, graded("ada", report_text(given="Another text."), submission="second"))
    (answer,) = [one for one in class_of_three.scores.answers([COMPARED]) if one.student == "ada"]
    assert answer.waiting and answer.acts == ()
    record(class_of_three, graded("ada", report_text(given="It was  fine. "), submission="third"))
    (answer,) = [one for one in class_of_three.scores.answers([COMPARED]) if one.student == "ada"]
    assert not answer.waiting and answer.last().level == 4


def test_an_answer_on_which_the_instructor_is_asked_waits_until_somebody_decides(class_of_three):
    class_of_three.scores.give("ada", COMPARED, 2, "kim", level=4)
    class_of_three.scores.ask("ada", COMPARED, "kim", remark="Is this a copy?")
    answer = class_of_three.scores.answers([COMPARED])[0]
    assert answer.referred and answer.waiting and answer.mark.status == Status.FOR_A_PERSON
    assert class_of_three.scores.claim(["ada"], COMPARED, "lee", HOUR) is None  # the instructor's, and nobody else's
    class_of_three.set_mark("ada", *COMPARED, 1, reason="No.", actor="prof")
    answer = class_of_three.scores.answers([COMPARED])[0]
    assert not answer.referred and not answer.waiting


def test_taking_an_act_back_restores_the_earlier_mark_and_stores_both_acts(class_of_three):
    class_of_three.set_mark("ada", *COMPARED, 0.5, reason="By hand.", actor="prof")
    first = class_of_three.scores.give("ada", COMPARED, 2, "kim", level=4)
    asked = class_of_three.scores.ask("ada", COMPARED, "kim")
    class_of_three.scores.undo(asked.number, "kim")
    assert mark_now(class_of_three, "ada", COMPARED).points == 2
    class_of_three.scores.undo(first.number, "kim")
    now = mark_now(class_of_three, "ada", COMPARED)
    assert (now.points, now.reason) == (0.5, "By hand.")
    assert [one.undoes for one in class_of_three.scores.acts()] == [None, None, asked.number, first.number]
    assert [one.after.points for one in class_of_three.audit("ada")][-5:] == [0.5, 2, 0, 2, 0.5]


def test_the_trail_of_what_a_scorer_asked_or_took_back_never_says_that_the_answer_changed(class_of_three):
    scores = class_of_three.scores
    scores.give("ada", COMPARED, 2, "kim", level=4)
    scores.undo(scores.ask("ada", COMPARED, "kim").number, "kim")
    scores.undo(scores.give("bob", COMPARED, 2, "kim", level=4).number, "kim")
    assert not [row.reason for row in class_of_three.audit() if NO_LONGER in row.reason]


def test_one_point_is_not_points_in_the_error_about_another_decision(class_of_three):
    seen = mark_now(class_of_three, "ada", COMPARED)
    class_of_three.scores.give("ada", COMPARED, 1, "kim")
    with pytest.raises(GradebookError, match=r"has 1 point \("):
        class_of_three.scores.give("ada", COMPARED, 2, "lee", expected=seen)


def test_scorers_take_back_only_their_own_acts_and_only_once(class_of_three):
    act = class_of_three.scores.give("ada", COMPARED, 2, "kim", level=4)
    for number, actor in ((act.number, "lee"), (act.number + 99, "kim")):
        with pytest.raises(GradebookError, match="has no act"):
            class_of_three.scores.undo(number, actor)
    undone = class_of_three.scores.undo(act.number, "kim")
    with pytest.raises(GradebookError, match="was taken back before"):
        class_of_three.scores.undo(act.number, "kim")
    with pytest.raises(GradebookError, match="has no act"):
        class_of_three.scores.undo(undone.number, "kim")


@settings(max_examples=12, deadline=None)
@given(st.lists(st.tuples(st.sampled_from(["give", "ask", "undo"]), st.integers(0, 4), st.booleans()), max_size=12))
def test_the_mark_always_follows_from_the_acts_that_were_not_taken_back(tmp_path_factory, steps):
    with Gradebook(tmp_path_factory.mktemp("scores") / "class.sqlite") as book:
        record(book, graded("ada"))
        stack: list[tuple[int, float | None]] = []
        for what, quarter, _ in steps:
            if what == "give":
                stack.append((book.scores.give("ada", COMPARED, quarter / 2, "kim").number, quarter / 2))
            elif what == "ask":
                stack.append((book.scores.ask("ada", COMPARED, "kim").number, None))
            elif stack:
                book.scores.undo(stack.pop()[0], "kim")
            now = mark_now(book, "ada", COMPARED)
            decided = stack[-1][1] if stack else None
            assert (now.status == Status.BY_A_PERSON) == (decided is not None)
            assert now.points == (decided or 0)


def test_two_scorers_never_get_the_same_answer(class_of_three):
    order = ["eve", "ADA", "bob"]
    assert class_of_three.scores.claim(order, WORDS, "kim", HOUR) == "eve"
    assert class_of_three.scores.claim(order, WORDS, "lee", HOUR) == "ada"
    held = class_of_three.scores.claimed(WORDS)
    assert {student: actor for student, (actor, _until) in held.items()} == {"eve": "kim", "ada": "lee"}
    assert class_of_three.scores.claim(order, WORDS, "pat", HOUR) == "bob"
    assert class_of_three.scores.claim(order, WORDS, "sam", HOUR) is None
    assert class_of_three.scores.claim(order, COMPARED, "sam", HOUR) == "eve"  # another part is another matter


def test_many_scorers_at_once_get_different_answers(book):
    names = [f"s{number}" for number in range(12)]
    record(book, *map(graded, names))
    with ThreadPoolExecutor(6) as threads:
        given = list(threads.map(lambda actor: book.scores.claim(names, WORDS, f"a{actor}", HOUR), range(12)))
    assert sorted(given) == sorted(names)


def test_a_claim_is_released_when_the_scorer_claims_another_answer_or_leaves(class_of_three):
    class_of_three.scores.claim(["ada"], WORDS, "kim", HOUR)
    assert class_of_three.scores.claim(["ada", "bob"], WORDS, "kim", HOUR) == "ada"  # their own is theirs again
    assert class_of_three.scores.claim(["bob"], WORDS, "kim", HOUR) == "bob"
    assert list(class_of_three.scores.claimed(WORDS)) == ["bob"]
    class_of_three.scores.let_go("kim")
    assert class_of_three.scores.claimed(WORDS) == {}
    class_of_three.scores.give("bob", WORDS, 1, "lee")
    assert class_of_three.scores.claim(["bob"], WORDS, "kim", HOUR) is None  # it is decided


def test_a_claim_runs_out(class_of_three, monkeypatch):
    class_of_three.scores.claim(["ada"], WORDS, "kim", 60)
    assert class_of_three.scores.claim(["ada"], WORDS, "lee", 60) is None
    later = clock.now() + timedelta(seconds=61)
    monkeypatch.setattr(clock, "now", lambda: later)
    assert class_of_three.scores.claimed(WORDS) == {}
    assert class_of_three.scores.claim(["ada"], WORDS, "lee", 60) == "ada"
    assert class_of_three.scores.claimed(WORDS) == {"ada": ("lee", later + timedelta(seconds=60))}
    assert class_of_three.scores.hold("ada", WORDS, "kim", 60) == "lee"


def test_an_opened_answer_is_held_in_any_state(class_of_three):
    scores = class_of_three.scores
    scores.ask("ada", WORDS, "kim")
    assert scores.claim(["ada"], WORDS, "kim", HOUR) is None  # asked: nobody is given it
    scores.claim(["bob"], WORDS, "lee", HOUR)
    assert scores.hold("ADA", WORDS, "lee", HOUR) is None
    assert {one: who for one, (who, _until) in scores.claimed(WORDS).items()} == {"ada": "lee"}
    assert scores.hold("ADA", WORDS, "kim", HOUR) == "lee"
    assert scores.hold("ada", WORDS, "lee", HOUR) is None  # their own is theirs again
    scores.let_go("lee")
    assert scores.hold("ada", WORDS, "kim", HOUR) is None


def asks(book):
    book.comment("ADA", " Please read the second paragraph.\r\n", "prof", *COMPARED, asks=True)


def waiting(book):
    return [(one.student, one.where, one.text) for one in book.comments() if one.is_open]


ASKED = [("ada", COMPARED, "Please read the second paragraph.")]


@pytest.mark.parametrize(
    "act, is_open",
    [
        (lambda book: book.set_mark("ada", *COMPARED, 1.5, reason="Read again.", actor="prof"), False),
        (lambda book: book.scores.give("ada", COMPARED, 1, "kim"), False),
        (lambda book: book.comment("ada", "It stays.", "prof", *COMPARED), False),
        (lambda book: book.set_mark("bob", *COMPARED, 1.5, reason="Another student's.", actor="prof"), True),
        (lambda book: book.set_mark("ada", *WORDS, 1, reason="Another part.", actor="prof"), True),
        (lambda book: book.comment("bob", "Another student's.", "prof", *COMPARED), True),
        (lambda book: book.comment("ada", "The whole question.", actor="prof", question=COMPARED[0]), True),
        (lambda book: book.scores.ask("ada", COMPARED, "kim"), True),
        (lambda book: record(book, graded("ada", mark(), report_text("right", 2.0))), True),
    ],
)
def test_a_request_is_open_until_a_person_marks_that_answer_or_comments_on_it(class_of_three, act, is_open):
    class_of_three.scores.give("ada", COMPARED, 1, "kim")
    class_of_three.comment("ada", "Before.", "prof", *COMPARED)
    asks(class_of_three)
    asks(class_of_three)
    act(class_of_three)
    assert waiting(class_of_three) == 2 * is_open * ASKED


def test_a_request_is_open_again_when_the_mark_that_answered_it_is_taken_back(class_of_three):
    give = class_of_three.scores.give
    give("ada", COMPARED, 1, "kim")
    asks(class_of_three)
    act = give("ada", COMPARED, 2, "kim")
    assert waiting(class_of_three) == []
    class_of_three.scores.undo(act.number, "kim")
    assert waiting(class_of_three) == ASKED


def test_empty_requests_and_those_on_unknown_answers_are_refused(class_of_three):
    for student, text, *where in (("ada", " \n", *COMPARED), ("ada", "Why?", "9.9", "x"), ("ada", "Why?", "2.11")):
        with pytest.raises(GradebookError, match=r"is empty: say what|no mark for question"):
            class_of_three.comment(student, text, "prof", *where, asks=True)
    assert class_of_three.comments() == []


def test_untrusted_text_is_cleaned(class_of_three):
    act = class_of_three.scores.give("ada", COMPARED, 1, "k\x00im", remark="a\x1b[31mb")
    assert (act.actor, act.remark) == ("k\\x00im", "a\\x1b[31mb")
    assert class_of_three.scores.undo(act.number, "k\x00im").undoes == act.number
