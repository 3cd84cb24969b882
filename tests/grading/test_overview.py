"""The class at a glance: what to do today, where the class is in the term, what changed; and how it looks."""

import random
import re
from collections import Counter
from dataclasses import replace
from datetime import UTC, datetime, timedelta

import pytest
from accessible import findings
from checkout import ROOT
from day_class import FIRST, HANDED_IN, NOW, SECOND, deliver, fill, graded, notebook, score, term
from gradebooks import enrol, mark, prose, record, report_text
from made_courses import OURS
from set_clock import set_clock

from labcourse import clock
from labcourse.grading import overview, todo
from labcourse.grading.gradebook import Delivery, Gradebook, MarkRecord
from labcourse.grading.graded_run import FAILED, Facts
from labcourse.grading.intake import Doubt
from labcourse.grading.reports import changes, intake_table
from labcourse.grading.reports.grades import Reports
from labcourse.grading.reports.result import without_numbers
from labcourse.grading.settings import (
    CourseSettings,
    Extension,
    FeedbackSettings,
    LateSettings,
    MarkSettings,
)
from labcourse.problems import Code, Problem

IN_02, IN_03 = f"{FIRST}.ipynb", f"{SECOND}.ipynb"


@pytest.fixture(autouse=True, scope="module")
def on_a_day_of_the_term():
    with pytest.MonkeyPatch.context() as patch:
        set_clock(patch, NOW)
        yield


@pytest.fixture(scope="module")
def day(tmp_path_factory):
    """A class on some day of the term: what is collected, and its page."""
    folder = tmp_path_factory.mktemp("day")
    with Gradebook(folder / "gradebook.sqlite") as book:
        fill(book, folder)
        score(book)
        book.publish("lea")
        found = overview.class_overview(book, term())
    return found, overview.as_page(found)


def worth(*notebooks):
    """The points of notebooks, by the catalogue."""
    return sum(one.points for one in OURS.catalogue.marked.values() if one.notebook in notebooks)


def tasks(book, course=None, folder=None):
    """What is to do: how it begins → who, points, and the command."""
    found = overview.class_overview(book, course or term(), folder)["todo"]
    return {one.what: (one.who, one.worth, one.command) for one in found}


def text(book, course=OURS):
    return " ".join(overview.as_text(overview.as_page(overview.class_overview(book, course))).split())


def dropping(*names, course=OURS):
    return replace(course, settings=replace(course.settings, marks=MarkSettings(drop=names)))


# --- what to do today -------------------------------------------------------------------------------------------------


def test_what_to_do_is_sorted_by_the_points_at_stake_each_with_its_command(day):
    found = [(one.what, one.who, one.worth, one.command.partition(" ")[2]) for one in day[0]["todo"]]
    excuse = 'excuse MARKS gus {} --reason "..." --by NAME'
    ask = "Ask for it, excuse them, or give an extension in course.toml."
    lab_02, lab_03, score_it = worth(FIRST), worth(SECOND), "score MARKS --by NAME"
    everybody, take_in = ("ada", "bob", "cleo", "dan", "fay"), "Take the roster in again, or rename the submission."
    fault = "2.12, K_s is not marked: the key failed. KeyError, key.py, line 5."
    answer = 'comment MARKS fay "TEXT" --question 2.12 --part K_s --by NAME'
    assert found == [
        (f"missing: Lab 03. {ask}", ("gus", "hal"), 2 * lab_03, excuse.format("'Lab 03'")),
        (f"missing: Lab 02. {ask}", ("gus",), lab_02, excuse.format("'Lab 02'")),
        ("handed in: not graded yet.", ("hal",), lab_02, "grade MARKS SUBMISSIONS"),
        ("waits for a person: answers of Lab 03.", everybody, 5 * 2, score_it),
        ("the run was stopped: it took too long.", ("eve",), 2 + 1 + 2, "grade MARKS SUBMISSIONS --deadline 1200"),
        (f"could not be graded: {fault} Mend the key.", ("eve",), 2, "regrade MARKS --question 2.12"),
        ("a scorer asks you to decide.", ("dan",), 1, score_it),
        ("waits for a person: answers of Lab 02.", ("fay",), 1, score_it),
        (f"not on the roster. {take_in}", ("hal",), None, "roster MARKS NAMES.csv"),
        ("a request to look again at 2.12 K_s.", ("fay",), 0, answer),
    ]
    shown = " ".join(overview.as_text(day[1]).split())
    assert "10 things to do." in shown and "5 students: ada, bob, cleo, …" in shown


