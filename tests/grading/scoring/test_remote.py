"""The scoring page for other computers: by a tunnel, behind a proxy, with a certificate; and tokens that last."""

import contextlib
import re
import shutil
import socket
import sqlite3
import ssl
import subprocess
import sys
import time
from datetime import timedelta

import httpx
import pytest
from browser import free_port
from scoring_class import WORDS, Client, app_of, clients, desk, fill, new_class, serving, shown, texts
from set_clock import set_clock

from labcourse import clock
from labcourse.errors import GradebookError, GradingError
from labcourse.grading.gradebook import Gradebook, database
from labcourse.grading.scoring import guards, start
from labcourse.grading.scoring.guards import POLICY, TOKEN_HEADER, Scorer, Site, WrongTokens
from labcourse.grading.scoring.start import at

SENT = {"question": WORDS[0], "part": WORDS[1]}
URL = "https://marks.school.edu"
PROXY = "10.0.0.2"


@pytest.fixture
def book(tmp_path):
    with Gradebook(tmp_path / "gradebook.sqlite") as made:
        fill(made, texts(4))
        yield made


@pytest.fixture
def ann(book):
    return clients(desk(book), "Ann", site=at(URL, None, encrypts=True))[0]


@pytest.fixture
def behind(book):
    """Somebody behind a proxy on this computer."""
    return clients(desk(book), "Ann", site=at(URL, "127.0.0.1", encrypts=False))[0]


# --- a tunnel ---------------------------------------------------------------------------------------------------------


def test_a_tunnel_may_begin_at_any_port(book):
    (ann,) = clients(desk(book), "Ann")
    home = "http://[::1]:9000"
    far = Client(ann.app, ann.scorer, home).enter()
    assert list(far.cookies) == ["labcourse-score-9000"]  # two tunnels of one browser are two pages
    assert "You are <strong>Ann</strong>" in far.get("/").text
    card = shown(far.act("next", SENT))
    for origin in (None, "null", "http://[::1]:9001", "http://localhost:9000", home.replace("http", "https"), ann.home):
        assert far.act("give", {**SENT, "answers": card, "level": 4}, origin=origin).status_code == 403
        assert far.sign_in(ann.scorer.token, origin=origin).status_code == 403
    assert book.scores.acts() == []
    assert far.act("give", {**SENT, "answers": card, "level": 4}).status_code == 200


# --- an address by TLS ------------------------------------------------------------------------------------------------


def test_beyond_loopback_the_cookie_is_of_this_host_and_of_tls_only(ann):
    cookie = r"__Host-labcourse-score-443=[0-9a-f]{64}; HttpOnly; Path=/; SameSite=strict; Secure"
    reply = ann.sign_in(ann.scorer.token)
    assert re.fullmatch(cookie, reply.headers["set-cookie"])
    page = ann.get("/")
    assert "You are <strong>Ann</strong>" in page.text
    assert (page.headers["content-security-policy"], page.headers["referrer-policy"]) == (POLICY, "no-referrer")
    assert "frame-ancestors 'none'" in POLICY
    other = Client(ann.app, cookies={"labcourse-score-443": ann.scorer.digest})
    assert other.get("/").status_code == 421  # of this computer: it has no way around TLS


def test_beyond_loopback_host_and_origin_are_exactly_those_of_the_address(ann, book):
    card = shown(ann.act("next", SENT))
    act = {**SENT, "answers": card, "level": 4}
    for host in ("localhost", "school.edu", "marks.school.edu:8443", "marks.school.edu.", ""):
        sent = {"host": host, "origin": f"https://{host}"}
        for reply in (ann.get("/", **sent), ann.sign_in(ann.scorer.token, **sent), ann.act("give", act, **sent)):
            assert reply.status_code == 421, host
    for origin in (None, "null", "http://marks.school.edu", "https://school.edu", "https://marks.school.edu:8443"):
        for reply in (ann.act("give", act, origin=origin), ann.sign_in(ann.scorer.token, origin=origin)):
            assert reply.status_code == 403, origin
    assert book.scores.acts() == []
    assert ann.act("give", act).status_code == 200


