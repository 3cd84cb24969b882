"""rotflex score: what it takes, and what it says."""

import re

import pytest
from checkout import ROOT
from scoring_class import new_class, texts
from typer.testing import CliRunner

from labcourse.grading.gradebook import Gradebook
from labcourse.grading.scoring import start
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
        (("--by", "Ann", "--by", "ANN"), "Two scorers need two names"),
        (("--by", "Ann", "--url", URL), "say who encrypts"),
        (("--by", "Ann", "--proxy", "127.0.0.1"), "Say by --url"),
        (("--by", "Ann", "--url", URL, "--private-key", __file__), "name it, too, by --certificate"),
        (("--by", "Ann", "--url", URL, "--certificate", __file__), "or its private key cannot be used"),
        (("--by", "Ann", "--url", URL, "--certificate", "no.pem"), "No such file"),
        (("--url", URL, "--proxy", "127.0.0.1"), "Nobody has an address yet"),
        *((("--by", name), "value for '--by'") for name in ("A\nB", "Ann\u202e", "A" * 81)),
        (("--new-token", "Ann\u2066", "--url", URL), "value for '--new-token'"),
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
    monkeypatch.setattr(start, "run", lambda app, listener, *tls: served.append(listener.getsockname()))
    names = ("Zoë Müller-Łukasz", "王小明", "O'Brien (2)")
    done = run(marks, *(word for name in names for word in ("--by", f" {name} ")))
    assert done.exit_code == 0
    addresses = dict(line.split(": ", 1) for line in done.output.splitlines()[:3])
    ((host, port),) = served
    assert host == "127.0.0.1" and (*addresses,) == names
    assert all(one.startswith(f"http://127.0.0.1:{port}/enter#") for one in addresses.values())
    assert opened == [addresses[names[0]]] and len({*addresses.values()}) == 3


def test_an_address_for_other_computers_is_shown_once_and_lasts_until_it_is_replaced_or_revoked(marks, monkeypatch):
    opened = []
    monkeypatch.setattr("webbrowser.open", opened.append)
    monkeypatch.setattr(start, "run", lambda app, listener, *tls: None)
    at = ("--url", URL, "--proxy", "127.0.0.1")
    first = run(marks, "--by", "Ann", "--by", "Bea", *at).output
    (of_ann,) = re.findall(rf"^Ann: {URL}/enter#([\w-]{{43}})$", first, re.M)
    assert f"Bea: {URL}/enter#" in first and f"The page is {URL}/." in first
    again = run(marks, "--by", "ANN", "--by", "Cid", *at).output
    assert "Ann has an address" in again and "Bea has an address" in again and f"Cid: {URL}/enter#" in again
    assert again.count("/enter#") == 1
    assert run(marks, "--revoke", "Bea").output.startswith("Bea's address has ended.")
    replaced = run(marks, "--new-token", "Ann", "--url", URL).output
    (new,) = re.findall(rf"^Ann: {URL}/enter#([\w-]{{43}})$", replaced, re.M)
    assert new != of_ann
    last = run(marks, *at).output
    assert "/enter#" not in last and "Bea" not in last and "Ann has an address" in last
    with Gradebook(marks / GRADEBOOK_FILE) as book:
        assert [token.actor for token in book.tokens.valid()] == ["Cid", "Ann"]
        assert book.tokens.find(Scorer("Ann", of_ann).digest).revoked is not None
        assert book.tokens.find(Scorer("Ann", new).digest).is_valid
    assert opened == []


def test_no_address_is_revoked_if_a_new_one_cannot_be_made_or_the_other_way_round(marks):
    run(marks, "--new-token", "Ann", "--url", URL)
    assert run(marks, "--revoke", "Ann", "--new-token", "Bea").exit_code == 2
    assert run(marks, "--revoke", "Cid", "--new-token", "Bea", "--url", URL).exit_code == 2
    with Gradebook(marks / GRADEBOOK_FILE) as book:
        assert [token.actor for token in book.tokens.valid()] == ["Ann"]


@pytest.mark.parametrize("answer", ["", "\n", "y\n"])
def test_for_others_nothing_is_served_unless_the_host_is_said_to_serve_nothing_else(marks, monkeypatch, answer):
    served = []
    monkeypatch.setattr(start, "run", lambda *about: served.append(about))
    at = ("--by", "Ann", "--url", URL, "--proxy", "127.0.0.1")
    done = run(marks, *at, answer=answer)
    with Gradebook(marks / GRADEBOOK_FILE) as book:
        assert (done.exit_code, served, book.tokens.valid()) == (2, [], [])
    assert f"the host of {URL} serves nothing but this page" in done.output
    assert run(marks, *at, answer=" YES \n").exit_code == 0 and len(served) == 1
    assert run(marks, "--by", "Ann", "--url", "http://localhost:9000", answer="").exit_code == 0 and len(served) == 2