MISSING = mark("missing", 0.0, given="")
GONE = "02_finding_stiffness.ipynb cannot be read: no JSON."


RUN = [  # what is wrong with a run as a whole, the reason of the mark, what to do, and the command
    ("The run took longer than 600 s and was stopped.", "", "the run was stopped: it took", "--deadline 1200"),
    ("A cell took longer than 60 s and was stopped.", "x stopped: it took longer than 60 s.", "a cell took", "120"),
]
CELLS = [  # the same of its other messages
    ("big.csv does not come along: too large.", "2.11 stopped: FileNotFoundError", "a cell needs a file", "grade"),
    ("Recorded at home and missing here: 2.11 omega_n; x.", "It was recorded at home; x.", "answers were", "mark"),
]
NAMED = [  # a message, what to do, the points if it says which, and the command
    (GONE, f"could not be graded: {GONE}", worth(FIRST), "grade"),
    (f"{GONE} The one that was handed in before it counts.", "an older file", worth(FIRST), "grade"),
    ("The submission cannot be read: a.zip: damaged.", "could not be graded: The sub", None, "grade"),
    ("x.ipynb in a is empty; the one that was handed in before it counts.", "a newer file", None, "grade"),
    ("2.11, explanation: it has 9 characters; shorten it.", "part of a text", 1, "mark"),
    ("Grading failed, which is not the student's fault: OSError", "the last grading failed", None, "grade"),
]


@pytest.mark.parametrize(
    ("ended", "problem", "reason", "what", "points", "command"),
    [
        *((line, "", reason, what, 2, command) for line, reason, what, command in RUN),
        *(("", line, reason, what, 2, command) for line, reason, what, command in CELLS),
        *(("", line, "", *rest) for line, *rest in NAMED),
    ],
)
def test_each_cause_is_to_do_with_what_it_cost_and_said_in_full(book, ended, problem, reason, what, points, command):
    deliver(book, "ada", {IN_02: notebook("a = 1")})
    cells = Facts(ended=(ended,) if ended else ()).as_json()
    problems = ("2.12 stopped: NameError.", *([problem] if problem else []))
    record(book, graded("ada", replace(MISSING, reason=reason), cells=cells, problems=problems))
    ((who, at_stake, how),) = [those for begins, those in tasks(book).items() if begins.startswith(what)]
    assert (who, at_stake) == (("ada",), points) and command in how
    ((_student, said),) = overview.class_overview(book, term())["details"]
    assert said == [ended or problem]


def test_what_stopped_and_cost_nothing_is_not_to_do(book):
    deliver(book, "ada", {IN_02: notebook("a = 1")})
    record(book, graded("ada", mark(), cells=Facts(ended=("The Python process died.",)).as_json()))
    assert not [what for what in tasks(book) if what.startswith("the run was stopped")]


def test_messages_that_are_looked_for_are_those_that_the_program_writes():
    sources = [*ROOT.glob("labcourse/**/*.py"), ROOT / "solutions" / "evidence.py"]
    written = " ".join(path.read_text(encoding="utf-8") for path in sources if path.name != "todo.py")
    written = written.replace("{self.place}", "where grading runs").replace("{ANSWERS_FILE}", "answers.json")
    texts = [text for cause in todo.CAUSES for text in re.split(r"\||: \.\* |^\.\w+ ", cause.line)]
    assert [text for text in texts if text.strip("^: ") not in written] == []