def test_two_hosts_or_two_origins_in_one_request_are_refused(behind):
    cookie = ("cookie", f"__Host-labcourse-score-443={behind.scorer.digest}")
    host, origin = ("host", "marks.school.edu"), ("origin", "https://marks.school.edu")
    secret = ((TOKEN_HEADER, behind.scorer.token), ("content-type", "application/json"))

    def send(*headers):
        return behind.request("POST", "/act/next", [cookie, *secret, *headers], json=SENT).status_code

    assert send(host, origin) == 200
    assert send(host, ("host", "evil.example"), origin) == 421
    assert send(host, origin, ("origin", "https://evil.example")) == 403
    assert send(host, origin, ("transfer-encoding", "chunked")) == 413


# --- a proxy ----------------------------------------------------------------------------------------------------------


def test_only_the_named_proxy_may_connect(book):
    (ann,) = clients(desk(book), "Ann", site=Site("https", "marks.school.edu", "127.0.0.1"))
    for peer in ("127.0.0.1", "::ffff:127.0.0.1"):
        ann.peer = peer
        assert ann.get("/").status_code == 200
    for peer in (PROXY, "127.0.0.2", "", "::1"):
        ann.peer = peer
        for headers in ({}, {"x-forwarded-for": "127.0.0.1"}):
            assert ann.get("/", **headers).status_code == ann.sign_in(ann.scorer.token, **headers).status_code == 403


def wrong(client, count, **headers):
    return [client.sign_in("x" * 43, **headers).status_code for _ in range(count)]


def test_who_sends_many_wrong_tokens_has_to_wait_and_locks_nobody_out(behind):
    mallory = {"x-forwarded-for": "198.51.100.7"}
    assert wrong(behind, guards.MOST_WRONG, **mallory) == [403] * guards.MOST_WRONG
    reply = behind.sign_in("y" * 43, **mallory)
    assert reply.status_code == 429
    assert 0 < int(reply.headers["retry-after"]) <= 60
    assert re.search(r"Wait \d+ s", reply.json()["problem"])
    stale = Client(behind.app, home=URL, cookies=dict.fromkeys(behind.cookies, "z" * 43))
    assert stale.get("/", **mallory).status_code == 429  # a wrong cookie is a wrong token
    assert wrong(behind, 1, **{"x-forwarded-for": "198.51.100.8"}) == [403]
    assert behind.sign_in(behind.scorer.token, **mallory).status_code == 204
    assert "You are <strong>Ann</strong>" in behind.get("/", **mallory).text


def test_the_sender_is_who_the_proxy_says_last_and_never_who_says_so_without_a_proxy(behind, ann):
    wrong(behind, guards.MOST_WRONG, **{"x-forwarded-for": "198.51.100.7"})
    assert wrong(behind, 1, **{"x-forwarded-for": "203.0.113.1, 198.51.100.7"}) == [429]
    assert wrong(behind, 1, **{"x-forwarded-for": "198.51.100.7, 203.0.113.1"}) == [403]
    assert [wrong(ann, 1, **{"x-forwarded-for": f"203.0.113.{n}"})[0] for n in range(guards.MOST_WRONG + 1)][-1] == 429


def test_wrong_tokens_are_counted_for_a_minute_and_for_few_addresses(monkeypatch):
    now = 100.0
    counted = WrongTokens(lambda: now)
    assert [counted.wait("a") for _ in range(guards.MOST_WRONG)] == [0] * guards.MOST_WRONG
    now = 130.0
    assert counted.wait("a") == 30
    now = 170.0
    assert counted.wait("a") == 0
    monkeypatch.setattr(guards, "MOST_ADDRESSES", 3)
    for address in "bcd":
        counted.wait(address)
    assert list(counted._counts) == ["b", "c", "d"]


# --- what --url may be ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("url", "proxy", "encrypts", "message"),
    [
        ("http://marks.school.edu", "127.0.0.1", False, "not encrypted"),
        ("http://127.0.0.1.school.edu", None, False, "not encrypted"),
        ("http://localhost", "127.0.0.1", False, "without --proxy"),
        (URL, None, False, "say who encrypts"),
        (URL, PROXY, False, "A proxy on another computer needs both"),
        (URL, "proxy.school.edu", True, "IP address"),
        *((url, None, True, "give an address") for url in ("marks.school.edu", "ftp://x", "https://", "https://a b")),
        *((f"https://x{rest}", None, True, "host of its own") for rest in ("/lab/", "//", "/.", "?b", "/#b")),
        *((f"https://{host}", None, True, "give an address") for host in ("u:p@x", "prüfung.de", "x:0")),
    ],
)
def test_an_address_that_cannot_be_or_is_not_encrypted_is_refused(url, proxy, encrypts, message):
    with pytest.raises(GradingError, match=message):
        at(url, proxy, encrypts)


