"""The class at a glance: who is where, what waits, what went wrong for many, what changed; and how it looks."""

import re
from dataclasses import replace
from datetime import UTC, datetime, timedelta

import pytest
from accessible import findings
from contrast import CONTRASTS
from day_class import HANDED_IN, deliver, fill, notebook, score
from gradebooks import enrol, graded, mark, prose, record, report_text
from made_courses import OURS

from labcourse.grading import intake, overview
from labcourse.grading.gradebook import Act, Answer, Gradebook, MarkRecord, StudentRecord
from labcourse.grading.graded_run import Facts
from labcourse.grading.reports import changes
from labcourse.grading.settings import CourseSettings, Deadline, Extension, FeedbackSettings, LateSettings, MarkSettings

FIRST, SECOND = "02_finding_stiffness.ipynb", "03_model_validation.ipynb"
DUE = HANDED_IN - timedelta(days=1, hours=1)


@pytest.fixture(scope="module")
def day(tmp_path_factory):
    """A class on some day of the term: what is collected, and its page."""
    folder = tmp_path_factory.mktemp("day")
    with Gradebook(folder / "gradebook.sqlite") as book:
        fill(book, folder)
        score(book)
        book.requests.publish("lea")
        found = overview.class_overview(book, OURS)
    return found, overview.as_page(found)


def students(book, course=OURS):
    return {one.about.student: one for one in overview.class_overview(book, course)["students"]}


def text(book, course=OURS):
    return " ".join(overview.as_text(overview.as_page(overview.class_overview(book, course))).split())


def due(*extensions, late=None, when=DUE):
    deadlines = (Deadline(when, ("02_finding_stiffness", "03_model_validation")),)
    settings = replace(OURS.settings, deadlines=deadlines, extensions=extensions, late=late or LateSettings())
    return replace(OURS, settings=settings)


def dropping(*names, course=OURS):
    return replace(course, settings=replace(course.settings, marks=MarkSettings(drop=names)))


# --- who handed in ----------------------------------------------------------------------------------------------------


def test_who_handed_in_which_notebooks_and_who_nothing(day):
    found, page = day
    shown = overview.as_text(page)
    assert "7 of 8 students handed something in; 1 nothing." in shown
    assert {one.about.student for one in found["students"] if not one.handed_in} == {"gus"}
    assert re.search(r"ada \(Ada Lovelace\) +02, 03 +– +2026-03-02 12:00 UTC", shown)
    assert re.search(r"fay \(Fay Foot\) +02 +03 +2026-03-02 12:00 UTC", shown)
    assert "Handed in and not graded yet: hal." in shown and "Not on the roster: hal." in shown
    assert "Notebooks that nobody handed in: 00, 01, 04, 05, 06, 07, 08, 09, 10." in shown


def test_the_newest_version_says_when_and_a_partner_has_what_was_handed_in_for_both(book):
    deliver(book, "ada", {FIRST: notebook("a = 1")})
    deliver(book, "ada", {FIRST: notebook("a = 2")}, HANDED_IN + timedelta(days=1))
    for student in ("ada", "bob"):
        record(book, graded(student, cells=Facts(bench_of="ada").as_json()))
    there = students(book)
    assert [list(there[who].received) for who in ("ada", "bob")] == [[FIRST]] * 2
    assert there["ada"].last == "2026-03-03 12:00 UTC" and "has no roster" in text(book)


def test_who_is_late_by_how_much_and_what_is_missing_after_its_deadline(book, tmp_path):
    fill(book, tmp_path)
    more = Extension(datetime.now(UTC) + timedelta(days=1), ("fay", "eve"))
    behind = {who: (dict(one.late), list(one.overdue)) for who, one in students(book, due(more)).items() if one.behind}
    two_days = ({"02_finding_stiffness": 2, "03_model_validation": 2}, [])  # a day and an hour: two have begun
    missing = ["02_finding_stiffness", "03_model_validation"]
    assert behind == {
        **dict.fromkeys(("ada", "bob", "cleo", "dan"), two_days),
        "gus": ({}, missing),
        "hal": ({}, missing[1:]),
    }
    shown = text(book, due(more))
    assert "Late: 4 students; something is missing after its deadline: 2 students." in shown
    assert "ada (Ada Lovelace) 02: 2 days, 03: 2 days –" in shown and "gus (Gus Gray) – 02, 03" in shown
    grace = students(book, due(late=LateSettings(grace_hours=1)))["ada"]
    assert grace.late["02_finding_stiffness"] == 1
    an_hour = timedelta(hours=1)
    for course in (OURS, due(when=datetime.now(UTC) + an_hour)):
        assert not any(one.behind for one in students(book, course).values())
    in_grace = due(when=datetime.now(UTC) - an_hour, late=LateSettings(grace_hours=2))
    assert not any(one.behind for one in students(book, in_grace).values())