def test_a_failed_grading_waits_with_all_its_points_and_older_keys_marks_are_named(book):
    failed = replace(mark("not marked: key fault", 0.0, "Grading failed; ask your instructor."), part="omega_n")
    said = "Not graded. Grading failed, which is not the student's fault: OSError: full"
    one = graded("ada", failed, problems=(said,))
    record(book, replace(one, run=replace(one.run, key=f"{FAILED}ada")), graded("bob", mark(), key="of before"))
    found = tasks(book)
    grading = "could not be graded: Grading failed, which is not the student's fault: OSError: full"
    assert found[grading][:2] == (("ada",), 2)
    assert found["marks are of an older key, or of an older version."][::2] == (("bob",), "rotflex regrade MARKS")


def test_lapsed_marks_and_answers_that_the_key_could_not_compare_are_to_do_once(book):
    unsure = replace(mark("for a person", 0.0, "It could not be compared (x)."), part="omega_n")
    record(book, graded("ada", unsure, prose()), graded("bob", mark(), prose()))
    book.set_mark("ada", "2.11", "explanation", 1.0, "good", "tia")
    record(book, graded("ada", unsure, prose(given="Another."), submission="next"))
    found = tasks(book)
    by_hand = 'rotflex mark MARKS ada 2.11 {} POINTS --reason "..." --by NAME'
    lapsed = "a person's mark for 2.11 explanation lapsed, as the answer or its points changed."
    assert found[lapsed] == (("ada",), 1, by_hand.format("explanation"))
    compared = "waits for a person: 2.11 omega_n. It could not be compared (x)."
    assert found[compared] == (("ada",), 2, by_hand.format("omega_n"))
    assert found["waits for a person: answers of Lab 02."][:2] == (("bob",), 1)
    ((_ada, (said,)),) = overview.class_overview(book, term())["details"]
    assert "tia gave 1 of 1 points" in said


def test_unknown_times_names_and_owners_are_to_do(book, tmp_path):
    unknown = Delivery(IN_02, "d", notebook("a = 1"), HANDED_IN, "a zip", "")
    book.deliver("ada", [unknown])
    record(book, graded("ada", mark()))
    more = Extension(NOW, ("nobody",))
    course = term(late=LateSettings(per_day=10), extensions=(more,))
    abouts = (("a.zip", "owner", ""), ("b.zip", "owner", "ada"), ("ada", "time received", ""))
    doubts = [Doubt(*about, ("x",)) for about in abouts]
    intake_table.write(tmp_path / "intake.csv", doubts, {})
    found = tasks(book, course, tmp_path)
    when = "waits for a person: nobody knows when Lab 02 was handed in. Decide in MARKS/intake.csv."
    assert found[when] == (("ada",), worth(FIRST), "rotflex grade MARKS SUBMISSIONS")
    assert "course.toml has unknown students or sections in extensions: nobody. Correct it." in found
    assert "nobody knows who handed in a.zip, so that it is not graded. Decide it in MARKS/intake.csv." in found
    assert "not certain: b.zip (owner). Decide it in MARKS/intake.csv." in found
    assert not any("nobody knows when" in what for what in tasks(book))  # lateness costs nothing


def test_what_is_marked_is_to_be_given_back_and_what_moved_since_again(book):
    deliver(book, "ada", {IN_02: notebook("a = 1"), IN_03: notebook("a = 1")})
    record(book, graded("ada", mark(), report_text()))
    back = "marked: all of Lab 02, and not given back yet."
    assert tasks(book)[back] == ((), 0, "rotflex publish MARKS --assignment 'Lab 02' --by NAME")
    assert not any("all of Lab 03" in what for what in tasks(book))  # an answer waits
    book.publish("lea", notebooks=[FIRST])
    assert back not in tasks(book)
    book.set_mark("ada", "2.11", "omega_n", 0.5, "no", "tia")
    moved = tasks(book)["marks of Lab 02 moved since you gave them back."]
    assert moved == (("ada",), 1.5, "rotflex publish MARKS --assignment 'Lab 02' --by NAME")
    one, other, _later = sorted(overview.class_overview(book, term())["assignments"], key=lambda row: row["title"])
    assert one["given_back"] is not None and other["given_back"] is None


# --- the term ---------------------------------------------------------------------------------------------------------


