"""A class at a glance: who is where, what waits for whom, what went wrong for many; on the terminal and on a page."""

import re
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from html.parser import HTMLParser

import pytest
from day_class import HANDED_IN, deliver, fill, notebook, score
from gradebooks import enrol, graded, mark, prose, record, report_text
from made_courses import OURS

from labcourse.grading import intake
from labcourse.grading.gradebook import StudentRecord
from labcourse.grading.graded_run import Facts
from labcourse.grading.overview import glance, shown, slips, students
from labcourse.grading.settings import Deadline, Extension, LateSettings, MarkSettings


@pytest.fixture
def seen(book, tmp_path):
    fill(book, tmp_path)
    score(book)
    return told(book)


def told(book, course=OURS):
    return {section.title: section for section in glance.at(book, course).sections}


def rows(section, table=-1):
    return [row for row in section.tables[table].rows]


def test_who_handed_in_which_notebooks_and_who_nothing(seen):
    section = seen["Handed in"]
    assert section.first == "7 of 8 students handed something in; 1 nothing."
    assert rows(section, 0) == [("gus (Gus Gray)",)]
    assert rows(section, 1)[0] == ("ada (Ada Lovelace)", "02, 03", "", "2026-03-02 12:00 UTC")
    assert rows(section, 1)[-2:] == [
        ("fay (Fay Foot)", "02", "03", "2026-03-02 12:00 UTC"),
        ("hal", "02", "03", "2026-03-02 12:00 UTC"),
    ]
    assert "Handed in and not graded yet: hal." in section.more and "Not on the roster: hal." in section.more
    assert "Notebooks that nobody handed in: 00, 01, 04, 05, 06, 07, 08, 09, 10." in section.more


def test_the_newest_version_says_when(book):
    deliver(book, "ada", {"02_finding_stiffness.ipynb": notebook("a = 1")})
    deliver(book, "ada", {"02_finding_stiffness.ipynb": notebook("a = 2")}, HANDED_IN + timedelta(days=1))
    section = told(book)["Handed in"]
    assert rows(section, 1)[0][-1] == "2026-03-03 12:00 UTC"
    assert any("has no roster" in line for line in section.more)


def test_what_a_partner_handed_in_for_both_is_both_students(book):
    deliver(book, "ada", {"02_finding_stiffness.ipynb": notebook("a = 1")})
    for student in ("ada", "bob"):
        record(book, graded(student, cells=Facts(bench_of="ada").as_json()))
    assert [row[1] for row in rows(told(book)["Handed in"], 1)] == ["02", "02"]


FIRST, SECOND = "02_finding_stiffness.ipynb", "03_model_validation.ipynb"
DUE = HANDED_IN - timedelta(days=1, hours=1)


def test_one_answer_of_one_point_is_told_as_one(book):
    record(book, graded("ada", mark(), prose()))
    assert re.findall(r"1 \w+", told(book)["Waiting for a person"].first) == ["1 answer", "1 point"]


def due(*extensions, late=None, when=DUE):
    deadlines = (Deadline(when, ("02_finding_stiffness", "03_model_validation")),)
    settings = replace(OURS.settings, deadlines=deadlines, extensions=extensions, late=late or LateSettings())
    return replace(OURS, settings=settings)


def test_who_is_late_by_how_much_and_what_is_missing_after_its_deadline(book, tmp_path):
    fill(book, tmp_path)
    more = Extension(datetime.now(UTC) + timedelta(days=1), ("fay", "eve"))
    section = told(book, due(more))["Handed in"]
    assert section.first.endswith("Late: 4 students; something is missing after its deadline: 2 students.")
    assert rows(section) == [
        ("ada (Ada Lovelace)", "02: 2 days, 03: 2 days", ""),  # a day and an hour: two have begun
        ("bob (Bob Bell)", "02: 2 days, 03: 2 days", ""),
        ("cleo", "02: 2 days, 03: 2 days", ""),
        ("dan (Dan Dee)", "02: 2 days, 03: 2 days", ""),
        ("gus (Gus Gray)", "", "02, 03"),
        ("hal", "", "03"),
    ]
    page = shown.page(glance.at(book, due(more)))
    assert "Missing after the deadline" in page and "02: 2 days" in page


