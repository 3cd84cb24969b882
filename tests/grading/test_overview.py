"""The class at a glance: what to do today, where the class is in the term, what changed; and how it looks."""

import json
import re
import sqlite3
from contextlib import closing
from dataclasses import replace
from datetime import UTC, datetime, timedelta

import pytest
from accessible import findings
from checkout import ROOT
from day_class import FIRST, HANDED_IN, NOW, SECOND, deliver, fill, graded, notebook, score, term
from gradebooks import enrol, facts, mark, prose, record, report_text
from made_courses import OURS
from page_text import page_text
from set_clock import set_clock

from labcourse import clock
from labcourse.grading import overview, todo
from labcourse.grading.gradebook import ON_DISK, Arrival, Delivery, Gradebook, StudentRecord
from labcourse.grading.marks import Mark
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
from labcourse.grading.submission import Doubt
from labcourse.problems import Code, Problem, codes, has
from labcourse.sentences import sentence, sentences

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


def table(found, label):
    """What stands in a table of the overview: first cell of a row → heading → text, if there is any."""
    (one,) = [one for section in found.sections for one in section.tables if one.label == label]
    texts = [[overview.text_of(cell) for cell in row] for row in one.rows]
    return {first: dict(zip(one.headings[1:], more, strict=True)) for first, *more in texts}


def tasks(book, course=None, folder=None):
    """What is to do: how it begins → who, points, and the command."""
    found = todo.todo(overview.class_overview(book, course or term(), folder).of)
    return {one.what: (one.who, one.worth, one.command) for one in found}


def text(book, course=OURS):
    return " ".join(overview.as_text(overview.class_overview(book, course)).split())


def dropping(*names, course=OURS):
    return replace(course, settings=replace(course.settings, marks=MarkSettings(drop=names)))


# --- what to do today -------------------------------------------------------------------------------------------------


def test_what_to_do_is_sorted_by_the_points_at_stake_each_with_its_command(day):
    found = [(one.what, one.who, one.worth, one.command.partition(" ")[2]) for one in todo.todo(day[0].of)]
    excuse, of = 'excuse MARKS gus {} --reason "..." --by NAME', Problem.of
    lab_02, lab_03, score_it = worth(FIRST), worth(SECOND), "score MARKS --by NAME"
    everybody = ("ada", "bob", "cleo", "dan", "fay")
    fault = of(Code.KEY_FAILED, question="2.12", part="K_s", error="KeyError, key.py, line 5.")
    answer = 'comment MARKS fay "TEXT" --question 2.12 --part K_s --by NAME'
    assert found == [
        (of(Code.TODO_ASK_FOR_WORK, title="Lab 03"), ("gus", "hal"), 2 * lab_03, excuse.format("'Lab 03'")),
        (of(Code.TODO_ASK_FOR_WORK, title="Lab 02"), ("gus",), lab_02, excuse.format("'Lab 02'")),
        (of(Code.TODO_GRADE), ("hal",), lab_02, GRADE),
        (of(Code.TODO_READ_ANSWERS, title="Lab 03"), everybody, 5 * 2, score_it),
        (of(Code.TODO_RUN_TIMED_OUT), ("eve",), 2 + 1 + 2, f"{GRADE} --deadline 1200"),
        (of(Code.TODO_MEND_KEY, problem=fault), ("eve",), 2, "regrade MARKS --question 2.12"),
        (of(Code.TODO_SCORER_ASKS), ("dan",), 1, score_it),
        (of(Code.TODO_READ_ANSWERS, title="Lab 02"), ("fay",), 1, score_it),
        (of(Code.TODO_NOT_ON_ROSTER), ("hal",), None, "roster MARKS NAMES.csv"),
        (of(Code.TODO_ANSWER_REQUEST, answer="2.12 K_s"), ("fay",), 0, answer),
    ]
    shown = " ".join(overview.as_text(day[0]).split())
    assert "10 things to do." in shown and "5 students: ada, bob, cleo, …" in shown
    assert all(shown.count(sentence(what)) == 1 for what, *_rest in found)


MISSING = mark("missing", 0.0, given="")
NO_CELLS = Problem.of(Code.NO_CELLS)


def stopped(code, **about):
    """The problem of the answer cell of 2.11 that stopped for a reason."""
    about = {"cell": "q2-11", "notebook": IN_02, "role": "answer", "question": "2.11", "why": Problem.of(code, **about)}
    return Problem.of(Code.CELL_STOPPED, **about)


