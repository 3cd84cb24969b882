"""The page "Try it", as any static server hands it out: to a browser without a network, and with Pyodide beside it."""

import json
import re
import threading
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager

import accessible
import browser
import make_site
import pyodide_files
import pytest
from static_server import static
from website import try_it

from rotflex import hil
from rotflex.hil.student_benches import DRAW, student_seed

pytestmark = pytest.mark.skipif(browser.CHROMIUM is None, reason="chromium is not installed (apt-get install chromium)")

BESIDE = try_it.TESTED._replace(address="../pyodide/")
STATES = "body[data-stage={}]"
SWING = "() => getComputedStyle(document.querySelector('#recorded .moves[style*=name]')).transform"
#: What JavaScript needs to let Python wait; a browser without it computes a run as a whole.
NO_WAITING = b"delete WebAssembly.Suspending; delete WebAssembly.promising;\n"


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """A folder with the page in it, which expects Pyodide beside its own folder."""
    folder = tmp_path_factory.mktemp("site")
    try_it.write(folder / try_it.FOLDER, make_site.arm(moving=True), BESIDE)
    return folder


@pytest.fixture(scope="module")
def pyodide():
    return pyodide_files.folder()


@pytest.fixture
def served(site, pyodide):
    with static({"pyodide": pyodide, "": site}) as running:
        yield running


@contextmanager
def visited(served, host="127.0.0.1", **options) -> Iterator[browser.Visit]:
    """The page in a fresh profile; in the end nothing has come from elsewhere."""
    address = served.address.replace("127.0.0.1", host)
    context = browser.chromium().new_context(**{"viewport": {"width": 1280, "height": 1000}, **options})
    try:
        page = context.new_page()
        page.set_default_timeout(browser.PATIENCE)
        seen = browser.Visit(page)
        page.on("console", lambda message: seen.errors.append(message.text) if message.type == "error" else None)
        page.on("pageerror", lambda error: seen.errors.append(str(error)))
        page.on("request", lambda request: browser._note_request(seen, request.url, address))
        page.goto(f"{address}{try_it.FOLDER}/")
        yield seen
        assert not seen.abroad
    finally:
        context.close()


@pytest.fixture(scope="module")
def opened(site, pyodide):
    """The page with its bench open, for tests that leave it in order."""
    with static({"pyodide": pyodide, "": site}) as running, visited(running) as seen:
        ready(seen)
        yield seen.page
        assert not seen.errors


def ready(seen):
    """Wait until the visitor's bench is open, or for what keeps it away."""
    seen.page.wait_for_selector("body:is([data-stage=ready], [data-stage=failed])")
    assert seen.page.evaluate("() => document.body.dataset.stage") == "ready", (news(seen.page), seen.errors)


def news(page):
    return page.locator("#news").inner_text()


def arm(page):
    """The handle on the arm, and where its middle is."""
    handle = page.locator("#bench .handle[data-shape=grab]")
    handle.scroll_into_view_if_needed()
    box = handle.bounding_box()
    return handle, box["x"] + box["width"] / 2, box["y"] + box["height"] / 2


def wait_for_deflection(page, sign):
    """Wait until the arm is deflected by more than a degree, to the left (1) or to the right (-1)."""
    page.wait_for_function(
        "sign => sign * parseFloat(document.querySelector('#bench .handle').getAttribute('aria-valuetext')) > 1",
        arg=sign,
    )


def stop(page):
    page.keyboard.press("Escape")
    page.wait_for_function("() => document.querySelector('#bench table.readout').textContent.includes('stopped')")


# --- without Pyodide --------------------------------------------------------------------------------------------------


def test_its_files_need_no_module_and_name_no_other_address(site):
    folder = site / try_it.FOLDER
    texts = {path.name: path.read_text(encoding="utf-8") for path in folder.iterdir() if path.suffix != ".whl"}
    assert not [name for name in texts if name.endswith(".mjs")]
    scripts = "\n".join(text for name, text in texts.items() if name.endswith((".js", ".html")))
    assert not re.findall(r"^(?:import|export)\b|type=.?module", scripts, re.MULTILINE)
    named = {one for text in texts.values() for one in re.findall(r"https?://[^\s\"'<>)”]+", text)}
    assert named <= {"http://www.w3.org/2000/svg", "http://localhost:8000."}
    for wheel in folder.glob("*.whl"):  # what students get
        assert not [name for name in zipfile.ZipFile(wheel).namelist() if "/grading/" in name or "solutions" in name]


def test_without_pyodide_the_recorded_swing_moves_and_the_page_says_that_it_is_recorded(site):
    with static({"": site}) as running, visited(running) as seen:
        page = seen.page
        page.wait_for_selector(STATES.format("failed"))
        assert "recording" in news(page) and f"{running.address}pyodide/" in news(page)
        before = page.evaluate(SWING)
        page.wait_for_function(f"before => ({SWING})() !== before", arg=before)
        assert page.get_by_role("button", name="Try again").is_visible()
        assert not page.locator("#bench").is_visible()
        assert not accessible.findings(page)


