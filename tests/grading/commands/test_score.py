"""rotflex score: what it takes, what it says, and scores by a table."""

import csv
import re

import pytest
from checkout import ROOT
from scoring_class import WORDS, new_class, texts
from typer.testing import CliRunner

from labcourse.grading.gradebook import Gradebook
from labcourse.grading.scoring import server
from labcourse.grading.scoring.guards import Scorer
from labcourse.student_id import GRADEBOOK_FILE
from rotflex.cli import app

URL = "https://marks.school.edu"


@pytest.fixture
def marks(tmp_path):
    (tmp_path / "marks").mkdir()
    return new_class(tmp_path / "marks", texts(3))


def run(marks, *words, answer="yes\n"):
    words = ["score", str(marks), "--solutions", str(ROOT / "solutions"), *map(str, words)]
    return CliRunner().invoke(app, words, input=answer)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ((), "Say who scores: --by NAME"),
        (("--by", " "), "Say who scores: --by NAME"),
        (("--by", "Ann", "--by", "ANN"), "Two scorers need two names"),
        (("--read", "x.csv"), "Say who scored in the table"),
        (("--read", "x.csv", "--by", "Ann"), "x.csv cannot be read"),
        (("--read", "x.csv", "--write", "x.csv"), "not both at once"),
        (("--write", "x.txt"), "ends in .xlsx or .csv"),
        (("--by", "Ann", "--url", "http://marks.school.edu"), "is not encrypted"),
        (("--by", "Ann", "--url", URL), "say who encrypts"),
        (("--by", "Ann", "--proxy", "127.0.0.1"), "Say by --url"),
        (("--by", "Ann", "--url", URL, "--private-key", __file__), "name it, too, by --certificate"),
        (("--by", "Ann", "--url", URL, "--certificate", __file__), "or its private key cannot be used"),
        (("--by", "Ann", "--url", URL, "--certificate", "no.pem"), "No such file"),
        (("--url", URL, "--proxy", "127.0.0.1"), "Nobody has an address yet"),
        (("--by", "Ann", "--url", f"{URL}/lab", "--proxy", "127.0.0.1"), "a host of its own"),
        *((("--by", name), "value for '--by'") for name in ("A\nB", "A\x1b[2J", "Ann\u202e", "A\u200bn", "A" * 81)),
        (("--new-token", "Ann\u2066", "--url", URL), "value for '--new-token'"),
        (("--new-token", "Ann"), "by --url"),
        (("--new-token", " ", "--url", URL), "Name the assistant"),
        (("--revoke", "Ann"), "Ann has no address. These have one: nobody"),
    ],
)
def test_what_is_missing_is_told(marks, words, said):
    done = run(marks, *words)
    assert done.exit_code == 2
    assert said in str(done.exception or "") + done.output
    with Gradebook(marks / GRADEBOOK_FILE) as book:
        assert book.tokens.valid() == []


def test_each_has_an_address_and_the_first_a_browser(marks, monkeypatch):
    opened, served = [], []
    monkeypatch.setattr("webbrowser.open", opened.append)
    monkeypatch.setattr(server, "serve", lambda app, listener, *tls: served.append(listener.getsockname()))
    done = run(marks, "--by", "Ann", "--by", "Bea")
    assert done.exit_code == 0
    ann, bea, _hint = done.output.splitlines()
    ((host, port),) = served
    assert host == "127.0.0.1"
    assert ann.startswith(f"Ann: http://127.0.0.1:{port}/enter#")
    assert bea.startswith(f"Bea: http://127.0.0.1:{port}/enter#")
    assert opened == [ann.partition(": ")[2]]
    assert ann.rpartition("#")[2] != bea.rpartition("#")[2]


def test_an_address_for_other_computers_is_shown_once_and_lasts_until_it_is_replaced_or_revoked(marks, monkeypatch):
    opened = []
    monkeypatch.setattr("webbrowser.open", opened.append)
    monkeypatch.setattr(server, "serve", lambda app, listener, *tls: None)
    at = ("--url", URL, "--proxy", "127.0.0.1")
    first = run(marks, "--by", "Ann", "--by", "Bea", *at).output
    (of_ann,) = re.findall(rf"^Ann: {URL}/enter#([\w-]{{43}})$", first, re.M)
    assert f"Bea: {URL}/enter#" in first and f"The page is {URL}/." in first
    again = run(marks, "--by", "ANN", "--by", "Cid", *at).output
    assert "Ann has an address" in again and "Bea has an address" in again and f"Cid: {URL}/enter#" in again
    assert again.count("/enter#") == 1
    assert run(marks, "--revoke", "Bea").output.startswith("Bea's address has ended.")
    (new,) = re.findall(
        rf"^Ann: {URL}/enter#([\w-]{{43}})$", run(marks, "--new-token", "Ann", "--url", URL).output, re.M
    )
    assert new != of_ann
    last = run(marks, *at).output
    assert "/enter#" not in last and "Bea" not in last and "Ann has an address" in last
    with Gradebook(marks / GRADEBOOK_FILE) as book:
        assert [token.actor for token in book.tokens.valid()] == ["Cid", "Ann"]
        assert book.tokens.find(Scorer("Ann", of_ann).digest).revoked is not None
        assert book.tokens.find(Scorer("Ann", new).digest).is_valid
    assert opened == []