RAISED = stopped(Code.RAISED, type="NameError", text="name 'x' is not defined", line=3)
TOO_LONG = stopped(Code.TOOK_TOO_LONG, seconds=60)
NO_MODULE = stopped(Code.MODULE_MISSING, module="pandas", line=1)
NEWER = stopped(Code.NEWER_PYTHON_NEEDED, type="SyntaxError", needed="3.99", here="3.12")
NO_FILE = stopped(Code.FILE_NOT_FOUND, type="FileNotFoundError", text="big.csv")
AT_HOME = Problem.of(Code.RUN_LEAVES_EMPTY, IN_02)
LOST = Problem.of(Code.RECORDED_AT_HOME, parts=["2.11 omega_n"], why=AT_HOME)
EXPLANATION = {"question": "2.11", "part": "explanation"}
GRADE = "grade MARKS SUBMISSIONS"
MARK = 'mark MARKS ada QUESTION PART POINTS --reason "..." --by NAME'

OF_RUNS = [  # of a run as a whole: the problem, the reason of the missing mark, what to do, and options of `grade`
    (Problem.of(Code.RUN_TIMED_OUT, seconds=600), RAISED, Code.TODO_RUN_TIMED_OUT, " --deadline 1200"),
    (Problem.of(Code.PYTHON_DIED), RAISED, Code.TODO_OUT_OF_MEMORY, " --memory 4096"),
    (Problem.of(Code.PRINTED_TOO_MUCH), RAISED, Code.TODO_PRINTED_TOO_MUCH, ""),
    (Problem.of(Code.RUN_ENDED_EARLY), RAISED, Code.TODO_RUN_ENDED_EARLY, " --cell-timeout 90"),
    (Problem.of(Code.RESULT_UNREAD, "answers.json", error="a link"), RAISED, Code.TODO_ANSWERS_UNREAD, ""),
    (Problem.of(Code.CELL_TIMED_OUT, seconds=60), TOO_LONG, Code.TODO_CELL_TIMED_OUT, " --cell-timeout 120"),
]
OF_ANSWERS = [  # the same of what else cost an answer, with the command
    (Problem.of(Code.ANSWERS_UNREAD, error="It is no JSON."), RAISED, Code.TODO_ANSWERS_UNREAD, GRADE),
    (TOO_LONG, TOO_LONG, Code.TODO_CELL_TIMED_OUT, f"{GRADE} --cell-timeout 120"),
    (NO_MODULE, NO_MODULE, Code.TODO_INSTALL_MODULE, f"{GRADE} --cell-timeout 90"),
    (NEWER, NEWER, Code.TODO_NEWER_PYTHON, GRADE),
    (LOST, Problem.of(Code.MISSING_HERE, why=AT_HOME), Code.TODO_RECORDED_AT_HOME, MARK),
]
OF_FILES = [  # and of files that were left out
    Problem.of(Code.OWN_FILE_REFUSED, "big.csv", why=Problem.of(Code.OWN_FILE_TOO_LARGE, most=10**6)),
    Problem.of(Code.MORE_OWN_FILES_REFUSED, count=2),
    Problem.of(Code.FILE_AND_FOLDER, files=["big.csv"]),
    Problem.of(Code.OUTSIDE_THE_FOLDER, files=["big.csv"]),
]
NAMED = [  # a problem, what to do, the points if it says which, and the command
    (Problem.of(Code.GRADING_FAILED, error="OSError: full"), Code.TODO_FAILED, 2, GRADE),
    (Problem.of(Code.UNKNOWN, named="of_tomorrow"), Code.TODO_FAILED, None, GRADE),
    (Problem.of(Code.EARLIER_MARKS_STAY, error="OSError"), Code.TODO_FAILED_AGAIN, None, GRADE),
    (Problem.of(Code.NOTEBOOK_UNREAD, IN_02, why=NO_CELLS), Code.TODO_ASK_AGAIN, worth(FIRST), GRADE),
    (Problem.of(Code.SUBMISSION_UNREAD, "a.zip", why=Problem.of(Code.ENCRYPTED)), Code.TODO_ASK_AGAIN, None, GRADE),
    (Problem.of(Code.NO_NOTEBOOK, files=["a.docx"]), Code.TODO_ASK_AGAIN, None, GRADE),
    (Problem.of(Code.OLDER_NOTEBOOK_COUNTS, IN_02, why=NO_CELLS), Code.TODO_OLDER_FILE_COUNTS, worth(FIRST), GRADE),
    (Problem.of(Code.REPORT_UNREAD, "report.pdf", why=Problem.of(Code.NOT_A_PDF)), Code.TODO_READ_REPORT, None, GRADE),
    (Problem.of(Code.MAY_ASK_FOR_PASSWORD, "The report", name="report.pdf"), Code.TODO_READ_REPORT, None, GRADE),
    (Problem.of(Code.OTHER_STUDENT_NAMED, named="bob", owner="ada"), Code.TODO_DECIDE_OWNER, None, GRADE),
    (Problem.of(Code.PARTNERS_UNCONFIRMED, partners=["bob"], owners=["ada"]), Code.TODO_DECIDE_OWNER, None, GRADE),
    (Problem.of(Code.ANSWERS_OF_ANOTHER_BENCH, bench="{}"), Code.TODO_OTHER_BENCH, None, GRADE),
    (Problem.of(Code.RELEASE_UNKNOWN, named="x", folder="releases", closest="y"), Code.TODO_ADD_RELEASE, None, GRADE),
    (Problem.of(Code.DOUBTED_BY_COURSE, "001-sweep", why="it is long"), Code.TODO_LOOK_AT_RECORDING, None, MARK),
    (Problem.of(Code.EMPTY_BESIDE_ANSWERED, IN_02, source="ada"), Code.TODO_NEWER_FILE_EMPTY, worth(FIRST), GRADE),
    (Problem.of(Code.EMPTY_BESIDE_ANSWERED, "x.ipynb", source="ada"), Code.TODO_NEWER_FILE_EMPTY, None, GRADE),
    (Problem.of(Code.TEXT_TOO_LONG, IN_02, count=9, most=8, **EXPLANATION), Code.TODO_LOOK_AT_TEXT, 1, MARK),
    (Problem.of(Code.TEXT_BESIDE_NOT_READ, IN_02, **EXPLANATION), Code.TODO_LOOK_AT_TEXT, 1, MARK),
    (Problem.of(Code.PICTURE_LEFT_OUT, IN_02, picture="a.png", **EXPLANATION), Code.TODO_LOOK_AT_TEXT, 1, MARK),
    (Problem.of(Code.TOO_MANY_PICTURES, IN_02, most=20, **EXPLANATION), Code.TODO_LOOK_AT_TEXT, 1, MARK),
    (Problem.of(Code.CELL_TOO_LONG, IN_02, cell=3, most=8), Code.TODO_LOOK_AT_TEXT, None, MARK),
    (Problem.of(Code.PASTED_PICTURE_LEFT_OUT, IN_02, picture="a.png", cell=3), Code.TODO_LOOK_AT_TEXT, None, MARK),
]
#: What to do that names the problem.
IN_FULL = {Code.TODO_FAILED, Code.TODO_FAILED_AGAIN, Code.TODO_ASK_AGAIN, Code.TODO_OLDER_FILE_COUNTS}
#: Field of what is known of a run, the problem in it, and as above: the reason, what to do, the points, the command.
CASES = [
    *(("ended", problem, reason, what, 2, f"{GRADE}{more}") for problem, reason, what, more in OF_RUNS),
    *(("problems", problem, reason, what, 2, command) for problem, reason, what, command in OF_ANSWERS),
    *(("notes", problem, NO_FILE, Code.TODO_FILE_LEFT_OUT, 2, GRADE) for problem in OF_FILES),
    *(("problems", problem, RAISED, *rest) for problem, *rest in NAMED),
]
OF_CAUSES = {cause.todo for cause in todo.CAUSES}


