"""The class, a student and any answer on the scoring page: what is shown, decided, and never written."""

import re
from dataclasses import replace
from datetime import timedelta

import pytest
from day_class import IN_HZ, fill, off, score
from gradebooks import graded, mark, prose, record, report_text
from made_courses import OURS
from pages_harm import HOSTILE, harm
from scoring_class import Client, clients, desk

from labcourse import clock
from labcourse.grading.gradebook import Gradebook, StudentRecord
from labcourse.grading.reports import feedback
from labcourse.grading.reports.result import result_in
from labcourse.grading.scoring import server
from labcourse.grading.scoring.desk import key_of, link
from labcourse.grading.scoring.guards import POLICY
from labcourse.student_id import GRADEBOOK_FILE

NUMBER, WORDS = ("2.11", "omega_n"), ("2.11", "explanation")
SENT = dict(zip(("question", "part"), NUMBER, strict=True))
BOB = "/" + link("bob", *NUMBER)
MARKED = "Instructor’s copy"


@pytest.fixture
def book(tmp_path):
    """Of omega_n: bob, cleo and s-0 to s-2 have the same slip; dan has another one; ada and fay are right."""
    with Gradebook(tmp_path / GRADEBOOK_FILE) as made:
        fill(made, tmp_path)
        score(made)
        for n in range(3):
            record(made, graded(f"s-{n}", off(IN_HZ, 10 + n), prose(), report_text()))
        yield made


def let_in(book, *names, **more):
    return clients(desk(book, **more), *names)


@pytest.fixture
def ann(book):
    return let_in(book, "Ann", names=True)[0]


def picks(page):
    """Key and digest of the answer itself, and of those that are like it."""
    found = re.findall(r'<(article|li) class="(?:own|answer)" data-key="(\w+)" data-seen="(\w+)"', page)
    return [[{"key": key, "seen": seen} for tag, key, seen in found if tag == which] for which in ("article", "li")]


def opened(client, path=BOB):
    ((own,), _others) = picks(client.get(path).text)
    return own


def points(book, student, where=NUMBER):
    return next(one for one in book.current(student).marks if one.where == where)


def links(page):
    return [found.replace("&amp;", "&") for found in re.findall(r'href="((?:student|answer|class)[^"]*)"', page)]


def test_from_the_class_any_answer_is_two_links_away(ann, book):
    first = links(ann.get("/class").text)
    assert link("bob") in first and link("fay", "2.12", "K_s") in first  # a student; a request
    assert link("dan", *WORDS) in first  # a scorer's question
    for student in ("bob", "cleo", "eve", "s-0"):
        page = ann.get("/" + link(student)).text
        assert MARKED in page
        for one in book.current(student).marks:
            assert link(student, *one.where) in links(page), one.where
            assert ann.get("/" + link(student, *one.where)).status_code == 200
    assert links(ann.get("/").text) == ["class"]


def test_a_student_is_found_by_id_and_by_a_part_of_the_name(ann):
    for wanted in ("bob", "BOB", "Bob%20Bell", "bell"):
        assert "<h1>Feedback for bob</h1>" in ann.get(f"/student?id={wanted}").text
    several = ann.get("/student?id=s-").text
    assert [one for one in links(several) if "student?" in one] == [link(f"s-{n}") for n in range(3)]
    assert "Nobody with “xyz”" in ann.get("/student?id=xyz").text
    assert ann.get("/student?id=gus").status_code == 404  # nothing of his was graded
    assert ann.get("/" + link("bob", "9.9", "x")).status_code == ann.get("/" + link("zoe", *NUMBER)).status_code == 404
    assert ann.get("/answer?student=bob").status_code == 400


def test_the_copy_is_complete_before_feedback_opens_and_whatever_was_given_back(book):
    book.publish("Lea", notebooks=["03_model_validation"])
    closed = replace(OURS.settings.feedback, points=False, reasons=False, opens=clock.now() + timedelta(days=9))
    course = replace(OURS, settings=replace(OURS.settings, feedback=closed))
    (ann,) = let_in(book, "Ann", names=True)
    pages = server.Pages(desk(book, names=True), course, lambda link: "")
    routes = {"path": "/student", "query_string": b"id=bob", "type": "http", "labcourse.actor": ann.scorer}
    page = pages.student(server.Request({**routes, "headers": []})).body.decode()
    assert MARKED in page and "it looks like Hz" in page and "0 of 2 points" in page


def asks(book, text="Please."):
    book.comment("bob", text, "lea", *NUMBER, asks=True)


def waiting(book):
    return [one.student for one in book.comments() if one.is_open]


