"""A report's PDF from what comes in to who scores it: taken in, marked by, shown; and what is refused."""

import zipfile
from dataclasses import replace
from urllib.parse import urlencode

import pytest
from fake_class import FakeClass, InlineMarker
from made_courses import loaded
from pdfs import blank, composed, typeset
from said_problems import codes, names
from scoring_class import LEVELS, clients

from labcourse.answers import report_files
from labcourse.grading import intake
from labcourse.grading.counting import _marked_again
from labcourse.grading.gradebook import StudentRecord
from labcourse.grading.reports.feedback import page
from labcourse.grading.reports.result import result_in
from labcourse.grading.scoring import cards, server
from labcourse.grading.scoring.desk import Desk, key_of
from labcourse.problems import Code, Problem
from rotflex.course.questions import CATALOGUE

REPORT, WHOLE, PART = "Modeling report", "Modeling report, as a whole", "organisation"
NAME = report_files.file_name(REPORT)
TEXT = "stiffness_procedure"
KEY = """
from labcourse.grading.marking.checks import ForAPerson
from rotflex.course.questions import CATALOGUE

KEY = {name: {part.name: ForAPerson() for part in CATALOGUE.marked[name].parts}
       for name in ("Modeling report", "Modeling report, as a whole")}
"""


class Class(FakeClass):
    """A class that hands in reports."""

    def key(self, factor):
        self.course = loaded(self.folder / "term", key=KEY)

    def report(self, student, data, name=NAME):
        self.hand_in(student)
        (self.folder / "in" / student / name).write_bytes(data)

    def marks(self, student):
        self.grade()
        with self.book() as book:
            return {one.where: one for one in book.current(student).marks}


@pytest.fixture
def made(tmp_path, monkeypatch):
    return Class(tmp_path, monkeypatch)


def taken(folder):
    (submission,) = intake.find(folder).submissions
    return intake.read(submission, ["a.ipynb"], {}, packages=(), reports=[NAME])


def hand_in(folder, files):
    with zipfile.ZipFile(folder / "ada.zip", "w") as packed:
        for name, data in {"work/a.ipynb": b'{"cells": []}', **files}.items():
            packed.writestr(name, data)


@pytest.mark.parametrize(
    "name", [NAME, "modeling_report (1).pdf", "Modeling_Report-Copy1.PDF", "ada_12_modeling_report.pdf"]
)
def test_whatever_its_name_became_it_is_the_report_and_no_file_of_ones_own(tmp_path, name):
    hand_in(tmp_path, {f"work/{name}": blank(), "work/data sheet.pdf": blank(2)})
    found = taken(tmp_path)
    assert intake.unread_problems(found) == [] and bool(found.notes) == (name != NAME)
    intake.choose_newest(found, found.items, ["a.ipynb"], reports=[NAME])
    assert (found.pdfs, found.files) == ({NAME: blank()}, {"data sheet.pdf": blank(2)})


@pytest.mark.parametrize(
    ("data", "why"),
    [
        (b"PK\x03\x04", Problem.of(Code.NOT_A_PDF)),
        (b"%PDF-1.7" + bytes(report_files.MAX_BYTES), Problem.of(Code.TOO_MANY_BYTES, most=report_files.MAX_BYTES)),
    ],
)
def test_what_is_no_pdf_or_too_large_is_told_and_kept_nowhere(tmp_path, data, why):
    hand_in(tmp_path, {f"work/{NAME}": data})
    found = taken(tmp_path)
    assert [item.name for item in found.items] == ["a.ipynb"]
    (problem,) = intake.unread_problems(found)
    assert (problem.code, problem.where, problem.parameters["why"]) == (Code.REPORT_UNREAD, NAME, why)


def test_a_report_that_could_not_be_read_is_no_problem_once_it_was_handed_in_again(tmp_path):
    hand_in(tmp_path, {f"work/{NAME}": b"no PDF"})
    (tmp_path / "ada.zip").rename(tmp_path / "ada (1).zip")
    hand_in(tmp_path, {f"work/{NAME}": b"no PDF"})
    assert codes(intake.unread_problems(taken(tmp_path))) == [(Code.REPORT_UNREAD, NAME)]
    hand_in(tmp_path, {f"work/{NAME}": blank()})
    (tmp_path / "ada.zip").rename(tmp_path / "ada (2).zip")
    assert intake.unread_problems(taken(tmp_path)) == []