def test_each_code_of_each_cause_is_tried():
    tried = {(what, code) for _field, problem, _reason, what, *_rest in CASES for code in codes(problem)}
    assert tried >= {(cause.todo, code) for cause in todo.CAUSES for code in cause.codes}


@pytest.mark.parametrize(("field", "problem", "reason", "code", "points", "command"), CASES)
def test_each_cause_is_to_do_with_what_it_cost_and_said_in_full(book, field, problem, reason, code, points, command):
    deliver(book, "ada", {IN_02: notebook("a = 1")})
    given = {"problems": (RAISED,), "notes": ()}
    if field == "ended":
        given["cells"] = facts(ended=(problem,))
    else:
        given[field] += (problem,)
    record(book, graded("ada", replace(MISSING, reason=reason), **given))
    found = tasks(book)
    assert [what.code for what in found if what.code in OF_CAUSES] == [code]
    what = Problem.of(code, problem=problem) if code in IN_FULL else Problem.of(code)
    assert found[what] == (("ada",), points, f"rotflex {command}")
    assert table(overview.class_overview(book, term()), "Messages") == {"ada": {"Messages": sentence(problem)}}


def test_what_stopped_and_cost_nothing_is_not_to_do(book):
    deliver(book, "ada", {IN_02: notebook("a = 1")})
    record(
        book,
        graded("ada", mark(), cells=facts(ended=(Problem.of(Code.PYTHON_DIED),))),
    )
    assert not OF_CAUSES & {what.code for what in tasks(book)}