def test_the_page_of_an_answer_has_all_that_is_known_of_it(ann, book):
    book.comment("bob", "Good plots.", actor="lea", question="2.11")
    book.comment("bob", "Elsewhere.", actor="lea", question="2.16")
    asks(book, "I say so in my text.")
    page = ann.get(BOB).text
    assert "16.3 rad/s" in page and "it looks like Hz" in page and "0 of 2 points" in page
    assert OURS.catalogue.marked["2.11"].part("omega_n").prompt in page
    assert "Good plots." in page and "Elsewhere." not in page and "I say so in my text." in page
    assert f"{OURS.true_bench('bob').omega_n:.5g} rad/s on this student’s bench" in page
    words = ann.get("/" + link("bob", *WORDS)).text
    assert "tia: gave level 2, 0.5 points: “Say why.”" in words and "tia: gave level 4" not in words
    # What the key knows is on no page of a student's.
    students_own = feedback.page(result_in(book, OURS, book.current("bob"), StudentRecord("bob")), OURS)
    assert "student’s bench" not in students_own and MARKED not in students_own and "answer?" not in students_own


def test_points_and_a_note_by_one_act_each_and_either_answers_a_request(ann, book):
    asks(book)
    own = opened(ann)
    sent = {**SENT, "answers": [own], "remark": "Right, in Hz."}
    reply = ann.act("decide", {**sent, "points": 1}).json()
    assert reply["message"].startswith("Given: 1 point.") and not reply["trouble"]
    mark_now = points(book, "bob")
    assert (mark_now.points, mark_now.reason, mark_now.status) == (1.0, "Right, in Hz.", "given by a person")
    assert waiting(book) == ["fay"]
    asks(book, "Are you sure?")
    assert [entry.actor for entry in book.audit("bob", "2.11") if entry.part == "omega_n"] == ["batch", "Ann"]
    ((own,), _others) = picks(reply["html"])
    note = ann.act("note", {**SENT, "answers": [own], "remark": "Look at the axis."}).json()
    assert note["message"].startswith("Noted. The points are as they were.")
    assert [(one.text, one.where) for one in book.comments("bob") if not one.asks] == [("Look at the axis.", NUMBER)]
    assert waiting(book) == ["fay"] and points(book, "bob") == mark_now
    back = ann.act("back", {**SENT, "key": own["key"]}).json()
    assert "Taken back" in back["message"] and points(book, "bob").reason == "It is 16.3 rad/s off; it looks like Hz."


def test_what_is_incomplete_is_refused_with_a_reason(ann, book):
    acts, own = len(book.scores.acts()), opened(ann)
    lacking = {"points": 1, "remark": " "}, {"remark": "So."}, {}, {"answers": []}
    for act, more in zip(("decide", "decide", "note", "same"), lacking, strict=True):
        reply = ann.act(act, {**SENT, "answers": [own], **more})
        assert reply.status_code == 400 and reply.json()["problem"], act
    assert (len(book.scores.acts()), book.comments("bob"), waiting(book)) == (acts, [], ["fay"])


def test_of_two_who_decide_the_second_is_told_who_when_and_why_and_writes_nothing(ann, book):
    own = opened(ann)
    book.set_mark("bob", *NUMBER, 1.5, reason="The axis says Hz.", actor="Lea")
    sent = {**SENT, "answers": [own], "remark": "Wrong."}
    for act, more in (("decide", {"points": 0}), ("note", {})):
        reply = ann.act(act, {**sent, **more}).json()
        assert reply["trouble"]
        assert re.search(r"Lea gave it 1\.5 of 2 points at 2100-\d\d-\d\d \d\d:\d\d UTC: “The axis", reply["message"])
        assert ">Wrong.</textarea>" in reply["html"]  # what was typed
    assert points(book, "bob").points == 1.5 and book.comments("bob") == []


def decided(ann, worth=1):
    """Decide on bob's answer: his answer, and those that are like it."""
    reply = ann.act("decide", {**SENT, "answers": [opened(ann)], "points": worth, "remark": "Right, in Hz."}).json()
    ((own,), others) = picks(reply["html"])
    return own, others


def test_what_was_decided_is_offered_for_the_same_slip_and_given_to_the_ticked_only(ann, book):
    book.set_mark("s-1", *NUMBER, 0.25, reason="Decided before.", actor="Lea")
    record(book, graded("s-3", off(IN_HZ, 14), prose(), report_text()))
    book.scores.ask("s-3", NUMBER, "tia", remark="Is it Hz?")
    bigger = replace(off(IN_HZ, 12), out_of=4.0)  # in an older release it was worth more
    record(book, graded("s-2", bigger, prose(), report_text(), submission="second"))
    own, others = decided(ann)
    named = {key_of(one.student, NUMBER): one.student for one in book.students()}
    assert sorted(named[one["key"]] for one in others) == ["cleo", "s-0", "s-2"]
    ticked = [one for one in others if named[one["key"]] != "s-0"]
    reply = ann.act("same", {**SENT, **own, "answers": ticked}).json()
    assert reply["message"].startswith("The same was given to 2 answers")
    now = {student: points(book, student) for student in ("cleo", "s-2", "s-0", "s-1", "dan")}
    assert [one.points for one in now.values()] == [1.0, 2.0, 0.0, 0.25, 0.0]
    assert now["cleo"].reason == now["s-2"].reason == "Right, in Hz."
    ann.act("back", {**SENT, "key": own["key"]})
    assert [points(book, student).points for student in ("cleo", "s-2", "bob")] == [0.0, 0.0, 1.0]
    ann.act("back", {**SENT, "key": own["key"]})
    assert points(book, "bob").points == 0.0