def test_as_a_file_it_plays_the_recorded_swing_and_says_that_a_bench_needs_a_server(site):
    page = browser.chromium().new_page()
    page.goto((site / try_it.FOLDER / "index.html").as_uri())
    assert page.evaluate("() => document.body.dataset.stage") == "failed"
    assert "recording" in news(page) and "http.server" in news(page)
    assert page.locator("#recorded svg").is_visible()
    page.close()


# --- with Pyodide -----------------------------------------------------------------------------------------------------


@pytest.mark.scheduled
def test_what_was_tested_is_what_the_page_names(opened, pyodide):
    lock = json.loads((pyodide / "pyodide-lock.json").read_text(encoding="utf-8"))
    assert lock["info"]["version"] == pyodide_files.VERSION == try_it.TESTED.version
    assert try_it.TESTED.version in try_it.TESTED.address
    assert opened.locator("progress").evaluate("bar => bar.value") == pytest.approx(try_it.TESTED.megabytes, abs=0.5)


@pytest.mark.scheduled
def test_the_arm_is_pulled_by_mouse_and_swings(opened):
    _handle, x, y = arm(opened)
    opened.mouse.move(x, y)
    opened.mouse.down()
    opened.mouse.move(x + 80, y + 30, steps=4)
    wait_for_deflection(opened, -1)
    opened.mouse.up()
    wait_for_deflection(opened, 1)  # it swings through
    stop(opened)


@pytest.mark.scheduled
def test_the_arm_is_pulled_by_an_arrow_key_and_a_run_is_started_and_stopped_by_keys(opened):
    handle, *_ = arm(opened)
    handle.focus()
    opened.keyboard.down("ArrowLeft")
    wait_for_deflection(opened, 1)
    opened.keyboard.up("ArrowLeft")
    stop(opened)
    opened.locator("#bench button[data-name=start]").focus()
    opened.keyboard.press("Enter")
    opened.wait_for_function("() => document.querySelector('#bench table.readout').textContent.includes('running')")
    stop(opened)


@pytest.mark.scheduled
def test_a_dragged_pole_changes_the_verdicts(opened):
    marks = opened.locator("#poles td.mark")
    before = marks.all_inner_texts()
    assert any("not met" in one for one in before)
    handle = opened.locator("#poles .handle").first
    handle.scroll_into_view_if_needed()
    box = handle.bounding_box()
    opened.mouse.move(box["x"] + 13, box["y"] + 13)
    opened.mouse.down()
    opened.mouse.move(box["x"] - 20, box["y"] + 13, steps=5)
    opened.mouse.up()
    opened.wait_for_function("before => document.querySelector('#poles td.mark').textContent !== before", arg=before[0])
    opened.locator("#poles button[data-name=reset]").click()
    opened.wait_for_function("before => document.querySelector('#poles td.mark').textContent === before", arg=before[0])


@pytest.mark.scheduled
def test_an_id_opens_the_bench_that_a_course_gives_it_and_one_that_cannot_be_is_refused(opened):
    def ask(student):
        opened.locator("input[name=student]").fill(student)
        opened.get_by_role("button", name="Open my own bench").click()

    ask("a/b")
    opened.wait_for_function("() => document.querySelector('#news').textContent.includes('a/b')")
    assert "/" in news(opened) and "demo" not in news(opened)
    ask("ada")
    opened.wait_for_function("() => document.querySelector('#news').textContent.includes('ada')")
    opened.locator("#bench button[data-name=start]").click()
    reports = opened.locator("#bench details")
    reports.locator("summary").click()
    with hil.open("virtual", seed=student_seed("ada"), draw=DRAW) as bench:
        for value in bench.identity.values():
            assert str(value) in reports.inner_text() or str(value) == bench.identity["uri"]
    ask("bob")  # in the middle of a run
    opened.wait_for_function("() => document.querySelector('#news').textContent.includes('bob')")
    state = opened.locator("#bench table.readout").first
    assert "ready" in state.inner_text()
    opened.locator("#bench button[data-name=start]").click()
    opened.wait_for_function("() => document.querySelector('#bench table.readout').textContent.includes('running')")
    stop(opened)