def test_what_a_cell_lacks_costs_only_what_is_missing_for_it(book):
    """A missing mark of the same student that has another reason does not count as lost by it."""
    deliver(book, "ada", {IN_02: notebook("a = 1")})
    other = replace(MISSING, part="explanation", out_of=1.0, reason=RAISED)
    record(book, graded("ada", replace(MISSING, reason=NO_MODULE), other, problems=(NO_MODULE, RAISED)))
    assert tasks(book)[Problem.of(Code.TODO_INSTALL_MODULE)][1] == 2


STOPPED = "Cells that stopped, and what builds on them"
SAID_BY_CODE = ["a picture was expected", "it took longer than 60 s and was stopped", "No such file or directory"]


def test_what_a_students_code_says_is_no_cause_though_it_has_our_words(book):
    """Nor is the name of a student's file. Each sentence about a cause is tried, and each that is shown of one."""
    texts = [*SAID_BY_CODE, *(sentence(Problem.of(code)) for cause in todo.CAUSES for code in cause.codes)]
    texts += [sentence(case[1]) for case in CASES]
    deliver(book, "ada", {IN_02: notebook("a = 1")})
    said = [stopped(Code.RAISED, type="ValueError", text=text) for text in texts]
    said += [Problem.of(Code.NAME_NOT_USED, IN_02, name="student", value=text) for text in texts]
    said += [Problem.of(Code.TAKEN_BY_NAME, IN_02, file=text) for text in texts]
    record(book, graded("ada", replace(MISSING, reason=said[0]), problems=(*said,), notes=(*said,)))
    found = overview.class_overview(book, term())
    assert table(found, "Messages") == {}
    assert not OF_CAUSES & {one.what.code for one in todo.todo(found.of)}
    assert table(found, STOPPED) == {"ada": {"What stopped": "\n".join(sentences(said[: len(texts)]))}}


def test_codes_that_are_looked_for_are_those_that_the_program_reports():
    sources = [*ROOT.glob("labcourse/**/*.py"), *ROOT.glob("solutions/*.py")]
    reporting = [path for path in sources if path.name not in ("todo.py", "sentences.py")]
    reported = {name for path in reporting for name in re.findall(r"\bCode\.(\w+)", path.read_text(encoding="utf-8"))}
    looked_for = {code for cause in todo.CAUSES for code in (*cause.codes, *cause.cost)}
    assert [code for code in looked_for if code.name not in reported] == []


def test_a_problem_of_a_later_version_is_shown_and_to_do_and_stops_nothing(book, tmp_path):
    """As where a gradebook was written by another version of the program."""
    later = {"code": "of_tomorrow", "where": IN_02, "seconds": 3, "named": "x", "why": {"code": "also", "parts": [1]}}
    known = Problem.from_json(later)
    assert (known.code, known.where, known.parameters["named"]) == (Code.UNKNOWN, IN_02, "of_tomorrow")
    assert (known.parameters["why"].code, known.parameters["why"].parameters["named"]) == (Code.UNKNOWN, "also")
    deliver(book, "ada", {IN_02: notebook("a = 1")})
    record(book, graded("ada", replace(MISSING, reason=RAISED), prose(), problems=(RAISED,), notes=(RAISED,)))
    stored = {"problems": [later], "notes": [later]}
    with closing(sqlite3.connect(tmp_path / "book.sqlite")) as database, database:
        for name, value in stored.items():
            database.execute(f"UPDATE runs SET {name} = ?", [json.dumps(value)])
        database.execute("UPDATE marks SET reason = ? WHERE part = 'omega_n'", [json.dumps(later)])
    current = book.current("ada")
    assert current.run.problems == current.run.notes == (known,)
    assert {one.part: one.reason for one in current.marks}["omega_n"] == known
    what = Problem.of(Code.TODO_FAILED, problem=known)
    assert tasks(book)[what][0] == ("ada",)
    assert (
        sentence(what)
        == "could not be graded: Another version stored the message 'of_tomorrow', which this version does not know."
    )
    assert sentence(what) in text(book)
    Reports(tmp_path / "out", term(), book).write_all()
    page = page_text((tmp_path / "out" / "ada" / "feedback.html").read_text(encoding="utf-8"))
    assert page.count(sentence(known)) >= 2  # at the answer, and of the whole
    record(book, replace(current, run=replace(current.run, key="again")))  # and it can be stored again
    assert book.current("ada").run.problems == (known,)


