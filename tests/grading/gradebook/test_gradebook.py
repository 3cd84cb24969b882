"""The gradebook: the same promises on a file and on a real PostgreSQL server, which is started here."""

import hashlib
import json
import threading
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from datetime import UTC, datetime, timedelta, timezone

import pytest
from gradebook_dump import dump
from made_runs import graded, mark, prose, record, small_class

from labcourse import clock
from labcourse.errors import GradebookError
from labcourse.grading.gradebook import DECIDED, Arrival, Delivery, Gradebook, MarkState, storable, store
from labcourse.grading.marks import Status


def changes(book, **which):
    """The audit trail in short: part, status and points before and after."""

    def short(state):
        return state and (state.status, state.points)

    return [(one.part, short(one.before), short(one.after)) for one in book.audit(**which)]


def test_a_recorded_run_is_read_as_it_was(book, url):
    one = graded(probe_seed=2**48 - 1, problems=("p",), notes=("n", "µ Ω ∞ 学"), answers=bytes(range(256)) * 8192)
    assert record(book, one) == 2
    assert book.current("ada") == book.find_made("ada first") == one
    with Gradebook(url) as again:
        assert list(again.all_current()) == [one]


def test_every_change_of_a_mark_is_in_the_audit_trail(book):
    start = clock.now()
    record(book, graded("ada", "first", mark(), mark(part="a"), mark(part="b"), mark(part="c", reason="So.")))
    failed = graded("ada", "first", mark(points=0.0, status="missing"), mark(part="b"), mark(part="c", reason="Thus."))
    assert record(book, failed, "prof", "Run again.") == 3
    assert book.current("ada") == failed
    gone, fallen, reworded = sorted(book.audit()[4:], key=lambda one: "aKc".index(one.part[0]))
    assert (gone.part, gone.before, gone.after) == ("a", MarkState("right", 2.0, 2.0, "Well."), None)
    assert (fallen.part, fallen.after) == ("K_s", MarkState("missing", 0.0, 2.0, "Well."))
    assert (reworded.before.reason, reworded.after.reason) == ("So.", "Thus.")
    assert (gone.student, gone.actor, gone.reason, gone.run) == ("ada", "prof", "Run again.", "ada first")
    assert start <= gone.when <= clock.now() and all(one.before is None for one in book.audit()[:4])


def test_the_newest_run_counts_and_an_old_one_can_count_again(book):
    first = graded("ada", "first", mark(points=1.0))
    second = graded("ada", "second", mark(points=2.0))
    record(book, first)
    assert record(book, second) == 1
    assert book.current("ada") == second and book.find_made("ada first") == first
    assert record(book, first) == 1
    assert list(book.all_current()) == [first] and book.find_made("ada second") == second
    assert [one.after.points for one in book.audit()] == [1.0, 2.0, 1.0]


def test_ids_are_compared_without_regard_to_how_accents_are_composed(book):
    composed, apart = "j\u00fcrgen", "ju\u0308rgen"
    record(book, graded(apart, "first"))
    record(book, graded(f" {composed.upper()} ", "second"))
    assert [one.student for one in book.students()] == [composed]
    for written in (composed, apart, apart.upper(), f"{apart} "):
        assert book.current(written).run.student == composed.upper()
        book.comment(written, "Well.", actor="prof")
        assert len(book.audit(written)) == len(book.audit()) > 0
    assert len(book.comments(apart)) == 4
    assert book.set_mark(apart, mark().question, mark().part, 1.0, reason="Read.", actor="prof") == 1


def test_a_key_belongs_to_one_student(book):
    record(book, graded("ada", key="k"))
    before = dump(book)
    with pytest.raises(GradebookError, match="depend on the student"):
        record(book, graded("bob", key="k"))
    assert dump(book) == before


def nested(inner, levels):
    for _ in range(levels):
        inner = [inner]
    return inner