def test_of_unknown_times_and_of_what_cannot_be_read_nothing_is_missing(book, tmp_path):
    record(book, graded("zoe"))
    assert not students(book, due())["zoe"].behind  # nobody knows when anything came
    for student, files in {"ada": {FIRST: "", SECOND: "no notebook"}, "cleo": {FIRST: "nor this"}}.items():
        (tmp_path / "all" / student).mkdir(parents=True)
        for name, content in files.items():
            (tmp_path / "all" / student / name).write_bytes(content.encode() or notebook("a = 1"))
    for submission in intake.find(tmp_path / "all").submissions:
        found = intake.read(submission, [path.name for path in OURS.notebooks])
        deliver(book, submission.student, {item.name: item.content for item in found.items})
        record(book, graded(submission.student, problems=tuple(found.problems())))
    there = students(book, due())
    assert [(list(there[who].received), list(there[who].unread)) for who in ("ada", "cleo")] == [
        ([FIRST], [SECOND]),
        ([], [FIRST]),
    ]
    assert [list(there[who].overdue) for who in ("ada", "cleo")] == [[], ["03_model_validation"]]
    assert "ada 02 03 not readable" in text(book)
    deliver(book, "ada", {SECOND: notebook("a = 2")}, HANDED_IN + timedelta(days=1))
    assert not students(book)["ada"].unread


# --- what is dropped --------------------------------------------------------------------------------------------------


def test_what_is_dropped_is_in_nothing_and_the_page_says_so_once(book, tmp_path):
    enrol(book, tmp_path, *((student, "", "", "") for student in "abcdef"))
    fault = "2.16, comparison is not marked: the key failed. key.py, line 3"
    for student in "abcdef":
        words = report_text("missing", given="") if student in "abc" else report_text()
        words = report_text("not marked: key fault") if student == "d" else words
        record(book, graded(student, mark(), prose(), words, problems=(fault,) if student == "d" else ()))
        book.set_mark(student, "2.11", "explanation", 1.0, "ok", "tia")
    book.scores.ask("f", ("2.16", "comparison"), "tia", remark="What now?")
    empty = ("troubled", "waiting", "asked", "unmarked", "key_faults")
    before, after = (overview.class_overview(book, course) for course in (OURS, dropping("2.16")))
    assert all(before[name] for name in empty) and not any(after[name] for name in empty)
    line = "Left out, as course.toml drops it: 2.16. Requests and changed marks are still listed for it."
    assert overview.as_page(after).count(line) == text(book, dropping("2.16")).count(line) == 1
    assert "Left out" not in overview.as_page(before)


def test_slips_medians_lapsed_marks_and_notebooks_are_of_what_counts(book):
    for student in "abcdef":
        wrong = mark("wrong", 0.0, "Too high.") if student == "a" else mark()
        record(book, graded(student, wrong, prose("wrong", 0.0), report_text()))
    book.set_mark("a", "2.16", "comparison", 1.0, "good", "tia")
    record(book, graded("a", mark("wrong", 0.0), prose("wrong", 0.0), report_text(given="Other."), submission="next"))
    found = overview.class_overview(book, OURS)
    assert any("for another answer" in why for why in found["troubled"][0][1]) and len(found["slips"]) == 1
    found = overview.class_overview(book, dropping("2.16", "2.11 explanation"))
    ((one, (why,)),) = found["troubled"]
    assert one.about.student == "a" and why.startswith("Far below the class: 0 %") and not found["slips"]
    assert not overview.class_overview(book, dropping("2.16", "2.11"))["troubled"]
    deliver(book, "a", {FIRST: notebook("a = 1")})
    names = [number for number, one in OURS.catalogue.marked.items() if f"{one.notebook}.ipynb" == SECOND]
    for drop, overdue in (((), ["03_model_validation"]), (names, []), (names[1:], ["03_model_validation"])):
        assert list(students(book, dropping(*drop, course=due()))["a"].overdue) == overdue


# --- who is in trouble ------------------------------------------------------------------------------------------------


def test_each_trouble_is_told_and_the_keys_faults_are_not_the_students(day):
    (eve, why), (bob, low) = day[0]["troubled"]
    assert eve.about.student == "eve" and why == [
        "Their run stopped: The run took longer than 600 s, and was stopped.",
        "Odd: <i>",
        "Missing: 3 parts, worth 5 of 7 points.",
        "Values were supplied for them: 2.9.sweep.",
        "Far below the class: 0 % of the points that are decided; the median is 32 %.",
    ]
    assert bob.about.student == "bob" and low[0].startswith("Far below the class: 10 %")


