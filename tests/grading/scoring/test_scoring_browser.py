"""The scoring page in a browser: by keys alone, two at once, killed in between, with hostile texts, for everybody."""

import contextlib
import http.server
import re
import threading
from itertools import count

import browser
import httpx
import pytest
from accessible import findings
from gradebooks import graded, mark, prose, record, report_text
from scoring_class import WORDS, fill, new_class, serving, texts
from set_clock import set_real_clock

from labcourse.grading.gradebook import Gradebook
from labcourse.grading.scoring.guards import Scorer
from labcourse.student_id import GRADEBOOK_FILE

PART = f"/score?question={WORDS[0]}&part={WORDS[1]}"
QUIET = "() => document.querySelector('#card')?.getAttribute('aria-busy') === 'false'"


class Seat:
    def __init__(self, chromium, address, scheme="light"):
        self.context = chromium.new_context(color_scheme=scheme, viewport={"width": 1280, "height": 720})
        self.page = self.context.new_page()
        self.page.set_default_timeout(browser.PATIENCE)
        self.errors, self.abroad = [], []
        home = address.partition("/enter")[0]
        self.page.on("console", lambda one: self.errors.append(one.text) if one.type == "error" else None)
        self.page.on("pageerror", lambda error: self.errors.append(str(error)))
        self.page.on(
            "request", lambda one: None if one.url.startswith((home, "data:")) else self.abroad.append(one.url)
        )
        enter(self.page, address)
        self.home = home

    def open(self, path=PART):
        self.page.goto(self.home + path)
        self.page.wait_for_function(QUIET)
        return self

    def press(self, key):
        self.page.keyboard.press(key)
        self.page.wait_for_function(QUIET)

    @property
    def keys(self):
        return self.page.eval_on_selector_all(".answer", "all => all.map((one) => one.dataset.key)")

    @property
    def message(self):
        return self.page.inner_text("#message")

    def close(self):
        self.context.close()


def enter(page, address):
    """Open a scorer's address, which is exchanged for a cookie."""
    page.goto(address)
    page.wait_for_selector("main.overview")


def acts(folder):
    with Gradebook(folder / GRADEBOOK_FILE) as book:
        return book.scores.acts()


def test_keys_for_remarks_points_asking_skipping_and_undoing(tmp_path, chromium):
    with serving(new_class(tmp_path, texts(5)), "Ann") as (_process, (address,)):
        seat = Seat(chromium, address).open()
        page = seat.page
        (skipped,) = seat.keys
        seat.press("s")
        seat.press("r")
        page.keyboard.type("Good: 3 of 4 causes? u")  # typed, and no key for the page
        assert len(acts(tmp_path)) == 0
        page.keyboard.press("Escape")
        (first,) = seat.keys
        seat.press("4")
        seat.press("p")
        page.keyboard.type("0,6")
        seat.press("Enter")
        typed = page.locator(".use", has_text="Good: 3 of 4")  # after the rubric's
        seat.press(typed.get_attribute("data-use"))
        seat.press("2")
        seat.press("r")
        page.keyboard.type("Does this count?")
        page.keyboard.press("Control+Enter")
        seat.press("?")
        assert seat.keys == [skipped]
        seat.press("4")
        assert seat.keys == []
        for key in "?430xsrpa":
            page.evaluate("() => say('')")
            seat.press(key)
            assert "There is no answer on this page" in seat.message, key
        seat.press("u")
        assert seat.keys == [skipped]
        assert "Taken back" in seat.message
        page.keyboard.press("h")
        page.keyboard.press("0")  # while the keys are shown, none of them acts
        assert page.is_visible("#help")
        page.keyboard.press("Escape")
        page.keyboard.press("o")
        page.wait_for_selector(".asked")
        assert "Does this count?" in page.inner_text(".asked")
        assert seat.errors == []
        seat.close()
    done = [(act.level, act.points, act.remark, act.asked) for act in acts(tmp_path) if act.undoes is None]
    assert done == [
        (4, 1.0, "Good: 3 of 4 causes? u", False),
        (None, 0.6, "", False),
        (2, 0.5, "Good: 3 of 4 causes? u", False),
        (None, None, "Does this count?", True),
        (4, 1.0, "", False),
    ]
    assert first != skipped