def test_a_failed_grading_waits_with_all_its_points_and_older_keys_marks_are_named(book):
    failed = replace(mark("not marked: key fault", 0.0, Problem.of(Code.NOT_GRADED)), part="omega_n")
    said = Problem.of(Code.GRADING_FAILED, error="OSError: full")
    record(book, graded("ada", failed, problems=(said,)), graded("bob", mark(), key="of before"))
    found = tasks(book)
    assert found[Problem.of(Code.TODO_FAILED, problem=said)][:2] == (("ada",), 2)
    assert found[Problem.of(Code.TODO_OLDER_KEY)][::2] == (("bob",), "rotflex regrade MARKS")


def test_lapsed_marks_and_answers_that_the_key_could_not_compare_are_to_do_once(book):
    unsure = replace(mark("for a person", 0.0, Problem.of(Code.NOT_COMPARED, error="x")), part="omega_n")
    record(book, graded("ada", unsure, prose()), graded("bob", mark(), prose()))
    book.set_mark("ada", "2.11", "explanation", 1.0, reason="good", actor="tia")
    record(book, graded("ada", unsure, prose(given="Another."), submission="next"))
    found = tasks(book)
    by_hand = 'rotflex mark MARKS ada 2.11 {} POINTS --reason "..." --by NAME'
    lapsed = Problem.of(Code.TODO_MARK_LAPSED, answer="2.11 explanation")
    assert found[lapsed] == (("ada",), 1, by_hand.format("explanation"))
    compared = Problem.of(Code.TODO_DECIDE_ANSWER, answer="2.11 omega_n", reason=unsure.reason)
    assert found[compared] == (("ada",), 2, by_hand.format("omega_n"))
    assert found[Problem.of(Code.TODO_READ_ANSWERS, title="Lab 02")][:2] == (("bob",), 1)
    said = table(overview.class_overview(book, term()), "Messages")["ada"]["Messages"]
    assert "tia gave 1 of 1 points" in said and "\n" not in said


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
    when = Problem.of(Code.TODO_DECIDE_TIME, title="Lab 02")
    assert found[when] == (("ada",), worth(FIRST), "rotflex grade MARKS SUBMISSIONS")
    assert Problem.of(Code.TODO_CORRECT_SETTINGS, "extensions", names=["nobody"]) in found
    assert Problem.of(Code.TODO_FIND_OWNERS, names=["a.zip"]) in found
    assert Problem.of(Code.TODO_DOUBTS, names=["b.zip (owner)"]) in found
    assert not has(Code.TODO_DECIDE_TIME, tasks(book))  # lateness costs nothing


def test_what_is_marked_is_to_be_given_back_and_what_moved_since_again(book):
    deliver(book, "ada", {IN_02: notebook("a = 1"), IN_03: notebook("a = 1")})
    record(book, graded("ada", mark(), report_text()))
    back = Problem.of(Code.TODO_GIVE_BACK, title="Lab 02")
    assert tasks(book)[back] == ((), 0, "rotflex publish MARKS --assignment 'Lab 02' --by NAME")
    assert Problem.of(Code.TODO_GIVE_BACK, title="Lab 03") not in tasks(book)  # an answer waits
    book.publish("lea", notebooks=[FIRST])
    assert back not in tasks(book)
    book.set_mark("ada", "2.11", "omega_n", 0.5, reason="no", actor="tia")
    moved = tasks(book)[Problem.of(Code.TODO_MARKS_MOVED, title="Lab 02")]
    assert moved == (("ada",), 1.5, "rotflex publish MARKS --assignment 'Lab 02' --by NAME")
    back = {
        title: row["Given back"] for title, row in table(overview.class_overview(book, term()), "Assignments").items()
    }
    assert back["Lab 02"] and not back["Lab 03"]


# --- the term ---------------------------------------------------------------------------------------------------------


def test_states_are_counted_by_assignment_and_said_by_student(day):
    found, _page = day
    states = table(found, "Students in each state")
    assert " ".join(states["Lab 02"]) == "could not be graded missing not due handed in waits for a person marked"
    assert {title: ",".join(counts.values()) for title, counts in states.items()} == {
        "Lab 02": "1,1,,1,2,3",
        "Lab 03": ",2,,,5,1",
        "Later": ",,8,,,",
    }
    out_of = {title: float(row["Out of"]) for title, row in table(found, "Assignments").items()}
    assert (out_of["Lab 02"], out_of["Lab 03"]) == (worth(FIRST), worth(SECOND))
    shown = overview.as_text(found)
    assert "7 of 8 students handed something in." in shown and "Values were supplied for eve: 2.9.sweep." in shown
    assert re.search(r"ada \(Ada Lovelace\) +waits for a person: Lab 03 +5.00 of 7 +2026-03-02 12:00 UTC", shown)
    assert re.search(r"gus \(Gus Gray\) +missing: Lab 02, Lab 03 +0.00 of 23 +–", shown)