@pytest.mark.parametrize(("data", "is_said"), [(blank(), False), (blank(password="x"), True), (blank(owner="x"), True)])
def test_a_document_that_may_ask_for_a_password_is_taken_and_whoever_scores_is_warned(made, data, is_said):
    made.report("ada", data)
    assert made.marks("ada")[WHOLE, PART].status == "for a person"
    with made.book() as book:
        run = book.current("ada").run
    (note,) = [note for note in run.notes if note.code is Code.REPORT_IN_PDF]
    assert (note.where, note.parameters["name"], note.parameters["bytes"]) == (REPORT, NAME, len(data))
    asks = Problem.of(Code.MAY_ASK_FOR_PASSWORD, REPORT, name=NAME)
    assert [problem for problem in run.problems if NAME in names([problem])] == [asks] * is_said


def test_texts_of_ones_own_document_wait_for_a_person_and_are_not_missing(made):
    made.hand_in("bob")
    made.report("ada", typeset())
    marks, without = made.marks("ada"), made.marks("bob")
    given = report_files.of_data(REPORT, typeset()).given
    assert {one.status for one in marks.values()} == {"for a person"}
    assert {one.given for one in marks.values()} == {given}
    assert {one.status for one in without.values()} == {"missing"}


def test_a_report_that_is_made_of_empty_cells_leaves_them_missing(made):
    made.report("ada", composed())
    marks = made.marks("ada")
    assert marks[REPORT, TEXT].status == "missing"
    assert marks[WHOLE, PART].status == "for a person" and NAME in marks[WHOLE, PART].given


def test_a_persons_mark_lapses_with_the_document_and_the_notebooks_are_not_run_again(made):
    made.report("ada", typeset())
    made.marks("ada")
    with made.book() as book:
        book.set_mark("ada", WHOLE, PART, 1.0, reason="Neat.", actor="ann")
    assert made.marks("ada")[WHOLE, PART].points == 1
    made.report("ada", blank(2))
    assert made.marks("ada")[WHOLE, PART].status == "for a person"
    with made.book() as book:
        (lapsed,) = book.current("ada").lapsed
        assert lapsed.mark.where == (WHOLE, PART)
    made.report("ada", typeset())
    assert made.marks("ada")[WHOLE, PART].points == 1
    assert made.runs == ["ada"]


def test_a_document_alone_can_be_scored_too_and_is_marked_again(made):
    made.hand_in("ada")
    (made.folder / "in" / "ada" / "a.ipynb").unlink()
    (made.folder / "in" / "ada" / NAME).write_bytes(typeset())
    assert made.marks("ada")[WHOLE, PART].status == "for a person"
    with made.book() as book:
        graded = book.current("ada")
        assert graded.run.problems[0].code is Code.NO_NOTEBOOK
        marker = InlineMarker(made.course, 1)
        again = _marked_again(book, made.course, replace(graded, marks=()), marker, (), "another").after
    assert again.marks == graded.marks


def test_the_feedback_names_it(made):
    made.report("ada", typeset())
    made.grade()
    with made.book() as book:
        shown = page(result_in(book, made.course, book.current("ada"), StudentRecord("ada")), made.course)
    assert f"your own document, {NAME} (PDF, " in shown
    assert f"[PDF: {NAME}]" in shown and report_files.of_data(REPORT, typeset()).digest not in shown


@pytest.fixture(scope="module")
def scored(tmp_path_factory):
    with pytest.MonkeyPatch.context() as patch:
        made = Class(tmp_path_factory.mktemp("scored"), patch)
        made.report("ada", typeset())
        made.report("bob", blank(2))
        made.hand_in("cleo")
        made.grade()
    with made.book() as book:
        yield Desk(book, CATALOGUE, {}, LEVELS)