def test_nothing_is_given_to_an_answer_that_changed_nor_by_a_decision_that_changed(ann, book):
    own, others = decided(ann)
    book.set_mark("cleo", *NUMBER, 0.5, reason="Mine.", actor="Lea")
    reply = ann.act("same", {**SENT, **own, "answers": others}).json()
    assert reply["trouble"] and "Lea gave it 0.5 of 2 points" in reply["message"]
    assert (points(book, "cleo").points, points(book, "s-0").points) == (0.5, 1.0)
    ann.act("back", {**SENT, "key": own["key"]})
    book.set_mark("bob", *NUMBER, 2, reason="All of it.", actor="Lea")
    reply = ann.act("same", {**SENT, **own, "answers": others}).json()
    assert reply["trouble"] and "The decision has changed. Lea gave it 2 of 2" in reply["message"]
    assert points(book, "s-0").points == 0.0


def test_answers_in_words_are_never_offered_together_and_at_most_fifty_at_a_time(ann, book):
    sent = dict(zip(("question", "part"), WORDS, strict=True))
    own = opened(ann, "/" + link("fay", *WORDS))
    reply = ann.act("decide", {**sent, "answers": [own], "points": 1, "remark": "Good."}).json()
    assert picks(reply["html"])[1] == []
    for n in range(60):
        record(book, graded(f"t-{n}", off(IN_HZ, 20 + n), prose(), report_text()))
    own, others = decided(ann)
    assert len(others) == 50 and "64 other answers" in ann.get(BOB).text
    reply = ann.act("same", {**SENT, **own, "answers": others}).json()
    assert len(picks(reply["html"])[1]) == 14


def test_pages_by_name_show_names_where_scoring_hides_them_and_the_list_of_others_does_not(book):
    (ann,) = let_in(book, "Ann")
    assert "These pages show names" in ann.get("/").text
    for path in ("/class", "/student?id=bob", "/student?id=s-", BOB):
        assert ann.get(path).status_code == 200
    assert "16.3 rad/s" in ann.get(BOB).text
    _own, others = decided(ann)
    assert others and "cleo" not in ann.get(BOB).text  # the others stay without names


def test_nobody_from_outside_opens_anything_and_no_script_can_run_on_the_copies(ann, book):
    paths = ("/class", "/student?id=bob", BOB)
    assert [Client(ann.app).get(path).status_code for path in paths] == [403] * 3
    for path in paths[:2]:
        policy = ann.get(path).headers["content-security-policy"]
        assert "script" not in policy and "unsafe" not in policy and "default-src 'none'" in policy
    assert ann.get(BOB).headers["content-security-policy"] == POLICY
    assert ann.act("decide", {**SENT}, origin="http://example.com").status_code == 403


def test_what_a_notebook_showed_is_linked_where_it_is_there_and_nothing_else_is_sent(book, tmp_path):
    (ann,) = clients(desk(book, names=True), "Ann", results=tmp_path)
    assert "executed?" not in ann.get("/student?id=bob").text + ann.get(BOB).text
    (tmp_path / "bob" / "executed").mkdir(parents=True)
    (tmp_path / "bob" / "executed" / "02_finding_stiffness.html").write_text("<style>p{}</style><p>shown</p>")
    (tmp_path / "bob" / "feedback.html").write_text("<p>other</p>")
    address = "executed?id=bob&amp;notebook=02_finding_stiffness"
    assert address in ann.get("/student?id=bob").text and address in ann.get(BOB).text
    reply = ann.get("/" + address.replace("&amp;", "&"))
    assert "shown" in reply.text and "script" not in reply.headers["content-security-policy"]
    others = ("id=bob&notebook=../feedback", "id=ada&notebook=02_finding_stiffness", "id=..&notebook=x", "id=bob", "")
    assert [ann.get(f"/executed?{words}").status_code for words in others] == [404] * 5
    assert Client(ann.app).get("/" + address.replace("&amp;", "&")).status_code == 403


def test_a_students_text_is_text_on_each_page(tmp_path):
    with Gradebook(tmp_path / "other.sqlite") as book:
        for n, text in enumerate(HOSTILE):
            record(book, graded(f"h{n}", mark("wrong", 0.0, text, text), prose(given=text), report_text()))
            book.comment(f"h{n}", text, text, *NUMBER, asks=True)
            book.comment(f"h{n}", text, actor=text, question="2.11")
        (ann,) = clients(desk(book, names=True), "Ann")
        for n, text in enumerate(HOSTILE):
            page = ann.get("/" + link(f"h{n}", *NUMBER)).text
            main = page[page.index("<main>") : page.index("</main>")]
            assert harm(main) == [] and "\u202e" not in page
            ((own,), _others) = picks(page)
            reply = ann.act("decide", {**SENT, "answers": [own], "points": 0, "remark": text}).json()
            assert harm(reply["html"]) == []