@pytest.mark.scheduled
@pytest.mark.parametrize(("scheme", "host"), [("light", "127.0.0.1"), ("dark", "0.0.0.0")])
def test_on_a_phone_it_is_touched_is_not_wider_than_the_screen_and_keeps_nobody_out(served, scheme, host):
    """Dark, and by plain http from a host that a browser does not trust."""
    phone = {"viewport": {"width": 390, "height": 844}, "has_touch": True, "is_mobile": True}
    with visited(served, host, color_scheme=scheme, reduced_motion="reduce", **phone) as seen:
        page = seen.page
        ready(seen)
        assert page.evaluate("() => isSecureContext") == (host == "127.0.0.1")
        assert page.evaluate("() => document.documentElement.scrollWidth") <= 390
        assert not accessible.findings(page)
        _handle, x, y = arm(page)
        touch = page.context.new_cdp_session(page)
        touch.send("Input.dispatchTouchEvent", {"type": "touchStart", "touchPoints": [{"x": x, "y": y}]})
        touch.send("Input.dispatchTouchEvent", {"type": "touchMove", "touchPoints": [{"x": x + 60, "y": y + 20}]})
        wait_for_deflection(page, -1)
        touch.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})
        wait_for_deflection(page, 1)
        stop(page)
        assert not seen.errors


@pytest.mark.scheduled
@pytest.mark.parametrize(
    "broken", ["pyodide.asm.wasm", "scipy-1.14.1-cp312-cp312-pyodide_2024_0_wasm32.whl", "rotflex.whl"]
)
def test_a_connection_that_breaks_is_said_and_the_bench_comes_at_the_second_try(served, broken):
    served.cut[broken] = 1000
    with visited(served) as seen:
        page = seen.page
        page.wait_for_selector(STATES.format("failed"))
        assert "recording" in news(page) and broken in news(page)
        served.cut.clear()
        page.get_by_role("button", name="Try again").click()
        ready(seen)


@pytest.mark.scheduled
def test_a_connection_that_is_silent_is_said_and_what_comes_after_all_is_taken(served):
    comes = served.held["python_stdlib.zip"] = threading.Event()
    with visited(served) as seen:
        page = seen.page
        page.clock.install()
        page.reload()
        for _ in range(100):  # files that are under way still come, and each begins the wait anew
            page.clock.fast_forward(25_000)
            if page.locator(STATES.format("silent")).count():
                break
            page.wait_for_timeout(100)
        assert "20 s" in news(page)
        assert page.get_by_role("button", name="Try again").is_visible()
        comes.set()
        ready(seen)


@pytest.mark.scheduled
def test_where_python_cannot_wait_a_run_is_computed_as_a_whole_and_played_and_nothing_is_pulled(served):
    served.before["worker.js"] = NO_WAITING
    with visited(served) as seen:
        page = seen.page
        ready(seen)
        assert "whole" in news(page)
        assert page.locator("#bench .handle").count() == 0
        page.locator("#bench button[data-name=start]").click()
        page.wait_for_function("() => parseFloat(document.querySelector('#bench .player output')?.textContent) > 0.2")
        assert "finished" in page.locator("#bench table.readout").first.inner_text()
        assert not seen.errors


# --- the same bits ----------------------------------------------------------------------------------------------------

RUNS = """
import hashlib, json
import numpy as np
from rotflex import experiments, hil
from rotflex.hil.student_benches import DRAW, student_seed

K = [18.2, -17.2, 1.59, 0.63]  # V/rad, V/(rad/s)
RUNS = {
    "free decay": lambda bench: experiments.free_decay(bench, progress=False),
    "sweep": lambda bench: experiments.sweep(bench, progress=False),
    "full state": lambda bench: experiments.tracking(bench, K, "full", progress=False),
    "partial state": lambda bench: experiments.tracking(bench, K, "partial", progress=False),
    "hold": lambda bench: experiments.hold(bench, progress=False),
}

def digests():
    found = {}
    for name, run in RUNS.items():
        with hil.open("virtual", seed=student_seed("ada"), draw=DRAW) as bench:
            recording = run(bench)
        for channel in recording.channels:
            found[f"{name}: {channel}"] = hashlib.sha256(np.ascontiguousarray(recording[channel]).tobytes()).hexdigest()
    return found
"""


@pytest.mark.scheduled
def test_five_runs_have_the_same_bits_as_on_the_computer(served):
    with visited(served) as seen:
        ready(seen)
        in_browser = seen.page.workers[0].evaluate(  # as the page loads it, and with nothing of the page's own
            """async (runs) => {
                const address = new URL("../pyodide/", location).href;
                const pyodide = await loadPyodide({ indexURL: address, packages: ["numpy", "scipy"] });
                for (const name of ["labcourse.whl", "rotflex.whl"]) {
                    pyodide.unpackArchive(await (await fetch(name)).arrayBuffer(), "wheel");
                }
                pyodide.runPython(runs);
                return pyodide.runPython("json.dumps(digests())");
            }""",
            RUNS,
        )
    here: dict = {}
    exec(RUNS, here)
    assert json.loads(in_browser) == here["digests"]()