def test_states_are_counted_by_assignment_and_said_by_student(day):
    found, page = day
    states = {one["title"]: (one["states"], one["out_of"]) for one in found["assignments"]}
    in_02 = Counter({"marked": 3, "waits for a person": 2, "could not be graded": 1, "missing": 1, "handed in": 1})
    in_03 = Counter({"marked": 1, "waits for a person": 5, "missing": 2})
    assert states["Lab 02"] == (in_02, worth(FIRST))
    assert states["Lab 03"] == (in_03, worth(SECOND))
    assert states["Later"][0] == {"not due": 8}
    shown = overview.as_text(page)
    assert "7 of 8 students handed something in." in shown and "Values were supplied for eve: 2.9.sweep." in shown
    assert re.search(r"ada \(Ada Lovelace\) +waits for a person: Lab 03 +5.00 of 7 +2026-03-02 12:00 UTC", shown)
    assert re.search(r"gus \(Gus Gray\) +missing: Lab 02, Lab 03 +0.00 of 23 +–", shown)


def test_numbers_are_those_of_an_independent_count(book, tmp_path):
    """Every part of the two labs, by chance right, missing or waiting, for a dozen students of whom some are late."""
    parts = {(q.number, p.name): (q.notebook, p) for q in OURS.catalogue.marked.values() for p in q.parts if p.points}
    drawn, rows, course = random.Random(3), [], term(late=LateSettings(grace_hours=1))
    enrol(book, tmp_path, *((f"s{n}", "", "", "") for n in range(12)))
    for n in range(12):
        made = []
        for (number, name), (where, part) in parts.items():
            if where in (FIRST, SECOND):
                status = drawn.choice(["right", "missing", "for a person" if part.marked == "person" else "wrong"])
                points = part.points if status == "right" else 0.0
                made.append(MarkRecord(number, name, status, points, part.points, "x", "y" * (status != "missing")))
        late = n % 4 == 0
        when = NOW - timedelta(hours=30 if late else 90)
        deliver(book, f"s{n}", {IN_02: notebook(f"a = {n}"), IN_03: notebook(f"b = {n}")}, when)
        record(book, graded(f"s{n}", *made))
        rows += [(f"s{n}", parts[one.where][0], one.status, one.points, one.out_of) for one in made]
    found = overview.class_overview(book, course)
    todo_now = {one.what: (one.who, one.worth) for one in found["todo"]}
    for title, name in (("Lab 02", FIRST), ("Lab 03", SECOND)):
        waits = [row for row in rows if row[1:3] == (name, "for a person")]
        who = {row[0] for row in waits}
        stake = todo_now[f"waits for a person: answers of {title}."]
        assert (set(stake[0]), stake[1]) == (who, sum(row[4] for row in waits))
        (row,) = [one for one in found["assignments"] if one["title"] == title]
        assert row["states"] == Counter({"waits for a person": len(who), "marked": 12 - len(who)}) and row["late"] == 3
    shown = {one.id: overview.so_far_text(one) for one in found["students"]}
    earned, possible = (
        {f"s{n}": sum(row[at] for row in rows if row[0] == f"s{n}") for n in range(12)} for at in (3, 4)
    )
    assert shown == {who: f"{earned[who]:.2f} of {possible[who]:g}" for who in earned}


def test_the_newest_version_says_when_and_a_partner_has_what_was_handed_in_for_both(book):
    deliver(book, "ada", {IN_02: notebook("a = 1")})
    deliver(book, "ada", {IN_02: notebook("a = 2")}, HANDED_IN + timedelta(days=1))
    for student in ("ada", "bob"):
        record(book, graded(student, cells=Facts(bench_of="ada").as_json()))
    there = {one.id: one for one in overview.class_overview(book, OURS)["students"]}
    assert [list(there[who].received) for who in ("ada", "bob")] == [[IN_02]] * 2
    assert there["ada"].last == "2026-03-03 12:00 UTC" and "has no roster" in text(book)