def address(student, where=(WHOLE, PART), **more):
    sent = {"question": where[0], "part": where[1], "key": key_of(student, where), **more}
    return f"/report?{urlencode(sent)}"


def test_the_card_links_to_it_and_says_where_to_look(scored):
    (ann,) = clients(scored, "Ann")
    for where, look in (((WHOLE, PART), False), ((REPORT, TEXT), True)):
        (answer,) = [one for one in scored.book.scores.answers([where]) if one.student == "ada"]
        (shown,) = cards.card(scored, [answer])["answers"]
        assert (shown["pdf"].name, shown["look_in_pdf"]) == (NAME, look)
        sent = {"question": where[0], "part": where[1], "key": key_of("ada", where)}
        html = ann.act("next", sent).json()["html"]
        assert f"The report as handed in ({shown['pdf'].about})" in html
        assert ("Its text cell is empty" in html) == look


def test_the_card_of_the_whole_says_of_each_text_that_is_not_in_its_cell_to_look_in_the_document(scored):
    (answer,) = [one for one in scored.book.scores.answers([(WHOLE, PART)]) if one.student == "ada"]
    said = "“not written yet” says that a text cell is empty"
    items = CATALOGUE.items(REPORT)
    for texts, wanted in (({TEXT: "We shook it."}, True), ({one.part: "Ours." for one in items if one.part}, False)):
        given = f"{answer.mark.given}\n\n{report_files.in_one_piece(items, texts)}"
        card = cards.card(scored, [replace(answer, mark=replace(answer.mark, given=given))])
        assert card["answers"][0]["some_in_pdf"] == wanted
        html = server.templates("scoring/page").get_template("card.html").render(card=card, points=str, again={})
        assert (said in html) == wanted
    (answer,) = [one for one in scored.book.scores.answers([(REPORT, TEXT)]) if one.student == "ada"]
    own = replace(answer, mark=replace(answer.mark, given=report_files.NOT_WRITTEN))  # words of the student's own
    assert not cards.card(scored, [own])["answers"][0]["some_in_pdf"]


def test_it_is_served_as_it_came_with_a_policy_of_its_own(scored):
    (ann,) = clients(scored, "Ann")
    reply = ann.get(address("ada"))
    assert (reply.status_code, reply.content) == (200, typeset())
    headers = reply.headers
    assert headers["content-type"] == "application/pdf"
    assert headers["content-disposition"] == f"inline; filename*=UTF-8''{NAME}"
    assert headers["x-content-type-options"] == "nosniff"
    assert headers["content-security-policy"] == server.REPORT_POLICY  # one policy, and not the page's besides
    assert server.REPORT_POLICY.endswith("; sandbox") and "allow" not in server.REPORT_POLICY
    assert headers["cross-origin-resource-policy"] == "same-origin" and headers["cache-control"] == "no-store"
    assert ann.get(address("bob")).content == blank(2)
    assert type(ann)(ann.app).get(address("ada")).status_code == 403  # who is not let in
    assert (ann.get("/report").status_code, ann.get(f"/report/{NAME}").status_code) == (400, 404)


@pytest.mark.parametrize(
    "sent",
    [
        {"key": key_of("cleo", (WHOLE, PART))},  # handed in none
        {"key": key_of("ada", (REPORT, TEXT))},  # another part's
        {"key": ""},
        {"question": "../" + WHOLE},
        {"question": "Control report, as a whole"},
    ],
)
def test_nothing_else_is_to_be_had_by_it(scored, sent):
    (ann,) = clients(scored, "Ann")
    reply = ann.get(address("ada", **sent))
    assert reply.status_code == 404
    assert b"%PDF" not in reply.content


def test_a_partner_without_files_of_their_own_is_scored_by_the_pairs_report(made):
    (roster := made.folder / "roster.csv").write_text("id\nada\nbob\n")
    with made.book() as book:
        book.import_roster(roster)
    made.report("ada+bob", typeset())
    made.grade()
    with made.book() as book:
        (ann,) = clients(Desk(book, CATALOGUE, {}, LEVELS), "Ann")
        reply = ann.get(address("bob"))
    assert (reply.status_code, reply.content) == (200, typeset())