@pytest.mark.parametrize(
    "unfit",
    [
        graded("a/b"),
        graded(""),
        graded("a" * 81),
        graded("ada", "first", mark(points=float("nan"))),
        graded("ada", "first", mark(out_of=float("inf"))),
        graded("ada", "first", mark(), mark()),
        graded("ada", "first", prose(status=Status.BY_A_PERSON)),
        graded(probe_seed=2**63),
        graded(supplied={"2.11.omega_n": float("nan")}),
        graded(supplied={"2.11.omega_n": 10**5000}),
        graded(claim={"2.11": {"K_s": object()}}),
        graded(cells=tuple(nested({}, 10**5))),
        graded(words={"2.12": {"why": {"text": "x" * storable.MOST_CHARACTERS}}}),
    ],
)
@pytest.mark.parametrize("kind", ["sqlite"])
def test_a_run_that_cannot_be_stored_is_refused_and_nothing_is_stored(book, unfit):
    with pytest.raises(GradebookError):
        record(book, unfit)
    assert dump(book) == {"students": [], "publications": [], "erasures": []}


def test_a_run_marked_by_another_key_replaces_its_marks(book):
    record(book, graded())
    again = graded("ada", "first", mark(points=1.0, status="partly right"), prose(), key_digest="key 2")
    assert record(book, again, "prof", "The key was wrong.") == 1
    assert book.current("ada") == again
    assert changes(book)[-1] == ("K_s", ("right", 2.0), ("partly right", 1.0))
    assert record(book, again, "prof", "Again.") == 0


MONDAY, TUESDAY = (datetime(2026, 3, day, 12, 0, 0, 250000, tzinfo=UTC) for day in (2, 3))


def handed_in(name="02.ipynb", content=b"{}", received=MONDAY, source="ada.zip", clock=None):
    return Delivery(name, hashlib.sha256(content).hexdigest(), content, received, source, clock, stored=MONDAY)


def test_the_newest_version_of_each_file_counts_and_all_are_stored(book, url):
    first = [handed_in(), handed_in("answers.json", bytes(range(256)) * 64), handed_in("own/helper.py", b"")]
    later = handed_in(content=b"{ }", received=TUESDAY, source="ada (1).zip")
    assert book.deliver("ada", first) == 3
    assert book.deliver("ADA ", [later]) == 1
    with Gradebook(url) as again:
        assert again.delivered("Ada") == [later, *first[1:]]
    kept = dump(book)["students"][0]["deliveries"]
    assert [one["source"] for one in kept] == ["ada.zip", "ada (1).zip", "ada.zip", "ada.zip"]


def test_the_newest_version_is_the_one_received_last_and_of_equal_times_the_one_stored_last(book):
    book.deliver("ada", [handed_in(content=content, received=TUESDAY) for content in (b"one", b"other")])
    book.deliver("ada", [handed_in(content=b"earlier, and comes to us later")])
    assert book.delivered("ada") == [handed_in(content=b"other", received=TUESDAY)]


def test_the_same_file_of_the_same_time_is_stored_once(book):
    book.deliver("ada", [handed_in()])
    before = dump(book)
    east = timezone(timedelta(hours=5))
    assert book.deliver("ada", [handed_in(), handed_in(received=MONDAY.astimezone(east), source="again.zip")]) == 0
    assert dump(book) == before
    assert book.deliver("ada", [handed_in(received=TUESDAY)]) == 1  # the same again, at another time
    assert book.deliver("bob", [handed_in()]) == 1