@pytest.mark.parametrize(
    ("url", "host", "port"),
    [
        ("https://Marks.School.edu:443/", "marks.school.edu", 443),
        ("https://10.0.0.1:8443", "10.0.0.1:8443", 8443),
        ("https://[2001:db8::1]", "[2001:db8::1]", 443),
        ("http://localhost:9000", "localhost:9000", 9000),
    ],
)
def test_an_address_is_read_as_a_browser_does(url, host, port):
    site = at(url, None, encrypts=url.startswith("https"))
    assert (site.host, site.port) == (host, port)


# --- tokens that last -------------------------------------------------------------------------------------------------


def lasting(book, name="Ann"):
    """A scorer whose token the gradebook has; a server each time."""
    scorer = Scorer(name)
    book.tokens.replace(name, scorer.digest)
    return lambda: Client(app_of(desk(book), at(URL, None, True), book.tokens.find), scorer, URL)


def test_a_token_outlives_the_server_and_the_gradebook_has_only_its_digest(book, tmp_path):
    start = lasting(book)
    first = start().enter()
    card = shown(first.act("next", SENT))
    second = start()  # the page that was open goes on
    second.cookies = first.cookies
    assert second.act("give", {**SENT, "answers": card, "level": 4}).status_code == 200
    stored = (tmp_path / "gradebook.sqlite").read_bytes()
    assert first.scorer.token.encode() not in stored
    assert first.scorer.digest.encode() in stored
    assert start().sign_in(first.scorer.digest).status_code == 403


def test_a_revoked_token_is_refused_at_once_and_the_open_page_says_so(book):
    ann, bea = lasting(book, "Ann")().enter(), lasting(book, "Bea")().enter()
    card = shown(ann.act("next", SENT))
    book.tokens.revoke("ANN")
    for reply in (ann.act("give", {**SENT, "answers": card, "level": 4}), ann.sign_in(ann.scorer.token)):
        assert (reply.status_code, "revoked or replaced" in reply.json()["problem"]) == (403, True)
    assert (ann.get("/").status_code, bea.get("/").status_code) == (403, 200)
    assert book.scores.acts() == []
    with pytest.raises(GradebookError, match=r"Ann has no address\. These have one: Bea"):
        book.tokens.revoke("Ann")


def test_a_new_token_ends_the_former_one_and_a_term_ends_each(book, monkeypatch):
    former, new = lasting(book)(), lasting(book, "ann")()
    assert (former.sign_in(former.scorer.token).status_code, new.enter().get("/").status_code) == (403, 200)
    assert [token.actor for token in book.tokens.valid()] == ["ann"]
    set_clock(monkeypatch, clock.now() + timedelta(days=201))
    reply = new.get("/")
    assert (reply.status_code, "older than 200 days" in reply.text) == (403, True)
    assert book.tokens.valid() == []


def test_a_busy_gradebook_is_a_message_and_the_act_can_be_done_again(tmp_path, monkeypatch):
    monkeypatch.setattr(database, "PATIENCE", 0.05)
    with Gradebook(path := tmp_path / "gradebook.sqlite") as book:
        fill(book, texts(3))
        ann = lasting(book)().enter()
        act = {**SENT, "answers": shown(ann.act("next", SENT)), "level": 4, "remark": "It bends."}
        (bea,) = clients(desk(book), "Bea")
        with contextlib.closing(sqlite3.connect(path, isolation_level=None)) as other:
            for lock in ("IMMEDIATE", "EXCLUSIVE"):  # another writes; another commits, and nobody can even read
                other.execute(f"BEGIN {lock}")
                for scorer in (ann, bea):
                    reply = scorer.act("give", act)
                    said = reply.json()
                    assert "another process has been writing" in said.get("problem", "") + said.get("message", "")
                    assert (reply.status_code, said.get("trouble")) in {(200, True), (503, None)}
                if lock == "EXCLUSIVE":
                    for scorer in (ann, bea):
                        page = scorer.get("/")
                        assert (page.status_code, "another process" in page.text) == (503, True)
                other.execute("ROLLBACK")
        assert book.scores.acts() == []
        ann.act("give", act)
        assert [(one.level, one.remark) for one in book.scores.acts()] == [(4, "It bends.")]


