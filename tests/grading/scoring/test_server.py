"""The scoring page without a browser: who is let in, what an act may say, and that a student's text is only text."""

import re

import pytest
from gradebooks import graded, mark, prose, record, report_text
from pages_harm import HOSTILE, harm
from scoring_class import WORDS, Client, clients, desk, fill, shown, texts

from labcourse.grading.gradebook import Gradebook
from labcourse.grading.scoring.guards import MOST_BYTES, POLICY, TOKEN_HEADER

SENT = {"question": WORDS[0], "part": WORDS[1]}


@pytest.fixture
def book(tmp_path):
    with Gradebook(tmp_path / "gradebook.sqlite") as made:
        fill(made, texts(4))
        yield made


@pytest.fixture
def both(book):
    return clients(desk(book), "Ann", "Bea")


@pytest.fixture
def ann(both):
    return both[0]


def test_nobody_is_let_in_without_their_own(both):
    ann, bea = both
    cookie = f"labcourse-score-8765={ann.scorer.digest}; HttpOnly; Path=/; SameSite=strict"
    assert ann.sign_in(ann.scorer.token).headers["set-cookie"] == cookie  # which scripts do not see
    nobody = Client(ann.app)
    stranger = Client(ann.app, cookies={"labcourse-score-8765": ann.scorer.token})
    for path in ("/", "/score?question=2.11&part=explanation", "/scoring.js", "/scoring.css", "/drawn.css"):
        assert ann.get(path).status_code == 200
        for one in (nobody, stranger):
            reply = one.get(path)
            assert (reply.status_code, "Open that address again" in reply.text) == (403, True)
    for token in ("", "x" * 43, ann.scorer.digest):
        assert nobody.sign_in(token).status_code == 403
    for path in (f"/enter/{ann.scorer.token}", f"/?token={ann.scorer.token}", f"/?{TOKEN_HEADER}={ann.scorer.token}"):
        assert nobody.get(path, referer=f"{ann.home}/enter#{ann.scorer.token}").status_code == 403
    for path in ("/enter", "/enter.js"):  # these two exchange an address for a cookie
        assert (reply := nobody.get(path)).status_code == 200 and "set-cookie" not in reply.headers
    assert nobody.act("next", SENT).status_code == 403
    for path in ("/", "/score?question=2.11&part=explanation"):
        for scorer, other in ((ann, "Bea"), (bea, "Ann")):
            header = re.search(r"<header>.*?</header>", scorer.get(path).text, re.S)[0]
            assert re.search(rf"You are <strong[^>]*>{scorer.scorer.name}</strong>", header) and other not in header


def test_cookies_of_other_programs_lock_nobody_out(ann):
    """A browser sends them along, for it does not tell ports apart; in any order."""
    own = f"labcourse-score-8765={ann.scorer.digest}"
    for other in ('x={"a": 1}', "foo", "a b=c", "name=Zoë", "=", "labcourse-score-8766=" + "x" * 43):
        for cookie in (f"{other}; {own}", f"{own}; {other}"):
            assert "You are <strong>Ann</strong>" in ann.request("GET", "/", {"cookie": cookie.encode()}).text
        stranger = f"{other}; labcourse-score-8765={'x' * 43}"
        assert ann.request("GET", "/", {"cookie": stranger.encode()}).status_code == 403


def test_a_host_name_other_than_localhost_is_refused_also_with_the_right_cookie(ann):
    hosts = ["", "example.com:8765", "localhost.example.com", "localhost:x", "localhost.", "127.0.0.2:8765"]
    for host in (*hosts, "0.0.0.0:8765", "x@localhost:8765", "localhost:8765,example.com"):
        sent = {"host": host, "origin": f"http://{host}"}
        for reply in (ann.get("/", host=host), ann.sign_in(ann.scorer.token, **sent), ann.act("next", SENT, **sent)):
            assert reply.status_code == 421, host