@pytest.mark.parametrize("answer", ["", "\n", "no\n", "y\n"])
def test_for_other_computers_nothing_is_served_unless_the_host_is_said_to_serve_nothing_else(
    marks, monkeypatch, answer
):
    served = []
    monkeypatch.setattr(server, "serve", lambda *about: served.append(about))
    at = ("--by", "Ann", "--url", URL, "--proxy", "127.0.0.1")
    done = run(marks, *at, answer=answer)
    with Gradebook(marks / GRADEBOOK_FILE) as book:
        assert (done.exit_code, served, book.tokens.valid()) == (2, [], [])
    assert f"the host of {URL} serves nothing but this page" in done.output
    assert run(marks, *at, answer=" YES \n").exit_code == 0 and len(served) == 1
    assert run(marks, "--by", "Ann", "--url", "http://localhost:9000", answer="").exit_code == 0 and len(served) == 2


def test_a_name_may_be_in_any_script(marks, monkeypatch):
    monkeypatch.setattr(server, "serve", lambda app, listener, *tls: None)
    names = ("Zoë Müller-Łukasz", "王小明", "محمد", "O'Brien (2)")
    done = run(marks, *(word for name in names for word in ("--by", f" {name} ")), "--no-browser")
    assert [line.partition(": ")[0] for line in done.output.splitlines()[:4]] == [*names]


def fill_in(path, change):
    with path.open(encoding="utf-8-sig", newline="") as file:
        rows = [row | change(place, row) for place, row in enumerate(csv.DictReader(file))]
    with path.open("w", encoding="utf-8", newline="") as file:
        table = csv.DictWriter(file, rows[0])
        table.writeheader()
        table.writerows(rows)


def test_out_and_in_again(marks, tmp_path):
    path = tmp_path / "scores.csv"
    assert run(marks, "--write", path).output.startswith("6 answers:")
    fill_in(path, lambda place, row: {"level": {0: "3", 1: "7"}.get(place, "")})
    done = run(marks, "--read", path, "--by", "Ann")
    assert done.exit_code == 1
    assert "1 scored, 4 as they were, 1 not taken." in done.output
    assert "Row 3: there is no level '7'" in done.output
    with Gradebook(marks / GRADEBOOK_FILE) as book:
        assert [(act.actor, act.level) for act in book.scores.acts()] == [("Ann", 3)]
    assert "until rotflex report writes them anew" in done.output
    again = run(marks, "--read", path, "--by", "Ann")
    assert "0 scored, 5 as they were, 1 not taken." in again.output
    assert "rotflex report" not in again.output


def test_a_table_that_is_there_is_not_written_over_unasked(marks, tmp_path):
    path = tmp_path / "scores.csv"
    path.write_text("filled in")
    done = run(marks, "--write", path)
    assert done.exit_code == 2
    assert "--force to write over it" in str(done.exception or "") + done.output
    assert path.read_text() == "filled in"
    assert run(marks, "--write", path, "--force").exit_code == 0
    assert path.read_text(encoding="utf-8-sig").startswith('"key",')


def test_a_table_tells_of_questions_and_of_what_it_replaces(marks, tmp_path):
    path = tmp_path / "scores.csv"
    with Gradebook(marks / GRADEBOOK_FILE) as book:
        book.scores.ask("student-000", WORDS, "Bea", remark="Is it?")
        book.scores.give("student-001", WORDS, 0.25, "Bea", level=1)
    said = run(marks, "--write", path).output
    assert "Questions to the instructor: 1." in said
    fill_in(path, lambda place, row: {"level": "4", "points": ""} if row["state"] else {})
    done = run(marks, "--read", path, "--by", "Cid")
    assert done.exit_code == 0
    assert "2 scored, 4 as they were, 0 not taken." in done.output
    assert "Bea gave it level 1" in done.output