@pytest.mark.parametrize(("size", "is_told"), [(4, False), (5, True)])
def test_nobody_is_far_below_a_few_and_what_is_not_due_is_not_compared(book, size, is_told):
    later = MarkRecord("3.4", "poles", "wrong", 0.0, 50.0, "")
    for n in range(size):
        record(book, graded(f"s{n}", mark() if n else mark("wrong", 0.0), replace(later, points=50.0 * (n == 0))))
    found = overview.class_overview(book, term())["behind"]
    assert [(one.id, share, usual) for one, share, usual in found] == [("s0", 0, 1)] * is_told


# --- what is dropped --------------------------------------------------------------------------------------------------


def test_what_is_dropped_is_in_nothing_and_the_page_says_so_once(book, tmp_path):
    enrol(book, tmp_path, *((student, "", "", "") for student in "abcdef"))
    fault = "2.16, comparison is not marked: the key failed. key.py, line 3"
    for student in "abcdef":
        words = report_text("not marked: key fault") if student == "d" else report_text()
        record(book, graded(student, mark(), prose(), words, problems=(fault,) if student == "d" else ()))
        book.set_mark(student, "2.11", "explanation", 1.0, "ok", "tia")
    book.scores.ask("f", ("2.16", "comparison"), "tia", remark="What now?")
    before, after = (overview.class_overview(book, course) for course in (term(), dropping("2.16", course=term())))
    for what in ("waits for a person", "a scorer asks", "could not be graded"):
        assert [what in [one.what[: len(what)] for one in found["todo"]] for found in (before, after)] == [True, False]
    assert before["waiting"] and before["asked"] and not after["waiting"] and not after["asked"]
    line = "Left out, as course.toml drops it: 2.16. Requests and changed marks are still listed for it."
    assert overview.as_page(after).count(line) == text(book, dropping("2.16")).count(line) == 1
    assert "Left out" not in overview.as_page(before)


# --- answers and marks ------------------------------------------------------------------------------------------------


def test_what_waits_and_is_asked(day):
    found, page = day
    # Of four explanations two were scored, and one is asked of the instructor: it waits all the same.
    waiting = [(*one.where, len(one.answers), one.of) for one in found["waiting"]]
    assert waiting == [("2.11", "explanation", 2, 4), ("2.16", "comparison", 5, 5)]
    shown = " ".join(overview.as_text(page).split())
    assert "To be read: 7 answers, worth 12 points." in shown
    assert "2.16 comparison How good is the model? 5 5 10" in shown
    assert "dan 2.11 explanation tia" in shown and "Is <this> right?" in shown
    assert "1 request not answered yet." in shown and "fay 2.12 K_s 2" in shown and "Please look again." not in shown


def test_slips_are_counted_by_what_the_key_said_without_its_numbers(day):
    first, second = day[0]["slips"]
    assert (first.where, first.wrong, first.judged) == (("2.11", "omega_n"), 3, 5)
    assert first.reasons == [("It is … rad/s off; it looks like Hz.", 2), ("It is … rad/s off.", 1)]
    assert (second.where, second.wrong, second.judged) == (("2.12", "K_s"), 2, 5)
    assert without_numbers("K_2 of q3: -1.5e-3 at -3+4j, about 2·10⁻³ N·m") == "K_2 of q3: … at …+…, about … N·m"


@pytest.mark.parametrize(("wrong", "right", "is_told"), [(2, 8, True), (2, 9, False), (1, 0, False)])
def test_many_are_a_fifth_of_those_who_answered_and_two_at_least(wrong, right, is_told):
    those = [graded(f"w{n}", mark("wrong", 0.0)) for n in range(wrong)]
    those += [graded(f"r{n}", mark()) for n in range(right)]
    those += [graded(f"m{n}", mark("missing", 0.0), prose()) for n in range(5)]  # nobody whose answer was judged
    assert bool(overview.slips(those)) is is_told


def test_questions_that_the_course_does_not_ask_any_more_are_there_without_a_title(book):
    gone = [MarkRecord("9.9", "why", status, 0.0, 1.0, "No.", "So.") for status in ("for a person", "wrong")]
    gone[1] = replace(gone[1], part="how")
    record(book, *(graded(student, *gone, mark()) for student in ("ada", "bob")))
    assert "9.9 why – 2 2 2" in text(book) and "9.9 how – 2 of 2 (100 %)" in text(book)