def test_a_page_that_a_page_of_another_origin_opens_is_refused(ann):
    """Another port of the host is the same site, so that the cookie is sent."""
    for site, code in (("none", 200), ("same-origin", 200), ("same-site", 403), ("x", 403)):
        assert ann.get("/class", **{"sec-fetch-site": site}).status_code == code
        assert ann.get("/enter", **{"sec-fetch-site": site}).status_code == 200  # as from an e-mail


def test_a_form_and_an_act_without_the_scorers_own_token_are_refused(both, book):
    ann, bea = both
    card = shown(ann.act("next", SENT))
    for word in (None, "", "x", bea.scorer.token, ann.scorer.digest):
        reply = ann.act("give", {**SENT, "answers": card, "level": 4}, **{TOKEN_HEADER: word})
        assert (reply.status_code, "Nothing was done" in reply.json()["problem"]) == (403, True)
    headers = {"origin": "http://127.0.0.1:8765", TOKEN_HEADER: ann.scorer.token}
    assert ann.request("POST", "/act/give", headers, data={"level": "4"}).status_code == 415
    assert [ann.get("/act/give").status_code, ann.request("DELETE", "/", headers).status_code] == [405, 405]
    assert book.scores.acts() == []


def test_a_service_at_another_port_finds_no_token_in_what_the_cookie_opens(ann):
    for path in ("/", "/score?question=2.11&part=explanation", "/acts.js", "/class"):
        assert ann.scorer.token not in ann.get(path).text + str(ann.get(path).headers)


def test_each_answer_of_the_server_has_the_headers(ann):
    replies = [
        ann.get("/"),
        ann.get("/nothing"),
        ann.act("next", SENT),
        Client(ann.app).get("/"),
        ann.get("/", host="x"),
    ]
    assert [one.status_code for one in replies] == [200, 404, 200, 403, 421]
    for one in replies:
        assert one.headers["content-security-policy"] == POLICY
        assert one.headers["cache-control"] == "no-store"
        assert one.headers["referrer-policy"] == "no-referrer"
        assert one.headers["x-content-type-options"] == "nosniff"
    assert "unsafe" not in POLICY and "http" not in POLICY


ONE = {**SENT, "answers": [{"key": "a", "seen": "b"}]}


NO_ACTS = [
    [],
    {**SENT, "answers": [], "level": 4},
    {**SENT, "answers": [{"key": 1, "seen": 2}], "level": 4},
    {**SENT, "answers": "x" * MOST_BYTES, "level": 3},
    {**ONE, "part": "", "level": 4},
    *({**ONE, **given} for given in ({}, {"level": 5}, {"level": True}, {"points": 10**400})),
    {**ONE, "level": 3, "points": 1},
    *({**ONE, "level": 3, **many} for many in ({"answers": ONE["answers"] * 51}, {"shown": ["a"] * 51})),
    {**ONE, "level": 3, "remark": "x" * 2001},
]


def test_an_act_that_no_page_sends_is_refused_with_a_reason(ann, book):
    for sent in NO_ACTS:
        reply = ann.act("give", sent)
        assert 400 <= reply.status_code < 500 and reply.json()["problem"], sent
    assert book.scores.acts() == []


def test_no_json_an_unknown_act_and_too_many_points_are_refused(ann, book):
    headers = {"origin": "http://127.0.0.1:8765", TOKEN_HEADER: ann.scorer.token, "content-type": "application/json"}
    for body in (b"{", b"\xff", b"[" * 20_000, b'{"points": NaN, "question": "2.11", "part": "explanation"}'):
        assert ann.request("POST", "/act/give", headers, content=body).status_code == 400
    assert ann.act("erase", SENT).status_code == 404
    card = shown(ann.act("next", SENT))
    for points in (1.1, -0.1):
        reply = ann.act("give", {**SENT, "answers": card, "points": points})
        assert "give 0 to 1 points" in reply.json()["message"]
    assert book.scores.acts() == []


