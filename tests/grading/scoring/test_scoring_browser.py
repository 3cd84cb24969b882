"""The scoring page in a browser: by keys alone, two at once, killed in between, with hostile texts, for everybody."""

import browser
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
    done = [(act.level, act.points, act.remark, act.referred) for act in acts(tmp_path) if act.undoes is None]
    assert done == [
        (4, 1.0, "Good: 3 of 4 causes? u", False),
        (None, 0.6, "", False),
        (2, 0.5, "Good: 3 of 4 causes? u", False),
        (None, None, "Does this count?", True),
        (4, 1.0, "", False),
    ]
    assert first != skipped


def test_nothing_of_a_students_runs_or_loads(tmp_path, chromium):
    hostile = [
        "<script>window.ran = 1</script><img src=x onerror='window.ran=1'>",
        "</textarea></div><svg onload=window.ran=1><style>body{display:none}</style>",
        "[x](javascript:window.ran=1) ![x](https://example.com/beacon.png) <iframe src='https://example.com'></iframe>",
    ]
    with Gradebook(tmp_path / GRADEBOOK_FILE) as book:
        for n, text in enumerate(hostile):
            record(book, graded(f"h{n}", mark(given=text, reason=text), prose(given=text), report_text(given=text)))
    with serving(tmp_path, "<b>Ann</b>", options=("--names",)) as (_process, (address,)):
        seat = Seat(chromium, address).open()
        for _one in hostile:
            seat.page.click(".answer .words")
            assert seat.page.locator("#card :is(script, iframe, style, a, img)").count() == 0
            seat.press("3")
        seat.page.goto(seat.home + "/")
        assert seat.page.evaluate("() => window.ran") is None
        assert seat.abroad == seat.errors == []
        seat.close()
    assert len(acts(tmp_path)) == 3


def test_the_pages_can_be_used_by_everybody(tmp_path, chromium):
    equal = ["It bends, for there is friction in the joint.", "It bends for there is friction in the joint"]
    with Gradebook(tmp_path / GRADEBOOK_FILE) as book:
        fill(book, equal)
    with serving(tmp_path, "Ann") as (_process, (address,)):
        for scheme in ("dark", "light"):
            seat = Seat(chromium, address, scheme)
            assert findings(seat.page) == []
            seat.open()
            assert len(seat.keys) == 2 and findings(seat.page) == []
            seat.page.keyboard.press("h")
            assert findings(seat.page) == []
        seat.page.keyboard.press("Escape")
        seat.press("x")
        seat.press("3")
        assert len(seat.keys) == 1  # which was unticked
        seat.press("3")
        assert seat.keys == [] and findings(seat.page) == [] and seat.errors == []
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
        book.comment("s-00", "I measured it twice.", actor="Ann", question="2.11", part="omega_n", asks=True)
    return tmp_path


def test_an_answer_is_decided_by_keys_and_the_same_for_all_that_were_in_view(slips, chromium):
    with serving(slips, "Ann", options=("--names",)) as (process, (address,)):
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
        page.fill("#remark", "Too late.")
        process.kill()
        page.click("#note")
        page.wait_for_function(QUIET)
        assert "does not answer" in seat.message  # what comes too late is not lost on the quiet
        seat.close()
    with Gradebook(slips / GRADEBOOK_FILE) as book:
        assert [(one.text, one.is_open) for one in book.comments("s-00")][1:] == [("See the axis.", False)]
        assert not any(one.is_open for one in book.comments())