def test_equal_answers_are_scored_together_and_none_that_was_not_in_view(tmp_path, chromium):
    equal = [" ".join(f"The curve of word{n} bends in the model as we saw." for n in range(12))] * 7
    with serving(new_class(tmp_path, equal), "Ann") as (_process, (address,)):
        seat = Seat(chromium, address).open()
        page = seat.page
        assert len(seat.keys) == 7
        page.evaluate("() => { document.querySelector('.answers').style.maxHeight = '150px'; }")
        page.wait_for_timeout(200)
        page.evaluate("() => watch()")  # as if the window had been this low at the beginning
        page.wait_for_timeout(200)
        presses = 0
        while seat.keys and presses < 20:
            seat.press("3")
            presses += 1
            if seat.keys:
                assert "had not been in view" in seat.message
                assert acts(tmp_path) == []
            page.wait_for_timeout(100)
        assert presses > 1
        assert [act.level for act in acts(tmp_path)] == [3] * 7
        seat.press("u")
        assert sorted(seat.keys) == sorted(set(seat.keys))
        assert len(seat.keys) == 7
        seat.press("x")
        seat.press("1")
        assert "level 1" in seat.message
        seat.close()


@pytest.mark.scheduled  # tests/grading/test_crash.py kills a grader at each landing
def test_killed_between_any_two_nothing_is_lost(tmp_path, chromium):
    new_class(tmp_path, texts(7))
    given = []
    for n in count():
        with serving(tmp_path, "Ann") as (process, (address,)):
            seat = Seat(chromium, address).open()
            if not seat.keys:
                seat.close()
                break
            for level in "31"[: 1 + n % 2]:
                if seat.keys:
                    seat.press(level)
                    given.append(int(level))
            process.kill()
            process.wait()
            if seat.keys:  # a key that comes too late is told, and not lost on the quiet
                seat.press("4")
                assert "does not answer" in seat.message
            seat.close()
        assert [act.level for act in acts(tmp_path)] == given
    assert len({act.student for act in acts(tmp_path)}) == len(given) == 7


def test_two_at_once_never_read_the_same_and_overwrite_nothing_unseen(tmp_path, chromium):
    with serving(new_class(tmp_path, texts(10)), "Ann", "Bea") as (_process, addresses):
        ann, bea = (Seat(chromium, address).open() for address in addresses)
        assert "Bea" in bea.context.new_page().goto(bea.home + "/").text()
        for _turn in range(4):
            assert not set(ann.keys) & set(bea.keys)
            ann.press("4")
            bea.press("0")
        # Bea opens what Ann has before her; both decide.
        (key,) = ann.keys
        bea.open(f"{PART}&key={key}")
        assert bea.keys == [key]
        ann.press("4")
        bea.press("0")
        assert "Ann gave it level 4" in bea.message
        assert "Nothing of yours was written" in bea.message
        assert bea.keys == [key]
        # In one browser, another's address makes the page that is open the other's: it may not act.
        enter(ann.context.new_page(), addresses[1])
        before = len(acts(tmp_path))
        ann.press("2")
        assert "this browser is Bea's now" in ann.message
        assert len(acts(tmp_path)) == before
        ann.close()
        bea.close()
    assert len({act.student for act in acts(tmp_path)}) == len(acts(tmp_path)) == 9


@contextlib.contextmanager
def neighbour():
    """Another service at another port of the same host: its address, and the cookies that it is sent."""
    cookies = []

    class Service(http.server.BaseHTTPRequestHandler):
        def do_GET(self):
            cookies.append(self.headers["cookie"])
            self.send_response(200)
            self.send_header("content-type", "text/html")
            self.end_headers()
            self.wfile.write(b"<!doctype html><form method=post enctype=text/plain><input name=a></form>")

        def log_message(self, *_about):
            pass

    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), Service) as service:
        thread = threading.Thread(target=service.serve_forever)
        thread.start()
        try:
            yield f"http://127.0.0.1:{service.server_port}/", cookies
        finally:
            service.shutdown()
            thread.join()


#: What a page can send to another origin; it reads no answer.
FROM_A_PAGE = """async ([home, act]) => {
    const body = JSON.stringify(act);
    for (const [mode, type] of [["cors", "application/json"], ["cors", "text/plain"], ["no-cors", "text/plain"]]) {
        const sent = { method: "POST", mode, credentials: "include", body, headers: { "Content-Type": type } };
        await fetch(`${home}/act/give`, sent).catch(() => {});
    }
    await fetch(`${home}/class`, { mode: "no-cors", credentials: "include" }).catch(() => {});
}"""
FORM = """([home, act]) => {
    const [form] = document.forms;
    const [field] = form.elements;
    form.action = `${home}/act/give`;
    field.name = JSON.stringify(act).slice(0, -1) + ',"remark":"';
    field.value = '"}';
    form.submit();
}"""