def test_what_has_grace_or_is_not_due_yet_is_neither_late_nor_missing(book, tmp_path):
    fill(book, tmp_path)
    (first, *_rest) = rows(told(book, due(late=LateSettings(grace_hours=1)))["Handed in"])
    assert first[1] == "02: 1 day, 03: 1 day"
    for course in (OURS, due(when=datetime.now(UTC) + timedelta(hours=1))):
        section = told(book, course)["Handed in"]
        assert section.first == "7 of 8 students handed something in; 1 nothing." and rows(section) == []
    an_hour_ago = datetime.now(UTC) - timedelta(hours=1)
    grace = told(book, due(when=an_hour_ago, late=LateSettings(grace_hours=2)))["Handed in"]
    assert rows(grace) == []


def test_of_whom_nobody_knows_when_it_came_nothing_is_missing(book):
    record(book, graded("ada"))
    assert rows(told(book, due())["Handed in"]) == []


def test_what_cannot_be_read_was_handed_in_all_the_same(book, tmp_path):
    (tmp_path / "all").mkdir()
    for student in ("ada", "bob"):
        (tmp_path / "all" / student).mkdir()
        (tmp_path / "all" / student / FIRST).write_bytes(notebook("a = 1"))
    (tmp_path / "all" / "ada" / SECOND).write_text("no notebook", encoding="utf-8")
    (tmp_path / "all" / "cleo").mkdir()
    (tmp_path / "all" / "cleo" / FIRST).write_text("nor this", encoding="utf-8")
    wanted = [path.name for path in OURS.notebooks]
    for submission in intake.find(tmp_path / "all").submissions:
        found = intake.read(submission, wanted)
        readable = {item.name: item.content for item in found.items}
        deliver(book, submission.student, readable)
        record(book, graded(submission.student, problems=tuple(found.problems())))
    section = told(book, due())["Handed in"]
    assert [row[:3] for row in rows(section, 1)] == [
        ("ada", "02", "03 not readable"),
        ("bob", "02", "03"),
        ("cleo", "", "03, 02 not readable"),
    ]
    assert [row[2] for row in rows(section, 2)] == ["", "03", "03"]  # the second of ada is there
    deliver(book, "ada", {SECOND: notebook("a = 2")}, HANDED_IN + timedelta(days=1))
    assert rows(told(book)["Handed in"], 1)[0][:3] == ("ada", "02, 03", "")


def dropping(*names, course=OURS):
    return replace(course, settings=replace(course.settings, marks=MarkSettings(drop=names)))


def test_what_is_dropped_is_in_nothing_that_is_told_and_the_page_says_so_once(book, tmp_path):
    enrol(book, tmp_path, *((student, "", "", "") for student in "abcdef"))
    fault = "2.16, comparison is not marked: the key failed. key.py, line 3"
    for student in "abcdef":
        words = report_text("missing", given="") if student in "abc" else report_text()
        words = report_text("not marked: key fault") if student == "d" else words
        record(book, graded(student, mark(), prose(), words, problems=(fault,) if student == "d" else ()))
        book.set_mark(student, "2.11", "explanation", 1.0, "ok", "tia")
    book.scores.ask("f", ("2.16", "comparison"), "tia", remark="What now?")
    before = told(book)
    assert before["In trouble"].first.startswith("3 students") and before["Waiting for a person"].urgent
    course = dropping("2.16")
    seen = told(book, course)
    assert seen["In trouble"].first == "Nobody is in trouble, as far as marks and runs tell."
    assert seen["Waiting for a person"].first == "No answer waits for a person."
    assert seen["Asked of the instructor"].first == "No scorer asks you."
    assert seen["Faults of the key"].first == "The key had no fault." and seen["Faults of the key"].more == ()
    assert "Left to score" not in seen["Time"].first
    line = "Left out, as course.toml drops it: 2.16. Requests and changed marks are told all the same."
    whole = glance.at(book, course)
    assert shown.page(whole).count(line) == 1 and list(shown.lines(whole)).count(line) == 1
    assert "Left out" not in shown.page(glance.at(book, OURS)) + "".join(shown.lines(glance.at(book, OURS)))