def test_whose_cells_stopped_is_listed_with_what_builds_on_them(book):
    why = Problem.of(Code.RAISED, type="NameError", text="name 'f' is not defined", line=3)
    stop = Problem.of(Code.CELL_STOPPED, cell="q2-11", question="2.11", role="answer", why=why, building=["2.12"])
    said = "2.11 stopped: NameError, name 'f' is not defined, line 3; 2.12 builds on it."
    record(book, graded("ada", mark(), problems=(stop, "own.py is too large.")), graded("bob", mark()))
    assert [(one.id, those) for one, those in overview.class_overview(book, OURS)["stopped"]] == [("ada", [said])]
    assert "Cells of 1 student stopped" in text(book) and "ada 2.11 stopped: NameError" in text(book)


def test_the_same_work_is_a_hint_with_its_evidence(book, tmp_path):
    for student in ("ada", "bob"):
        deliver(book, student, {"own.py": b"x = 1"})
        record(book, graded(student, cells=Facts(bench_of=student).as_json()))
    Reports(tmp_path, OURS, book).write_all()
    page = overview.as_page(overview.class_overview(book, OURS, tmp_path))
    assert "ada, bob ada, bob handed in the same 1 file: own.py." in " ".join(overview.as_text(page).split())
    assert "Nobody has the numbers, recordings or files of a class-mate" in text(book)  # nothing is written yet


def test_what_waits_and_what_each_scorer_has_read_is_counted(book):
    mine = ("2.11", "explanation")
    record(book, graded("ada"), graded("bob"), graded("eve"))
    for student in ("ada", "bob"):
        given = book.scores.give(student, mine, 1.0, "tia", level=4)
    book.scores.undo(given.number, "tia")
    book.scores.give("ada", mine, 0.5, "udo", level=2)
    found = overview.waiting(book.scores.answers(), book.scores.acts(), ["2.11"])
    waits = {one.where: ([answer.student for answer in one.answers], one.of) for one in found["waiting"]}
    assert waits[mine] == (["bob", "eve"], 3)
    assert found["scorers"] == [("tia", 2), ("udo", 1)]


# --- feedback that was given back -------------------------------------------------------------------------------------


def changed(book):
    last = book.publications()[-1]
    return [(one.student, one.part) for one in changes.changed_since(book.audit(), [last], OURS, book.excuses)]


def test_marks_that_changed_since_are_listed_with_both_points(book):
    record(book, graded("ada"), graded("bob"))
    assert "Feedback was not given back yet (rotflex publish)." in text(book)
    book.set_mark("bob", "2.11", "explanation", 1.0, "good", "tia")
    book.publish("lea")
    assert changed(book) == []
    book.set_mark("ada", "2.11", "explanation", 0.5, "half", "tia")  # was not decided
    book.set_mark("bob", "2.11", "omega_n", 1.5, "rounding", "tia")
    record(book, graded("eve", mark(), prose()))  # the explanation is not decided yet
    assert changed(book) == [("ada", "explanation"), ("bob", "omega_n"), ("eve", "omega_n")]
    assert "ada 2.11 explanation: not decided → 0.5 of 1 bob 2.11 omega_n: 2 of 2 → 1.5 of 2 eve" in text(book)
    book.set_mark("bob", "2.11", "omega_n", 2.0, "no, all of it", "tia")  # as it was
    assert changed(book) == [("ada", "explanation"), ("eve", "omega_n")]
    book.publish("lea", "again")
    assert changed(book) == []