def test_a_notebook_has_the_time_at_which_its_present_content_was_received_first(book):
    """The same once more, later, has the time of the first; so has a version of before that came back."""
    tuesday, later = TUESDAY, TUESDAY + timedelta(days=1)
    book.deliver("ada", [handed_in(), handed_in("03.ipynb"), handed_in("data.csv")])
    book.deliver("ada", [handed_in(received=tuesday), handed_in("03.ipynb", b"other", tuesday)])
    assert book.received("ADA") == {"02.ipynb": Arrival(MONDAY), "03.ipynb": Arrival(tuesday)}
    book.deliver("ada", [handed_in("03.ipynb", received=later)])
    assert book.received("ada")["03.ipynb"] == Arrival(MONDAY)
    book.deliver("bob", [handed_in(received=later), handed_in(received=tuesday)])
    assert book.received("bob") == {"02.ipynb": Arrival(tuesday)} and book.received("nobody") == {}


NAME = "the time in its name"


@pytest.mark.parametrize(
    ("earlier", "later", "counts"),
    [
        ((MONDAY, NAME), (TUESDAY, NAME), (MONDAY, NAME)),  # the same content once more makes nothing late
        ((MONDAY, ""), (TUESDAY, NAME), (TUESDAY, NAME)),
        ((MONDAY, None), (TUESDAY, NAME), (TUESDAY, NAME)),
        ((TUESDAY, NAME), (MONDAY, ""), (TUESDAY, NAME)),
        ((MONDAY, NAME), (TUESDAY, DECIDED), (TUESDAY, DECIDED)),
        ((TUESDAY, DECIDED), (MONDAY, ""), (MONDAY, "")),  # the decision was taken back
        ((MONDAY, ""), (MONDAY, NAME), (MONDAY, NAME)),
    ],
)
def test_another_time_replaces_a_time_that_cannot_be_trusted(book, earlier, later, counts):
    for received, evidence in (earlier, later):
        book.deliver("ada", [handed_in(received=received, clock=evidence)])
    assert book.received("ada") == {"02.ipynb": Arrival(*counts)}


@pytest.mark.parametrize("clocks", [("", NAME), (NAME, "")])
def test_the_time_that_can_be_trusted_counts_for_the_same_content_from_two_places(book, clocks):
    for source, received, evidence in zip("ab", (MONDAY, TUESDAY), clocks, strict=True):
        book.deliver("ada", [handed_in(received=received, source=source, clock=evidence)])
    assert book.received("ada")["02.ipynb"].clock == NAME


@pytest.mark.parametrize("kind", ["sqlite"])
def test_a_file_that_is_too_large_is_refused_by_name(book, monkeypatch):
    monkeypatch.setattr(storable, "MOST_BYTES", 10)
    with pytest.raises(GradebookError, match=r"02\.ipynb.* 11 .* 10"):
        book.deliver("ada", [handed_in("a", b""), handed_in(content=b"x" * 11)])
    assert book.students() == []
    assert book.deliver("ada", [handed_in(content=b"x" * 10)]) == 1


def test_a_persons_mark_holds_while_the_answer_is_the_same(book):
    record(book, graded())
    assert book.set_mark("ADA", "2.12", "why", 2.5, reason="Nearly.", actor="prof") == 1
    given = prose(points=2.5, status=Status.BY_A_PERSON, reason="Nearly.")
    assert book.current("ada").marks == (mark(), given)
    assert record(book, graded()) == 0
    assert record(book, graded(key_digest="key 2")) == 0
    assert record(book, graded("ada", "second")) == 0
    assert book.current("ada").marks == (mark(), given)
    assert changes(book, question="2.12")[1:] == [("why", ("for a person", 0.0), (Status.BY_A_PERSON, 2.5))]


def test_another_answer_waits_again_and_the_audit_trail_says_so(book):
    record(book, graded())
    book.set_mark("ada", "2.12", "why", 2.5, reason="Nearly.", actor="prof")
    record(book, graded("ada", "second", mark(), prose("It does not.")))
    assert book.current("ada").marks[1] == prose("It does not.")
    assert book.audit()[-1].reason == f"Graded. {store.NO_LONGER}"
    record(book, graded())  # what the person read
    assert book.current("ada").marks[1].points == 2.5
    assert changes(book, question="2.12")[-1] == ("why", ("for a person", 0.0), (Status.BY_A_PERSON, 2.5))