def test_slips_medians_and_lapsed_marks_are_of_what_counts(book):
    for student in "abcdef":
        wrong = mark("wrong", 0.0, "Too high.") if student == "a" else mark()
        record(book, graded(student, wrong, prose("wrong", 0.0), report_text()))
    book.set_mark("a", "2.16", "comparison", 1.0, "good", "tia")
    record(book, graded("a", mark("wrong", 0.0), prose("wrong", 0.0), report_text(given="Other."), submission="next"))
    assert "for another answer" in told(book)["In trouble"].tables[0].rows[0][1]
    assert told(book)["Went wrong for many"].first.startswith("1 part went wrong")
    seen = told(book, dropping("2.16", "2.11 explanation"))
    ((who, why),) = rows(seen["In trouble"])
    assert who == "a" and why.startswith("Far below the class: 0 %") and "another answer" not in why
    assert seen["Went wrong for many"].first == "No part went wrong for many."
    assert told(book, dropping("2.16", "2.11"))["In trouble"].first.startswith("Nobody")


def test_a_notebook_in_which_nothing_counts_is_missed_by_nobody(book):
    deliver(book, "ada", {FIRST: notebook("a = 1")})
    record(book, graded("ada"))
    names = [number for number, one in OURS.catalogue.marked.items() if f"{one.notebook}.ipynb" == SECOND]
    assert rows(told(book, due(late=LateSettings()))["Handed in"])[0][2] == "03"
    first = told(book, dropping(*names, course=due()))["Handed in"].first
    assert "Late: 1 student; something is missing after its deadline: 0 students." in first
    (some,) = rows(told(book, dropping(*names[1:], course=due()))["Handed in"])
    assert some[2] == "03"


def test_each_reason_is_told_and_the_keys_faults_are_not_the_students(seen):
    section = seen["In trouble"]
    assert section.first.startswith("2 students to look at")
    (eve, why), (bob, low) = rows(section)
    assert eve.startswith("eve") and why.splitlines() == [
        "Their run stopped: The run took longer than 600 s, and was stopped.",
        "Odd: <i>",
        "Missing: 3 parts, worth 5 of 7 points.",
        "Values were supplied for them: 2.9.sweep.",
        "Far below the class: 0 % of the points that are decided; the median is 32 %.",
    ]
    assert bob == "bob (Bob Bell)" and low.startswith("Far below the class: 10 %")


def test_a_mark_that_lapsed_is_a_reason(book):
    record(book, graded("ada", mark(), prose()))
    book.set_mark("ada", "2.11", "explanation", 1.0, "good", "tia")
    assert students.reasons(book.current("ada")) == []
    record(book, graded("ada", mark(), prose(given="Something else."), submission="second"))
    (why,) = students.reasons(book.current("ada"))
    assert why.startswith("2.11, explanation: tia gave 1 of 1 points")


@pytest.mark.parametrize(("size", "is_told"), [(4, False), (5, True)])
def test_nobody_is_far_below_a_few(size, is_told):
    everybody = [graded(f"s{n}", mark() if n else mark("wrong", 0.0), submission=f"s{n}") for n in range(size)]
    found = students.in_trouble([students.Student(StudentRecord(one.run.student), one) for one in everybody])
    assert bool(rows(found)) is is_told


@pytest.mark.parametrize(("missing", "is_told"), [(2.0, False), (3.0, True)])
def test_much_is_missing_from_a_third_on(missing, is_told):
    marks = [replace(mark("missing", 0.0), out_of=missing), replace(mark(), part="other", points=5.0, out_of=5.0)]
    found = students.reasons(graded("ada", *marks))
    assert bool(found) is is_told


def test_of_many_problems_some_are_told_and_how_many_more(book):
    one = graded("ada", mark(), problems=tuple(f"Problem {n}." for n in range(5)))
    *first, rest = students.reasons(one)
    assert first == ["Problem 0.", "Problem 1.", "Problem 2."] and rest.startswith("2 problems")


def test_what_waits_is_counted_by_part_with_its_points(seen):
    section = seen["Waiting for a person"]
    # Of four explanations two were scored, and one is asked of the instructor: it waits all the same.
    assert rows(section) == [
        ("2.11 explanation", "Natural frequency", "2", "4", "2"),
        ("2.16 comparison", "How good is the model?", "5", "5", "10"),
    ]
    assert "7 answers" in section.first and "12 points" in section.first


def test_the_instructor_is_told_who_asks_what_and_students_requests(seen):
    (one,) = rows(seen["Asked of the instructor"])
    assert one[:3] == ("dan", "2.11 explanation", "tia") and one[-1].startswith("Is <this> right?")
    (request,) = rows(seen["Requests to look again"])
    assert request[:3] == ("1", "fay", "2.12 K_s") and request[-1] == "I think <b>it</b> is right."
    assert seen["Requests to look again"].first == "1 request not answered; 1 answered."