# --- slow and silent clients ------------------------------------------------------------------------------------------

IMPATIENT = """
import asyncio
from labcourse.grading.scoring import start

start.IDLE = 0.5

async def app(scope, receive, send):
    while (await receive()).get("more_body"):
        pass
    if scope["path"] == "/work":
        await asyncio.sleep(2 * start.IDLE)
    await send({"type": "http.response.start", "status": 200, "headers": [(b"content-length", b"0")]})
    await send({"type": "http.response.body"})

with start.listening(0) as listener:
    print(listener.getsockname()[1], flush=True)
    start.run(app, listener)
"""
WHOLE = b"GET / HTTP/1.1\r\nhost: x\r\n\r\n"


@pytest.fixture(scope="module")
def impatient():
    """Connects to a server that waits for 0.5 s in place of 30 s."""
    with subprocess.Popen([sys.executable, "-c", IMPATIENT], stdout=subprocess.PIPE, text=True) as process:
        port = int(process.stdout.readline())
        yield lambda: socket.create_connection(("127.0.0.1", port), timeout=20)
        process.kill()


@pytest.mark.parametrize(
    ("before", "sent"),
    [
        (b"", b""),
        (b"", WHOLE[:-2]),
        (b"", b"POST" + WHOLE[3:-2] + b"content-length: 9\r\n\r\nabc"),
        (WHOLE, WHOLE[:-2]),
    ],
)
def test_a_connection_without_a_whole_request_is_closed(impatient, before, sent):
    assert start.IDLE == 30
    with impatient() as client:
        client.sendall(before)
        assert not before or b"200 OK" in client.recv(1000)
        with contextlib.suppress(ConnectionError):
            client.sendall(sent)
            assert client.recv(1000) == b""


def test_a_request_that_comes_by_drops_is_cut_off(impatient):
    with impatient() as client, pytest.raises(ConnectionError):
        client.sendall(WHOLE[:-2] + b"x: ")
        for _drop in range(1000):
            client.sendall(b"a")
            time.sleep(0.01)


def test_a_request_at_which_the_server_works_for_longer_is_answered(impatient):
    with impatient() as client:
        client.sendall(WHOLE.replace(b"/ ", b"/work "))
        assert b"200 OK" in client.recv(1000)


# --- a certificate ----------------------------------------------------------------------------------------------------


@pytest.mark.skipif(shutil.which("openssl") is None, reason="openssl is not installed (apt-get install openssl)")
def test_with_a_certificate_the_page_is_served_by_tls_and_in_no_other_way(tmp_path):
    certificate, key = tmp_path / "cert.pem", tmp_path / "key.pem"
    kind = ("-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes", "-days", "2")
    names = ("-subj", "/CN=localhost", "-addext", "subjectAltName=DNS:localhost")
    made = ["openssl", "req", *kind, *names, "-keyout", key, "-out", certificate]
    subprocess.run(made, check=True, capture_output=True)
    port = free_port()
    home = f"https://localhost:{port}"
    tls = ("--url", home, "--certificate", certificate, "--private-key", key)
    with serving(new_class(tmp_path, texts(1)), "Ann", options=tls) as (process, (address,)):
        assert address.startswith(f"{home}/enter#")
        assert "shown only this once" in process.stdout.readline()
        assert process.stdout.readline().startswith(f"The page is {home}/.")
        trusted = ssl.create_default_context(cafile=certificate)
        with httpx.Client(verify=trusted) as client:
            sent = {"origin": home, TOKEN_HEADER: address.partition("#")[2]}
            assert client.post(f"{home}/enter", headers=sent).status_code == 204
            assert "You are <strong>Ann</strong>" in client.get(f"{home}/").text
        with pytest.raises(httpx.TransportError):
            httpx.get(f"http://localhost:{port}/")