def test_what_is_not_ready_is_listed_before_it_is_published(book):
    record(book, graded("ada"), graded("bob", mark(), prose(), replace(report_text(), status="missing")))
    book.comment("ada", "Please.", "lea", "2.11", "omega_n", asks=True)

    def unready(*notebooks, **settings):
        course = replace(OURS, settings=CourseSettings(**settings))
        return list(overview.not_ready(book, course, notebooks, clock.now()))

    waits, asks = unready()
    assert waits == "Still to be read by a person: 3 answers of 2 students; their pages say so."
    assert asks == "1 request not answered yet (rotflex status lists what students ask)."
    assert list(unready(FIRST)) == ["Still to be read by a person: 2 answers of 2 students; their pages say so.", asks]
    assert list(unready(SECOND)) == ["Still to be read by a person: 1 answer of 1 student; their pages say so."]
    later = FeedbackSettings(opens=clock.now() + timedelta(days=1))
    assert unready(feedback=later)[-1].startswith(f"Feedback opens on {later.opens:%Y-%m-%d}")
    waits, left_out, _asks = unready(marks=MarkSettings(drop=("2.16", "2.12")))
    assert "2 answers of 2 students" in waits and left_out.startswith("Left out, as course.toml drops it: 2.16, 2.12.")
    book.comment("ada", "Yes.", "tia", "2.11", "omega_n")
    for student, part in (("ada", "explanation"), ("bob", "explanation")):
        book.set_mark(student, "2.11", part, 1.0, "good", "tia")
    book.set_mark("ada", "2.16", "comparison", 1.0, "good", "tia")
    assert unready(feedback=FeedbackSettings(opens=datetime(2020, 1, 1, tzinfo=UTC))) == []


# --- how it looks -----------------------------------------------------------------------------------------------------


def test_the_terminal_gets_all_of_it_and_nothing_that_steers_it(day):
    shown = overview.as_text(day[1])
    assert max(map(len, shown.splitlines())) <= 100
    assert "\x1b" not in shown and "Is <this> right?\\x1b[2J" in shown and "Eve <b>Early</b>" in shown
    headings = re.findall(r"<h2[^>]*>([^<]+)", day[1])
    assert len(headings) == 11 and all(f"\n{one.upper()}\n" in f"\n{shown}\n" for one in headings)
    assert "rotflex grade MARKS SUBMISSIONS --deadline 1200\n" in shown  # in one line, to be copied


def test_the_page_loads_nothing_runs_nothing_and_escapes_all(day):
    body = day[1].partition("</style>")[2]
    assert not {"script", "img", "link", "iframe", "b", "i", "this"} & set(re.findall(r"<(\w+)", day[1]))
    links = re.findall(r"""\s(?:href|src)=["']([^"']*)""", day[1])
    assert {f"#{there}" for there in re.findall(r' id="([^"]+)"', body)} >= set(links) != set()
    assert not re.findall(r"<[^>]*\s(?:on\w+|style)=", body) and "default-src 'none'" in day[1]
    assert "Eve &lt;b&gt;Early&lt;/b&gt;" in body and "\\x1b[2J" in body
    assert body.count("<table") == body.count("<thead") == body.count("<caption")


def test_an_empty_gradebook_and_a_roster_alone_are_shown(book, tmp_path):
    assert "0 of 0 students handed something in." in text(book) and "Nothing is to do today." in text(book)
    enrol(book, tmp_path, ("ada", "Ada", "", ""), ("bob", "", "", ""))
    shown = text(book)
    assert "0 of 2 students" in shown and "ada (Ada) missing: 01, 02" in shown
    assert "so everything is due" in shown.lower() and "missing: 01 modeling" not in shown  # nobody is behind


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_the_summary_is_seen_at_once_and_every_word_stands_out(chromium, day, tmp_path, scheme):
    (tmp_path / "class.html").write_text(day[1], encoding="utf-8")
    there = chromium.new_page(viewport={"width": 1280, "height": 720}, color_scheme=scheme)
    there.goto((tmp_path / "class.html").as_uri())
    assert there.eval_on_selector("#to-do-today tbody tr", "node => node.getBoundingClientRect().bottom") < 720
    dark = there.evaluate("getComputedStyle(document.body).backgroundColor") == "rgb(22, 24, 27)"
    assert dark is (scheme == "dark") and findings(there) == []
    there.set_viewport_size({"width": 390, "height": 720})  # tables scroll, and not the page
    assert there.evaluate("document.documentElement.scrollWidth") <= 390
    there.close()