def test_faults_of_the_key_are_told_with_the_line(seen):
    section = seen["Faults of the key"]
    assert rows(section) == [("2.12 K_s", "1")]
    assert section.more == ("2.12, K_s is not marked: the key failed. KeyError, key.py, line 5.",)


def test_slips_are_counted_by_what_the_key_said_without_its_numbers(seen):
    first, second = rows(seen["Went wrong for many"])
    assert first[0] == "2.11 omega_n" and first[2] == "3 of 5 (60 %)"
    assert first[3].splitlines() == ["2 × It is … rad/s off; it looks like Hz.", "1 × It is … rad/s off."]
    assert second[0] == "2.12 K_s" and second[2] == "2 of 5 (40 %)"


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
    assert slips.without_numbers(reason) == without


@pytest.mark.parametrize(("wrong", "right", "is_told"), [(2, 8, True), (2, 9, False), (1, 0, False)])
def test_many_are_a_fifth_of_those_who_answered_and_two_at_least(wrong, right, is_told):
    those = [graded(f"w{n}", mark("wrong", 0.0)) for n in range(wrong)] + [
        graded(f"r{n}", mark()) for n in range(right)
    ]
    those += [graded(f"m{n}", mark("missing", 0.0), prose()) for n in range(5)]  # nobody whose answer was judged
    assert bool(slips.slips(those)) is is_told


def test_the_same_work_is_told_with_its_evidence_as_a_hint(book):
    for student in ("ada", "bob"):
        deliver(book, student, {"own.py": b"x = 1"})
        record(book, graded(student, cells=Facts(bench_of=student).as_json()))
    section = told(book)["Hints of the same work"]
    ((who, evidence),) = rows(section)
    assert (who, evidence) == ("ada, bob", "ada, bob handed in the same 1 file: own.py.")
    assert "A hint, never a verdict." in section.first and not section.urgent


def test_the_terminal_gets_all_of_it_and_nothing_that_steers_it(book, seen):
    lines = list(shown.lines(glance.at(book, OURS)))
    text = "\n".join(lines)
    assert max(map(len, lines)) <= 100
    assert "\x1b" not in text and "Is <this> right?\\x1b[2J" in text
    for section in seen.values():
        assert section.title.upper() in text
        assert all(row[0].split()[0] in text for table in section.tables for row in table.rows)
    assert "IN TROUBLE (to do)" in lines and "TIME" in lines


class _Page(HTMLParser):
    def __init__(self, text):
        super().__init__()
        self.tags, self.attributes, self.ids = [], [], []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        self.attributes += [(name, value) for name, value in attrs]


def test_the_page_loads_nothing_runs_nothing_and_escapes_all(book, seen):
    text = shown.page(glance.at(book, OURS))
    page = _Page(text)
    assert not {"script", "img", "link", "iframe", "b", "i", "this"} & set(page.tags)
    assert all(value.startswith("#") for name, value in page.attributes if name in ("href", "src"))
    assert not [name for name, _value in page.attributes if name.startswith("on") or name == "style"]
    assert "default-src 'none'" in text and "Eve &lt;b&gt;Early&lt;/b&gt;" in text and "\\x1b[2J" in text
    there = {value for name, value in page.attributes if name == "id"}
    assert {value[1:] for name, value in page.attributes if name == "href"} <= there
    assert page.tags.count("table") == page.tags.count("thead") and "caption" in page.tags
    assert all(value in ("col", "row") for name, value in page.attributes if name == "scope")


def test_an_empty_gradebook_is_told_as_one(book):
    sections = told(book)
    assert sections["Handed in"].first == "0 of 0 students handed something in; 0 nothing."
    assert not any(section.urgent for section in sections.values())
    assert shown.page(glance.at(book, OURS)) and list(shown.lines(glance.at(book, OURS)))


def test_a_roster_alone_shows_who_handed_in_nothing(book, tmp_path):
    enrol(book, tmp_path, ("ada", "Ada", "", ""), ("bob", "", "", ""))
    assert rows(told(book)["Handed in"], 0) == [("ada (Ada)",), ("bob",)]
    before = datetime.now(UTC)
    assert before <= glance.at(book, OURS).when <= datetime.now(UTC)