@pytest.mark.parametrize(
    ("first", "given"),
    [
        ("Because it bends.", "Because it\n\n  bends. "),
        ("Because it bends.", "\tBecause\u00a0it bends.\r\n"),
        ("F\u00fcr immer.", "Fu\u0308r immer."),
    ],
)
def test_a_persons_mark_holds_if_only_white_space_or_composition_of_accents_changes(book, first, given):
    record(book, graded("ada", "first", mark(), prose(first)))
    book.set_mark("ada", "2.12", "why", 2.5, reason="Nearly.", actor="prof")
    record(book, graded("ada", "second", mark(), prose(given)))
    kept = book.current("ada").marks[1]
    assert (kept.points, kept.status) == (2.5, Status.BY_A_PERSON)
    assert kept.given == storable.text(given)  # as it was handed in last
    assert book.current("ada").lapsed == ()
    assert book.set_mark("ada", "2.12", "why", 2.5, reason="Nearly.", actor="prof") == 0


def test_a_lapsed_mark_is_returned_with_who_gave_it_and_when(book):
    record(book, graded())
    before = clock.now()
    book.set_mark("ada", "2.12", "why", 2.5, reason="Nearly.", actor="prof")
    after = clock.now()
    record(book, graded("ada", "second", mark(), prose("It does not.")))
    (lapsed,) = book.current("ada").lapsed
    assert lapsed.mark == prose(points=2.5, status=Status.BY_A_PERSON, reason="Nearly.")
    assert lapsed.actor == "prof" and before <= lapsed.when <= after
    read, before = book.current("ada"), dump(book)
    assert record(book, read) == 0 and dump(book) == before
    book.set_mark("ada", "2.12", "why", 1.0, reason="Hm.", actor="prof")
    assert book.current("ada").lapsed == ()


def test_a_second_marker_learns_who_was_first_and_changes_nothing(book):
    record(book, graded())
    seen = book.current("ada").marks[1]
    assert book.set_mark("ada", "2.12", "why", 2.5, reason="Nearly.", actor="anna", expected=seen) == 1
    before = dump(book)
    with pytest.raises(GradebookError, match=r"2\.12, why.*ada.*anna.*Nearly.*--expect 2\.5"):
        book.set_mark("ada", "2.12", "why", 1.0, reason="No.", actor="ben", expected=seen)
    assert dump(book) == before
    assert (
        book.set_mark("ada", "2.12", "why", 2.5, reason="Nearly.", actor="anna", expected=seen) == 0
    )  # the same once more
    assert (
        book.set_mark("ada", "2.12", "why", 1.0, reason="No.", actor="ben", expected=book.current("ada").marks[1]) == 1
    )


def test_one_of_two_markers_at_once_is_refused(url):
    with Gradebook(url) as book:
        record(book, graded())
        seen = book.current("ada").marks[1]
    together = threading.Barrier(2)

    def give(points):
        with Gradebook(url) as own:
            together.wait(30)
            try:
                return own.set_mark(
                    "ada", "2.12", "why", points, reason="Read.", actor=f"tutor {points}", expected=seen
                )
            except GradebookError as error:
                return str(error)

    with ThreadPoolExecutor(2) as pool:
        outcomes = list(pool.map(give, (1.0, 2.0)))
    (told,) = [one for one in outcomes if one != 1]
    with Gradebook(url) as book:
        kept = book.current("ada").marks[1].points
    assert f"{kept:g} point" in told and f"tutor {kept}" in told


def test_a_persons_mark_lapses_when_the_possible_points_change(book):
    record(book, graded())
    book.set_mark("ada", "2.12", "why", 2.5, reason="Nearly.", actor="prof")
    record(book, graded("ada", "first", mark(), replace(prose(), out_of=1.0)), "prof", "Fewer points.")
    assert book.current("ada").marks[1].status == "for a person"