@pytest.mark.parametrize(("size", "is_told"), [(4, False), (5, True)])
def test_nobody_is_far_below_a_few(size, is_told):
    everybody = [graded(f"s{n}", mark() if n else mark("wrong", 0.0), submission=f"s{n}") for n in range(size)]
    found = overview.in_trouble([overview.Student(StudentRecord(one.run.student), one) for one in everybody])
    assert bool(found) is is_told


@pytest.mark.parametrize(("missing", "is_told"), [(2.0, False), (3.0, True)])
def test_much_is_missing_from_a_third_on_and_of_many_problems_some_are_told(missing, is_told):
    marks = [replace(mark("missing", 0.0), out_of=missing), replace(mark(), part="other", points=5.0, out_of=5.0)]
    assert bool(overview.troubles(graded("ada", *marks))) is is_told
    *first, rest = overview.troubles(graded("ada", mark(), problems=tuple(f"Problem {n}." for n in range(5))))
    assert first == ["Problem 0.", "Problem 1.", "Problem 2."] and rest.startswith("2 problems")


# --- answers and marks ------------------------------------------------------------------------------------------------


def test_what_waits_is_asked_or_could_not_be_marked(day):
    found, page = day
    # Of four explanations two were scored, and one is asked of the instructor: it waits all the same.
    waiting = [(*one.where, len(one.answers), one.of) for one in found["waiting"]]
    assert waiting == [("2.11", "explanation", 2, 4), ("2.16", "comparison", 5, 5)]
    shown = " ".join(overview.as_text(page).split())
    assert "To be read: 7 answers, worth 12 points." in shown
    assert "2.16 comparison How good is the model? 5 5 10" in shown
    assert "dan 2.11 explanation tia" in shown and "Is <this> right?" in shown
    assert "1 request not answered; 1 answered." in shown and "1 fay 2.12 K_s" in shown
    assert found["unmarked"] == {("2.12", "K_s"): 1}
    assert found["key_faults"] == ["2.12, K_s is not marked: the key failed. KeyError, key.py, line 5."]


def test_slips_are_counted_by_what_the_key_said_without_its_numbers(day):
    first, second = day[0]["slips"]
    assert (first.where, first.wrong, first.judged) == (("2.11", "omega_n"), 3, 5)
    assert first.reasons == [("It is … rad/s off; it looks like Hz.", 2), ("It is … rad/s off.", 1)]
    assert (second.where, second.wrong, second.judged) == (("2.12", "K_s"), 2, 5)
    assert "2 × It is … rad/s off; it looks like Hz.\n1 × It is … rad/s off." in day[1]


@pytest.mark.parametrize(
    ("reason", "without"),
    [
        ("3.25 % off.", "… % off."),
        ("K_2 of q3: -1.5e-3, 4.", "K_2 of q3: …, …."),
        ("poles -3+4j, 2", "poles …+…, …"),
        ("about 2·10⁻³ N·m", "about … N·m"),
        ("question 2.11", "question …"),
    ],
)
def test_numbers_are_taken_out_and_names_stay(reason, without):
    assert overview.without_numbers(reason) == without


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


def test_the_same_work_is_a_hint_with_its_evidence(book):
    for student in ("ada", "bob"):
        deliver(book, student, {"own.py": b"x = 1"})
        record(book, graded(student, cells=Facts(bench_of=student).as_json()))
    assert "ada, bob ada, bob handed in the same 1 file: own.py." in text(book)


def acts(times, where=("1.1", "why"), actor="tia"):
    start = datetime(2026, 3, 2, 9, tzinfo=UTC)
    return [
        Act(0, "ada", *where, actor, 3, 1.0, 1.0, "", "So.", False, None, start + timedelta(seconds=seconds))
        for seconds in times
    ]


def answers(number, where=("1.1", "why"), status="for a person"):
    return [Answer("ada", *where, MarkRecord(*where, status, 0.0, 1.0, "", "So."))] * number


def test_what_is_left_is_estimated_by_the_median_of_each_part_or_else_of_all():
    other, third = ("1.2", "how"), ("1.3", "what")
    both = [*acts(20 * n for n in range(7)), *acts((120 + 60 * n for n in range(1, 7)), other)]

    def left(*waiting):
        return overview.waiting([*waiting], both, ["1.1", "1.2", "1.3"])["seconds_left"]

    assert left(*answers(3), *answers(1, status="given by a person")) == 60
    assert left(*answers(2, other)) == 120 and left(*answers(1, third)) == 40
    found = overview.waiting(answers(1), [*acts(range(0, 80, 20)), *acts([7, 17], actor="udo")], ["1.1"])
    assert found["seconds_left"] is None  # too few are known
    assert found["scorers"] == [("tia", 4, None), ("udo", 2, None)]


# --- feedback that was given back -------------------------------------------------------------------------------------


def changed(book):
    last = book.requests.publications()[-1]
    return [(one.student, one.part) for one in changes.changed_since(book.audit(), [last], OURS, book.excuses)]