def test_what_changes_is_the_servers_and_a_students_text_is_text(tmp_path):
    with Gradebook(tmp_path / "other.sqlite") as book:
        for n, text in enumerate(HOSTILE):
            record(book, graded(f"h{n}", mark(given=text, reason=text), prose(given=text), report_text()))
        (ann,) = clients(desk(book, names=True), text_name := '<b onclick="x">Ann</b>')
        assert text_name not in ann.get("/").text
        while card := shown(ann.act("next", SENT)):
            reply = ann.act("next", {**SENT, "key": card[0]["key"]}).json()
            assert harm(reply["html"]) == []
            assert "\u202e" not in reply["html"]
            ann.act("give", {**SENT, "answers": card, "level": 3, "remark": "<script>alert(1)</script>"})
        assert len(book.scores.acts()) == len(HOSTILE)
        own = re.sub(r'<link rel="stylesheet" href="\w+\.css">', "", ann.get("/").text)
        assert harm(own) == []


def test_names_are_nowhere_unless_they_are_asked_for(ann):
    reply = ann.act("next", SENT)
    assert re.search(r"Answer \d", reply.text)
    assert "student-" not in reply.text + ann.get("/").text


def test_what_is_asked_stands_on_the_first_page_until_it_is_decided(both):
    ann, bea = both
    card = shown(ann.act("next", SENT))
    ann.act("ask", {**SENT, "answers": card, "remark": "Is that <right>?"})
    page = bea.get("/").text
    assert "Is that &lt;right&gt;?" in page
    link = re.search(r'href="(score\?[^"]*key=\w+)"', page)[1].replace("&amp;", "&")
    assert f'data-key="{card[0]["key"]}"' in bea.get(f"/{link}").text
    found = bea.act("next", {**SENT, "key": card[0]["key"]})
    assert "Ann asked the instructor" in found.text
    bea.act("give", {**SENT, "answers": shown(found), "level": 2})
    assert "For the instructor" not in bea.get("/").text


def test_after_a_part_is_done_the_next_is_offered(ann):
    while card := shown(reply := ann.act("next", SENT)):
        ann.act("give", {**SENT, "answers": card, "level": 4})
    assert "All of this part is scored" in reply.json()["html"]
    assert "question=2.16&amp;part=comparison" in reply.json()["html"]


def test_a_slip_in_the_points_leaves_the_answer_there_with_what_was_typed(ann, book):
    (card,) = shown(ann.act("next", SENT))
    ann.act("next", {**SENT, "skip": card["key"]})
    ann.act("next", {**SENT, "key": card["key"]})  # by its link: in turn it is another's
    typed = {**SENT, "answers": [card], "remark": "Which <way>?", "points": 10}
    reply = ann.act("give", typed)
    assert (reply.json()["trouble"], "give 0 to 1 points, not 10" in reply.json()["message"]) == (True, True)
    assert "replaces" not in reply.json()["message"]
    assert (shown(reply), remark(reply), points(reply)) == ([card], "Which &lt;way&gt;?", "10")
    assert book.scores.acts() == []
    reply = ann.act("give", {**typed, "points": 0.6})
    assert [(act.points, act.remark) for act in book.scores.acts()] == [(0.6, "Which <way>?")]
    assert card["key"] not in [one["key"] for one in shown(reply)]
    assert (remark(reply), points(reply)) == ("", "")


def test_who_comes_second_keeps_the_remark_sees_what_is_there_and_can_replace_it(both, book):
    ann, bea = both
    (card,) = shown(ann.act("next", SENT))
    bea.act("next", {**SENT, "key": card["key"]})
    ann.act("give", {**SENT, "answers": [card], "level": 4})
    for act, more in (("give", {"level": 0}), ("ask", {})):
        reply = bea.act(act, {**SENT, "answers": [card], "remark": "It bends.", **more})
        message = reply.json()["message"]
        assert "Ann gave it level 4" in message and "student-" not in message
        assert message.endswith("what you give replaces that, s leaves it.")
        (now,) = shown(reply)
        assert (now["key"], now["seen"] != card["seen"], remark(reply)) == (card["key"], True, "It bends.")
        assert '<p class="now">Ann gave it level 4' in reply.json()["html"]
    assert len(book.scores.acts()) == 1
    left = bea.act("next", {**SENT, "skip": card["key"]})
    assert card["key"] not in [one["key"] for one in shown(left)]
    bea.act("give", {**SENT, "answers": [now], "level": 1, "remark": "It bends."})
    assert [(act.actor, act.level) for act in book.scores.acts()] == [("Ann", 4), ("Bea", 1)]