def test_whoever_handed_in_late_is_counted(book):
    """All other numbers, counted by hand: test_term.py."""
    for student, hours in (("ada", 30), ("bob", 90)):
        deliver(book, student, {IN_02: notebook()}, NOW - timedelta(hours=hours))
        record(book, graded(student, mark()))
    found = overview.class_overview(book, term(late=LateSettings(grace_hours=1)))
    assert table(found, "Assignments")["Lab 02"]["Late"] == "1"


def test_the_newest_version_says_when(book):
    deliver(book, "ada", {IN_02: notebook("a = 1")})
    deliver(book, "ada", {IN_02: notebook("a = 2")}, HANDED_IN + timedelta(days=1))
    record(book, graded("ada"))
    there = {one.id: one for one in overview.class_overview(book, OURS).of.students}
    assert [*there["ada"].received] == [IN_02]
    assert there["ada"].last == "2026-03-03 12:00 UTC" and "has no roster" in text(book)


@pytest.mark.parametrize(("clock", "mark"), [("", "?"), (ON_DISK, " (file)"), ("the time in its name", ""), (None, "")])
def test_a_time_says_who_wrote_it_unless_a_platform_did(clock, mark):
    student = todo.Student(StudentRecord("ada"), None, received={IN_02: Arrival(HANDED_IN, clock)})
    assert student.last == f"2026-03-02 12:00 UTC{mark}"


@pytest.mark.parametrize(("size", "is_told"), [(4, False), (5, True)])
def test_nobody_is_far_below_a_few_and_what_is_not_due_is_not_compared(book, size, is_told):
    later = Mark("3.4", "poles", "wrong", 0.0, 50.0, "")
    for n in range(size):
        record(book, graded(f"s{n}", mark() if n else mark("wrong", 0.0), replace(later, points=50.0 * (n == 0))))
    found = overview.far_below(overview.class_overview(book, term()).of.students)
    assert [(one.id, share, usual) for one, share, usual in found] == [("s0", 0, 1)] * is_told


# --- what is dropped --------------------------------------------------------------------------------------------------


def test_what_is_dropped_is_in_nothing_and_the_page_says_so_once(book, tmp_path):
    enrol(book, tmp_path, *((student, "", "", "") for student in "abcdef"))
    fault = Problem.of(Code.KEY_FAILED, question="2.16", part="comparison", error="key.py, line 3")
    for student in "abcdef":
        words = report_text("not marked: key fault") if student == "d" else report_text()
        record(book, graded(student, mark(), prose(), words, problems=(fault,) if student == "d" else ()))
        book.set_mark(student, "2.11", "explanation", 1.0, reason="ok", actor="tia")
    book.scores.ask("f", ("2.16", "comparison"), "tia", remark="What now?")
    before, after = (overview.class_overview(book, course) for course in (term(), dropping("2.16", course=term())))
    for code in (Code.TODO_READ_ANSWERS, Code.TODO_SCORER_ASKS, Code.TODO_MEND_KEY):
        assert [has(code, [one.what for one in todo.todo(found.of)]) for found in (before, after)] == [True, False]
    for label in ("Answers that wait", "Questions of scorers"):
        assert [bool(table(found, label)) for found in (before, after)] == [True, False]
    line = "Left out, as course.toml drops it: 2.16. Requests and changed marks are still listed for it."
    assert overview.as_page(after).count(line) == text(book, dropping("2.16")).count(line) == 1
    assert "Left out" not in overview.as_page(before)


# --- answers and marks ------------------------------------------------------------------------------------------------


def test_what_waits_and_is_asked(day):
    found, _page = day
    # Of four explanations two were scored, and one is asked of the instructor: it waits all the same.
    waiting = [(*one.where, len(one.answers), one.of) for one in overview.waiting(found.of)]
    assert waiting == [("2.11", "explanation", 2, 4), ("2.16", "comparison", 5, 5)]
    shown = " ".join(overview.as_text(found).split())
    assert "To be read: 7 answers, worth 12 points." in shown
    assert "2.16 comparison How good is the model? 5 5 10" in shown
    assert "dan 2.11 explanation tia" in shown and "Is <this> right?" in shown
    assert "1 request not answered yet." in shown and "fay 2.12 K_s 2" in shown and "Please look again." not in shown


def test_slips_are_counted_by_what_the_key_said_without_its_numbers(day):
    first, second = overview.slips(one.graded for one in day[0].of.students if one.graded)
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