def test_a_service_at_another_port_of_the_host_is_sent_the_cookie_and_cannot_score_with_it(tmp_path, chromium):
    with serving(new_class(tmp_path, texts(2)), "Ann") as (_process, (address,)), neighbour() as (other, cookies):
        seat = Seat(chromium, address).open()
        home = seat.home
        pick = seat.page.eval_on_selector(".answer", "({ dataset }) => ({ key: dataset.key, seen: dataset.seen })")
        act = {"question": WORDS[0], "part": WORDS[1], "answers": [pick], "level": 0}
        page = seat.context.new_page()
        page.goto(other)
        page.evaluate(FROM_A_PAGE, [home, act])
        with page.expect_popup() as opened:
            page.evaluate("(home) => { window.open(`${home}/class`); }", home)
        opened.value.wait_for_load_state()
        assert "The class at a glance" not in opened.value.content()
        with page.expect_navigation():
            page.evaluate(FORM, [home, act])
        with Gradebook(tmp_path / GRADEBOOK_FILE) as book:
            assert book.scores.acts() == []
        # The service itself sends what no browser lets a page send: the cookie, and all that it finds with the cookie.
        assert "labcourse-score" in cookies[0]
        with httpx.Client(headers={"cookie": cookies[0], "origin": home}, base_url=home) as service:
            seen = cookies[0] + "".join(service.get(path).text for path in ("/", PART, "/acts.js"))
            for secret in set(re.findall(r"[\w-]{32,}", seen)):
                for header in ("x-labcourse-page", "x-labcourse-token"):
                    assert service.post("/act/give", json=act, headers={header: secret}).status_code == 403
                assert service.post("/enter", headers={"x-labcourse-token": secret}).status_code == 403
        assert acts(tmp_path) == []
        seat.press("4")
        page.goto(home + PART)  # typed, in a tab of its own
        page.wait_for_function(QUIET)
        page.keyboard.press("3")
        page.wait_for_function(QUIET)
        seat.close()
    assert [one.level for one in acts(tmp_path)] == [4, 3]


def test_nothing_of_a_students_runs_or_loads(tmp_path, chromium):
    hostile = [
        "<script>window.ran = 1</script><img src=x onerror='window.ran=1'>",
        "</textarea></div><svg onload=window.ran=1><style>body{display:none}</style>",
        "[x](javascript:window.ran=1) ![x](https://example.com/beacon.png) <iframe src='https://example.com'></iframe>",
        "$\\href{javascript:window.ran=1}{x}$ &lt;script&gt;window.ran=1&lt;/script&gt;",
    ]
    with Gradebook(tmp_path / GRADEBOOK_FILE) as book:
        for n, text in enumerate(hostile):
            record(book, graded(f"h{n}", mark(given=text, reason=text), prose(given=text), report_text(given=text)))
    with serving(tmp_path, "<b>Ann</b>", options=("--names",)) as (_process, (address,)):
        seat = Seat(chromium, address)
        for part in (PART, "/score?question=2.16&part=comparison"):
            seat.open(part)
            for _one in hostile:
                assert seat.keys
                assert seat.page.is_visible(".answer")
                seat.page.click(".answer .words")
                seat.page.wait_for_timeout(50)
                assert seat.page.evaluate("() => window.ran") is None
                assert seat.page.locator("#card :is(script, iframe, style, a, img)").count() == 0
                seat.press("3")
        seat.page.goto(seat.home + "/")
        assert seat.page.evaluate("() => window.ran") is None
        assert seat.abroad == seat.errors == []
        seat.close()
    assert len(acts(tmp_path)) == 8


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_the_pages_can_be_used_by_everybody(tmp_path, chromium, scheme):
    equal = ["It bends, for there is friction in the joint.", "It bends for there is friction in the joint"]
    with Gradebook(tmp_path / GRADEBOOK_FILE) as book:
        fill(book, [*equal, *texts(3)])
        book.scores.ask("student-004", WORDS, "Ann", remark="Is it?")
    with serving(tmp_path, "Ann") as (_process, (address,)):
        seat = Seat(chromium, address, scheme)

        assert findings(seat.page) == []
        seat.open()
        while len(seat.keys) != 2:
            seat.press("s")
        assert findings(seat.page) == []
        seat.page.keyboard.press("h")
        assert findings(seat.page) == []
        seat.page.keyboard.press("Escape")
        while seat.keys:
            seat.press("3")
        assert findings(seat.page) == []
        seat.page.goto(seat.home)
        assert findings(seat.page) == []
        assert seat.errors == []
        seat.close()


def test_what_changes_is_in_view_on_a_small_screen(tmp_path, chromium):
    long = "\n\n".join(f"Paragraph {n} of an answer that goes on, and on." for n in range(60))
    with serving(new_class(tmp_path, [long, *texts(2)]), "Ann") as (_process, (address,)):
        seat = Seat(chromium, address).open()
        for _answer in range(3):
            levels = (".level >> nth=0", ".level >> nth=4")
            for place in ("#state", ".answer h2", ".machine", *levels, "#remark", "#message"):
                box = seat.page.locator(place).first.bounding_box()
                assert box["y"] >= 0 and box["y"] + box["height"] <= 720, place
            assert seat.page.evaluate("() => document.documentElement.scrollHeight <= innerHeight")
            seat.press("4")
        seat.close()