EQUAL = ["It bends for there is friction in the joint", "it bends, for there is friction in the joint."] * 2


def ticks(reply):
    card = r'data-key="(\w+)".*?<input type="checkbox"( checked)? class="tick">'
    return {key: bool(on) for key, on in re.findall(card, reply.json()["html"], re.S)}


def remark(reply):
    return re.search(r"<textarea[^>]*>(.*?)</textarea>", reply.json()["html"], re.S)[1]


def points(reply):
    return re.search(r'<input id="points"[^>]* value="([^"]*)">', reply.json()["html"])[1]


def test_undo_brings_back_what_was_ticked_and_the_remark(tmp_path):
    with Gradebook(tmp_path / "equal.sqlite") as book:
        fill(book, EQUAL[:3])
        ann, bea = clients(desk(book), "Ann", "Bea")
        first, left_out, third = shown(ann.act("next", SENT))
        wrong = ann.act("give", {**SENT, "answers": [first], "shown": [first["key"], third["key"]], "points": 7})
        assert ticks(wrong) == {first["key"]: True, third["key"]: False} and book.scores.acts() == []
        ann.act("give", {**SENT, "answers": [first, third], "level": 4, "remark": "Which <way>?"})
        back = ann.act("undo", SENT)
        assert "Taken back: Answer" in back.json()["message"]
        assert ticks(back) == {first["key"]: True, third["key"]: True}
        assert remark(back) == "Which &lt;way&gt;?"
        ann.act("leave", SENT)
        other = bea.act("next", SENT)
        assert (list(ticks(other).values()), remark(other)) == ([True] * 3, "")
        bea.act("leave", SENT)
        again = ann.act("give", {**SENT, "answers": [first, third], "level": 3})
        assert (ticks(again), remark(again)) == ({left_out["key"]: True}, "")
        assert [act.level for act in book.scores.acts() if act.undoes is None] == [4, 4, 3, 3]


def test_of_two_who_open_one_question_to_the_instructor_the_second_is_told(both):
    ann, bea = both
    (card,) = shown(ann.act("next", SENT))
    ann.act("ask", {**SENT, "answers": [card]})
    ann.act("leave", SENT)
    assert "has it open" not in ann.get("/").text
    opened = {**SENT, "key": card["key"]}
    assert bea.act("next", opened).json()["message"] == ""
    assert "<strong>Bea has it open.</strong>" in ann.get("/").text
    told = ann.act("next", opened).json()
    assert (told["message"], told["trouble"]) == ("Bea is reading this one, too, and had it before you.", True)
    assert "Bea is reading" in ann.act("renew", opened).json()["message"]
    assert bea.act("renew", opened).json()["message"] == ""  # it stays hers
    bea.act("leave", SENT)
    assert ann.act("renew", opened).json()["message"] == ""
    assert "<strong>Ann has it open.</strong>" in bea.get("/").text


def test_what_is_with_the_instructor_is_not_called_scored(both):
    ann, bea = both
    for n in range(4):
        reply = ann.act("ask" if n < 3 else "give", {**SENT, "answers": shown(ann.act("next", SENT))} | {"level": 4})
        if n == 2:
            waiting = bea.act("next", SENT).json()["html"]
            assert "1 answer waits" in waiting
    page = reply.json()["html"]
    assert "3 answers" in page and "part is scored" not in page