@pytest.mark.parametrize(("gave", "wrong"), [(2.0, 1), (1.0, 3)])
def test_what_went_wrong_is_by_the_points_that_a_person_gave_since(book, gave, wrong):
    """Words alone, which no key judges, are not listed, though a person gave less than all points."""
    record(book, *(graded(who, mark("wrong", 0.0), prose()) for who in ("ada", "bob", "cleo")))
    record(book, graded("dan", mark(), prose()))
    for who in ("ada", "bob"):
        book.set_mark(who, "2.11", "omega_n", gave, reason="You forgot 2π.", actor="tia")
        book.set_mark(who, "2.11", "explanation", 0.0, reason="No.", actor="tia")
    found = overview.slips(book.all_current())
    assert [(one.where, one.wrong, one.judged) for one in found] == [(("2.11", "omega_n"), wrong, 4)] * (wrong > 1)
    assert [one.reasons[0] for one in found] == [("You forgot 2π.", 2)] * (wrong > 1)


def test_answers_of_excused_students_are_not_asked_of_persons(book, tmp_path):
    record(book, graded("ada", prose(), report_text()), graded("bob", prose(), report_text()))
    book.excuse("ada", [FIRST], reason="ill", actor="lea")
    waits = {one.where: [answer.student for answer in one.answers] for one in waiting_in(book)}
    assert waits == {("2.11", "explanation"): ["bob"], ("2.16", "comparison"): ["ada", "bob"]}
    said = [*overview.to_give_back(book, OURS, (), tmp_path)]
    assert any("3 answers of 2 students" in line for line in said)
    book.excuse("ada", [FIRST], reason="well again", actor="lea", excused=False)
    assert [len(one.answers) for one in waiting_in(book)] == [2, 2]


def waiting_in(book):
    return overview.waiting(overview.class_overview(book, OURS).of)


def test_questions_that_the_course_does_not_ask_any_more_are_there_without_a_title(book):
    gone = [Mark("9.9", "why", status, 0.0, 1.0, "No.", "So.") for status in ("for a person", "wrong")]
    gone[1] = replace(gone[1], part="how")
    record(book, *(graded(student, *gone, mark()) for student in ("ada", "bob")))
    assert "9.9 why – 2 2 2" in text(book) and "9.9 how – 2 of 2 (100 %)" in text(book)


def test_whose_cells_stopped_is_listed_with_what_builds_on_them(book):
    stop = replace(RAISED, parameters={**RAISED.parameters, "building": ["2.12"]})
    large = Problem.of(Code.OWN_FILE_REFUSED, "own.py", why=Problem.of(Code.OWN_FILE_TOO_LARGE, most=10**6))
    record(book, graded("ada", mark(), problems=(stop, large)), graded("bob", mark()))
    said = "2.11 stopped: NameError, name 'x' is not defined, line 3; 2.12 builds on it."
    assert table(overview.class_overview(book, OURS), STOPPED) == {"ada": {"What stopped": said}}
    assert "Cells of 1 student stopped" in text(book) and "ada 2.11 stopped: NameError" in text(book)


def test_the_same_work_is_a_hint_with_its_evidence(book, tmp_path):
    for student in ("ada", "bob"):
        deliver(book, student, {"own.py": b"x = 1"})
        record(book, graded(student, cells=facts(bench_of=student)))
    Reports(tmp_path, OURS, book).write_all()
    shown = overview.as_text(overview.class_overview(book, OURS, tmp_path))
    assert "ada, bob ada, bob handed in the same 1 file: own.py." in " ".join(shown.split())
    assert "Nobody has the numbers, recordings or files of a class-mate" in text(book)  # nothing is written yet


def test_what_each_scorer_has_read_is_counted_also_if_it_was_taken_back(book):
    mine = ("2.11", "explanation")
    record(book, graded("ada"), graded("bob"))
    given = [book.scores.give(student, mine, 1.0, "tia", level=4) for student in ("ada", "bob")]
    book.scores.undo(given[1].number, "tia")
    book.scores.give("ada", mine, 0.5, "udo", level=2)
    read = table(overview.class_overview(book, OURS), "Scoring")
    assert read == {"tia": {"Answers": "2"}, "udo": {"Answers": "1"}}
    assert table(overview.class_overview(book, dropping("2.11 explanation")), "Scoring") == {}


def test_a_request_is_worth_what_the_answer_can_still_earn_in_its_column(book):
    record(book, graded("ada", mark("partly right", 0.5)))
    book.comment("ada", "Why?", actor="lea", question="2.11", part="omega_n", asks=True)
    labs = [replace(one, out_of=2 * worth(*one.notebooks)) for one in term().settings.assignments]
    (request,) = [
        one
        for one in todo.todo(overview.class_overview(book, term(assignments=tuple(labs))).of)
        if one.what.code is Code.TODO_ANSWER_REQUEST
    ]
    assert request.worth == 2 * 1.5