def test_an_open_page_says_that_its_address_was_revoked_and_a_new_address_opens_it_again(
    tmp_path, chromium, monkeypatch
):
    set_real_clock(monkeypatch)
    port = browser.free_port()
    home = f"http://localhost:{port}"  # a tunnel to an address that lasts
    options = ("--url", home, "--port", str(port))
    with serving(new_class(tmp_path, texts(3)), "Ann", options=options) as (_process, (address,)):
        seat = Seat(chromium, address).open()
        assert seat.page.url.startswith(f"{home}/score?")
        seat.press("4")
        with Gradebook(tmp_path / GRADEBOOK_FILE) as book:
            book.tokens.revoke("Ann")
            seat.press("3")
            assert "revoked or replaced" in seat.message
            seat.page.goto(address)
            seat.page.wait_for_selector("text=Ask the instructor for a new one")
            assert findings(seat.page) == []
            book.tokens.replace("Ann", (new := Scorer("Ann")).digest)
        enter(seat.page, f"{home}/enter#{new.token}")  # in the same tab: only what is behind the # changes
        assert seat.page.url == f"{home}/"
        seat.open()
        seat.press("2")
        assert seat.abroad == []
        seat.close()
    assert [act.level for act in acts(tmp_path)] == [4, 2]


def looked_at(page):
    """A page is for everybody, and is no wider than a telephone or a small screen."""
    assert findings(page) == []
    for width, height in ((390, 844), (1280, 720)):
        page.set_viewport_size({"width": width, "height": height})
        assert page.evaluate("() => document.documentElement.scrollWidth <= innerWidth"), width


@pytest.fixture
def slips(tmp_path):
    """Fourteen have the same slip; the first of them asks for another look."""
    with Gradebook(tmp_path / GRADEBOOK_FILE) as book:
        for n in range(14):
            record(book, graded(f"s-{n:02}", mark("wrong", 0.0, f"It is {n}.5 off.", f"{n}.5 rad/s"), prose()))
        book.comment("s-00", "I measured it twice.", "Ann", "2.11", "omega_n", asks=True)
    return tmp_path


def test_an_answer_is_two_clicks_away_from_the_class(slips, chromium):
    with serving(slips, "Ann") as (_process, (address,)):
        seat = Seat(chromium, address)
        page = seat.page
        looked_at(page)
        page.click("text=The class at a glance")
        looked_at(page)
        page.locator("a", has_text="s-00").first.click()
        looked_at(page)
        page.locator("a", has_text="Open 2.11 omega_n").click()
        looked_at(page)
        page.keyboard.press("c")
        page.wait_for_selector("text=The class at a glance")
        page.goto(f"{seat.home}/student?id=s-")
        looked_at(page)
        assert seat.abroad == seat.errors == []
        seat.close()


def test_an_answer_is_decided_by_keys_and_the_same_for_all_that_were_in_view(slips, chromium):
    with serving(slips, "Ann", options=("--names",)) as (_process, (address,)):
        seat = Seat(chromium, address).open("/answer?student=s-00&question=2.11&part=omega_n")
        page = seat.page
        page.keyboard.press("f")
        assert "Write a remark first" in seat.message and acts(slips) == []
        page.keyboard.type("Fine: your axis says Hz. n u f")  # typed, and no key for the page
        page.keyboard.press("Escape")
        seat.press("p")
        page.keyboard.type("1,5")
        seat.press("Enter")
        assert "Given: 1.5 points." in seat.message
        looked_at(page)
        presses = 0
        while len(seat.keys) == 13 and presses < 20:
            page.wait_for_timeout(100)
            seat.press("s")
            presses += 1
            if len(seat.keys) == 13:
                assert "had not been in view" in seat.message and len(acts(slips)) == 1
        assert presses > 1 and seat.keys == []
        assert [act.points for act in acts(slips)] == [1.5] * 14
        seat.press("u")
        assert len(seat.keys) == 13
        page.fill("#remark", "See the axis.")
        page.click("#note")
        page.wait_for_function(QUIET)
        assert "Noted" in seat.message and seat.abroad == seat.errors == []
        seat.close()
    with Gradebook(slips / GRADEBOOK_FILE) as book:
        assert [(one.text, one.is_open) for one in book.comments("s-00")][1:] == [("See the axis.", False)]
        assert not any(one.is_open for one in book.comments())