@pytest.mark.parametrize("kind", ["sqlite"])
@pytest.mark.parametrize("points", [-0.1, 3.1, float("nan"), float("inf")])
def test_a_person_cannot_give_impossible_points(book, points):
    record(book, graded())
    with pytest.raises(GradebookError, match="0 to 3"):
        book.set_mark("ada", "2.12", "why", points, reason="", actor="prof")
    assert len(book.audit()) == 2


@pytest.mark.parametrize("kind", ["sqlite"])
def test_a_mark_needs_a_student_a_run_and_a_part(book, tmp_path):
    roster = tmp_path / "roster.csv"
    roster.write_text("student\nbob\n")
    book.import_roster(roster)
    record(book, graded())
    for student, part, said in [("eve", "why", "no student 'eve'"), ("bob", "why", "Nothing"), ("ada", "?", "no mark")]:
        with pytest.raises(GradebookError, match=said):
            book.set_mark(student, "2.12", part, 1, reason="", actor="prof")


def test_recording_marks_that_were_read_earlier_keeps_a_persons_newer_mark(book):
    record(book, graded())
    book.set_mark("ada", "2.12", "why", 2.5, reason="Nearly.", actor="prof")
    read, before = book.current("ada"), dump(book)
    assert record(book, read) == 0
    assert dump(book) == before  # with what the software said of it
    book.set_mark("ada", "2.12", "why", 3.0, reason="Quite.", actor="prof")
    assert record(book, replace(read, marks=(mark(points=1.0), read.marks[1])), "regrade") == 1
    assert [one.points for one in book.current("ada").marks] == [1.0, 3.0]


HOSTILE = "NUL \0, half a pair \ud800, \x1b[2Jcleared, \x9b, é\r\nand\rmore\t=1+1 <b> '; DROP TABLE marks; -- %s :x {0}"
CLEANED = (
    "NUL \\x00, half a pair \\ud800, \\x1b[2Jcleared, \\x9b, é\nand\nmore\t=1+1 <b> '; DROP TABLE marks; -- %s :x {0}"
)


def test_hostile_text_is_cleaned_for_databases_and_terminals(book):
    texts = ("master", "software", "isolation", "key_digest", "release")
    run = dict.fromkeys(texts, HOSTILE) | {"notes": (HOSTILE,), "claim": {HOSTILE: [HOSTILE]}, "files": (HOSTILE,)}
    record(book, graded("ada", HOSTILE, mark(HOSTILE, HOSTILE, reason=HOSTILE, given=HOSTILE), **run))
    kept = book.current("ada")
    book.set_mark("ada", kept.marks[0].question, kept.marks[0].part, 1.0, reason=HOSTILE, actor=HOSTILE)
    book.comment("ada", HOSTILE, actor=HOSTILE, question=HOSTILE)
    assert kept.run.claim == {CLEANED: [CLEANED]} and kept.run.files == (CLEANED,) and kept.run.release == CLEANED
    assert kept.marks[0].given == kept.run.notes[0] == book.comments("ada")[0].text == CLEANED
    assert book.audit()[-1].reason == book.audit(question=HOSTILE)[-1].actor == CLEANED
    assert book.find_made(f"ada {HOSTILE}").run == kept.run


def test_the_dump_is_the_same_on_every_database_and_holds_no_secret(book, undisturbed):
    for one in small_class():
        record(book, one)
    assert dump(book) == undisturbed
    assert [run["key"] for run in undisturbed["students"][1]["runs"]] == ["another key", "bob first"]
    written = json.dumps(dump(book), ensure_ascii=False, allow_nan=False)
    assert book.secret().hex() not in written and str(clock.now().year) not in written


def test_the_secret_is_drawn_once(new_url):
    url = new_url()
    with Gradebook(url) as first, Gradebook(url) as again, Gradebook(new_url()) as other:
        assert first.secret() == again.secret() != other.secret()
        assert len(first.secret()) == len(other.secret()) == 32