def test_an_answer_in_a_file_that_counts_as_a_whole_is_counted_once(book):
    deliver(book, "ada", {IN_02: notebook("a = 1")})
    older = Problem.of(Code.EMPTY_BESIDE_ANSWERED, IN_02, source="ada")
    (mishap,) = [one for one in todo.CAUSES if Code.EMPTY_BESIDE_ANSWERED in one.codes]
    record(book, graded("ada", mark(), problems=(older,)))
    of = overview.class_overview(book, term()).of
    named = Problem.of(Code.PICTURE_LEFT_OUT, IN_02, picture="a.png", **EXPLANATION)
    assert todo.cost(of, of.students[0], mishap, [older, named]) == worth(FIRST)


# --- feedback that was given back -------------------------------------------------------------------------------------


def changed(book):
    return [(one.student, one.part) for one in changes.changed_in(book, OURS)]


def test_marks_that_changed_since_are_listed_with_both_points(book):
    record(book, graded("ada"), graded("bob"))
    assert "Feedback was not given back yet (rotflex publish)." in text(book)
    book.set_mark("bob", "2.11", "explanation", 1.0, reason="good", actor="tia")
    book.publish("lea")
    assert changed(book) == []
    book.set_mark("ada", "2.11", "explanation", 0.5, reason="half", actor="tia")  # was not decided
    book.set_mark("bob", "2.11", "omega_n", 1.5, reason="rounding", actor="tia")
    record(book, graded("eve", mark(), prose()))  # the explanation is not decided yet
    assert changed(book) == [("ada", "explanation"), ("bob", "omega_n"), ("eve", "omega_n")]
    assert "ada 2.11 explanation: not decided → 0.5 of 1 bob 2.11 omega_n: 2 of 2 → 1.5 of 2 eve" in text(book)
    book.set_mark("bob", "2.11", "omega_n", 2.0, reason="no, all of it", actor="tia")  # as it was
    assert changed(book) == [("ada", "explanation"), ("eve", "omega_n")]
    book.publish("lea", "again")
    assert changed(book) == []


def test_what_is_not_ready_is_listed_before_it_is_published(book, tmp_path):
    record(book, graded("ada"), graded("bob", mark(), prose(), replace(report_text(), status="missing")))
    book.comment("ada", "Please.", actor="lea", question="2.11", part="omega_n", asks=True)

    def unready(*notebooks, **settings):
        course = replace(OURS, settings=CourseSettings(**settings))
        lines = overview.to_give_back(book, course, notebooks, tmp_path)
        return [line for line in lines if not line.startswith(("ada: ", "bob: "))]

    waits, asks = unready()
    assert waits == "Still to be read by a person: 3 answers of 2 students; their pages say so."
    assert asks == "1 request not answered yet (rotflex status lists what students ask)."
    assert list(unready(FIRST)) == ["Still to be read by a person: 2 answers of 2 students; their pages say so.", asks]
    assert list(unready(SECOND)) == ["Still to be read by a person: 1 answer of 1 student; their pages say so."]
    later = FeedbackSettings(opens=clock.now() + timedelta(days=1))
    assert unready(feedback=later)[-1].startswith(f"Feedback opens on {later.opens:%Y-%m-%d}")
    waits, left_out, _asks = unready(marks=MarkSettings(drop=("2.16", "2.12")))
    assert "2 answers of 2 students" in waits and left_out.startswith("Left out, as course.toml drops it: 2.16, 2.12.")
    book.comment("ada", "Yes.", actor="tia", question="2.11", part="omega_n")
    for student, part in (("ada", "explanation"), ("bob", "explanation")):
        book.set_mark(student, "2.11", part, 1.0, reason="good", actor="tia")
    book.set_mark("ada", "2.16", "comparison", 1.0, reason="good", actor="tia")
    assert unready(feedback=FeedbackSettings(opens=datetime(2020, 1, 1, tzinfo=UTC))) == []


# --- how it looks -----------------------------------------------------------------------------------------------------


def test_the_terminal_gets_all_of_it_and_nothing_that_steers_it(day):
    shown = overview.as_text(day[0])
    assert max(map(len, shown.splitlines())) <= 100
    assert "\x1b" not in shown and "Is <this> right?\\x1b[2J" in shown and "Eve <b>Early</b>" in shown
    headings = re.findall(r"<h2[^>]*>([^<]+)", day[1])
    assert len(headings) == 12 and all(f"\n{one.upper()}\n" in f"\n{shown}\n" for one in headings)
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