def test_marks_that_changed_since_are_listed_with_both_points(book):
    record(book, graded("ada"), graded("bob"))
    assert "Feedback was not given back yet (rotflex publish)." in text(book)
    book.set_mark("bob", "2.11", "explanation", 1.0, "good", "tia")
    book.requests.publish("lea")
    assert changed(book) == []
    book.set_mark("ada", "2.11", "explanation", 0.5, "half", "tia")  # was not decided
    book.set_mark("bob", "2.11", "omega_n", 1.5, "rounding", "tia")
    record(book, graded("eve", mark(), prose()))  # the explanation is not decided yet
    assert changed(book) == [("ada", "explanation"), ("bob", "omega_n"), ("eve", "omega_n")]
    shown = text(book)
    assert "Marks of 3 students have changed since" in shown and "FEEDBACK GIVEN BACK (TO DO)" in shown
    assert "ada 2.11 explanation: not decided → 0.5 of 1 bob 2.11 omega_n: 2 of 2 → 1.5 of 2 eve" in shown
    book.set_mark("bob", "2.11", "omega_n", 2.0, "no, all of it", "tia")  # as it was
    assert changed(book) == [("ada", "explanation"), ("eve", "omega_n")]
    book.requests.publish("lea", "again")
    assert changed(book) == []


def test_what_is_not_ready_is_listed_before_it_is_published(book):
    record(book, graded("ada"), graded("bob", mark(), prose(), replace(report_text(), status="missing")))
    book.requests.make("ada", ("2.11", "omega_n"), "Please.")

    def unready(**settings):
        return list(overview.not_ready(book, CourseSettings(**settings), datetime.now(UTC)))

    waits, asks = unready()
    assert waits == "Still to be read by a person: 3 answers of 2 students; their pages say so."
    assert asks == "1 request not answered yet (rotflex requests list)."
    later = FeedbackSettings(opens=datetime.now(UTC) + timedelta(days=1))
    assert unready(feedback=later)[-1].startswith(f"Feedback opens on {later.opens:%Y-%m-%d}")
    waits, left_out, _asks = unready(marks=MarkSettings(drop=("2.16", "2.12")))
    assert "2 answers of 2 students" in waits and left_out.startswith("Left out, as course.toml drops it: 2.16, 2.12.")
    book.requests.answer(1, "tia", "Yes.")
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
    assert len(headings) == 9 and all(f"\n{one.upper()}\n" in f"\n{shown}\n" for one in headings)
    assert "IN TROUBLE (TO DO)" in shown and "WENT WRONG FOR MANY\n" in shown


def test_the_page_loads_nothing_runs_nothing_and_escapes_all(day):
    body = day[1].partition("</style>")[2]
    assert not {"script", "img", "link", "iframe", "b", "i", "this"} & set(re.findall(r"<(\w+)", day[1]))
    links = re.findall(r"""\s(?:href|src)=["']([^"']*)""", day[1])
    assert {f"#{there}" for there in re.findall(r' id="([^"]+)"', body)} >= set(links) != set()
    assert not re.findall(r"<[^>]*\s(?:on\w+|style)=", body) and "default-src 'none'" in day[1]
    assert "Eve &lt;b&gt;Early&lt;/b&gt;" in body and "\\x1b[2J" in body
    assert body.count("<table") == body.count("<thead") == body.count("<caption")


def test_an_empty_gradebook_and_a_roster_alone_are_shown(book, tmp_path):
    assert "0 of 0 students handed something in; 0 nothing." in text(book) and "TO DO" not in text(book)
    enrol(book, tmp_path, ("ada", "Ada", "", ""), ("bob", "", "", ""))
    assert "Nothing handed in Student" in text(book) and "0 of 2 students" in text(book)


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_the_summary_is_seen_at_once_and_every_word_stands_out(chromium, day, tmp_path, scheme):
    (tmp_path / "class.html").write_text(day[1], encoding="utf-8")
    there = chromium.new_page(viewport={"width": 1280, "height": 720}, color_scheme=scheme)
    asked = []
    there.on("request", lambda request: asked.append(request.url))
    there.goto((tmp_path / "class.html").as_uri())
    assert there.eval_on_selector("nav", "node => node.getBoundingClientRect().bottom") < 720
    contrasts = there.evaluate(CONTRASTS)
    assert len(contrasts) > 100 and [one for one in contrasts if one[1] < 4.5] == []
    dark = there.evaluate("getComputedStyle(document.body).backgroundColor") == "rgb(22, 24, 27)"
    assert dark is (scheme == "dark") and len(asked) == 1 and findings(there) == []
    for width in (1280, 400):  # tables scroll, and not the page
        there.set_viewport_size({"width": width, "height": 720})
        assert there.evaluate("document.documentElement.scrollWidth") <= width
    there.close()
