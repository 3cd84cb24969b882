"""The course in a browser: answered in a tab, kept there, handed in, and marked like any other."""

import json
import subprocess
import sys
import zipfile

import browser
import honest_marks
import lite
import pytest
from checkout import ROOT
from static_server import static

from labcourse.answers.answers import by_part, parse
from labcourse.run import execute
from rotflex.course.questions import CATALOGUE

pytestmark = [
    pytest.mark.scheduled,
    pytest.mark.slow,
    pytest.mark.timeout(900),
    pytest.mark.skipif(browser.CHROMIUM is None, reason="chromium is not installed (apt-get install chromium)"),
]

ANSWERED = ("00", "01", "02", "03", "05", "06")
LIMIT = 90e6  # bytes to the first bench
PACKED = "receipts are stored"
ASIDE = "() => parseFloat(document.querySelector('.handle[data-shape=grab]').getAttribute('aria-valuetext')) < -1"
P3 = "() => document.querySelector('.handle[data-name=p3]').getAttribute('aria-valuetext')"
POLES = """from rotflex.widgets import another_arm
from rotflex.widgets.poles import PoleExplorer
PoleExplorer(*another_arm.model())"""
FULL = """() => {
    const { put } = IDBObjectStore.prototype;
    window.again = () => { IDBObjectStore.prototype.put = put; };
    IDBObjectStore.prototype.put = function (...given) {
        if (this.name !== "files") return put.apply(this, given);
        throw new DOMException("The current transaction exceeded its quota limitations.", "QuotaExceededError");
    };
}"""


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    return lite.site(tmp_path_factory.mktemp("lite") / "site")


@pytest.fixture
def served(site):
    with static({"": site}, {".wasm": "application/wasm"}) as running:
        yield running


@pytest.fixture
def tab(served):
    with lite.profile(served.address) as (_context, opened):
        opened.name("ada")
        opened.ready()
        yield opened


@pytest.mark.isolation
def test_the_course_is_answered_handed_in_and_marked_as_on_a_computer(served, tmp_path):
    with lite.profile(served.address) as (_context, tab):
        tab.name("ada")
        tab.ready()
        assert sum(served.sent.values()) < LIMIT
        for name, sources in lite.solved(*ANSWERED).items():
            tab.open(name, sources)
            assert not lite.not_there(tab.run_all())
            if name.startswith("02"):  # what is kept is there after the page was loaded again
                tab.page.on("dialog", lambda dialog: dialog.accept())
                tab.page.reload()
                tab.ready()
        assert "loose" in (tab.bar().locator(".kept").get_attribute("data-kept") or "")
        with tab.page.expect_download() as download:
            said = tab.press("Submit", PACKED)
        assert "different" not in said
        download.value.save_as(tmp_path / "work" / "ada.zip")
        tab.page.wait_for_selector(f"{lite._SHOWN} .labcourse-bar .kept[data-kept=safe]")
    with zipfile.ZipFile(tmp_path / "work" / "ada.zip") as packed:
        receipt, home = json.loads(packed.read("receipt.json")), parse(packed.read("answers.json"))
    assert receipt["checked"] and {"2.1", "2.12", "2.18", "3.8"} <= {*receipt["answered"]}
    assert not _lost(tmp_path)
    with zipfile.ZipFile(tmp_path / "work" / "ada.zip") as packed:
        (tmp_path / "run").mkdir()
        (tmp_path / "run" / "course.json").write_bytes(packed.read("course.json"))
        notebooks = {name: json.loads(packed.read(name)) for name in sorted(packed.namelist()) if name.endswith("nb")}
    execute.run(notebooks, tmp_path / "run", parameters={"student": "ada"})
    there = by_part(parse((tmp_path / "run" / "answers.json").read_bytes()))
    recordings = {where: answer for where, answer in by_part(home).items() if answer["kind"] == "recording"}
    assert len(recordings) > 1 and all(there[where] == answer for where, answer in recordings.items())


def _lost(place):
    """Grade what was handed in, and return what has not its points though nobody has to read it."""
    words = ("grade", str(place / "marks"), str(place / "work"), "--solutions", str(ROOT / "solutions"))
    command = [sys.executable, "-m", "rotflex.cli", *words]
    done = subprocess.run(command, cwd=place, capture_output=True, text=True, check=False)
    [path] = (place / "marks").glob("*/marks.json")
    marks = honest_marks.Marks(json.loads(path.read_text(encoding="utf-8"))["marks"])
    asked = {question for question, part in CATALOGUE.questions.items() if part.notebook[:2] in ANSWERED}
    assert len(asked & {mark["question"] for mark in marks.marks}) > 20, done.stderr
    return {question: why for question, why in marks.lost.items() if question in asked}


def test_a_second_tab_says_that_the_course_is_open(served):
    with lite.profile(served.address) as (context, tab):
        tab.page.wait_for_selector(".jp-Dialog input")
        second = context.new_page()
        second.goto(f"{served.address}lab/index.html?path=notebooks/01_modeling_prelab.ipynb")
        second.wait_for_selector("#trouble:not([hidden])")
        assert "another tab" in second.locator("#trouble").inner_text()
        assert second.url.partition("#")[0] == f"{served.address}index.html"


def test_plain_http_is_refused_with_the_reason(served):
    page = browser.chromium().new_page()
    page.goto(served.address.replace("127.0.0.1", "0.0.0.0"))
    assert "https" in page.locator("#trouble").inner_text() and not page.locator("a.open").is_visible()
    page.close()


def test_a_full_storage_is_said_and_what_was_kept_stays(tab):
    [sources] = lite.solved("00").values()
    tab.open("00_start.ipynb", sources)
    assert not lite.not_there(tab.run_all())
    tab.page.evaluate(FULL)
    tab.page.evaluate(lite._RUN.replace("await future.done", "void future.done"), "lab.answer('0.1', resolution=1.0)")
    dialog = tab.page.locator(".jp-Dialog")
    dialog.wait_for()
    assert "storage is full" in dialog.inner_text() and "Restart" in dialog.inner_text()
    dialog.locator("button").click()
    tab.page.evaluate("() => window.again()")
    tab.page.evaluate("() => window.jupyterapp.shell.currentWidget.sessionContext.session.kernel.restart()")
    tab.page.wait_for_function(lite._IDLE)
    assert "0.00153" in tab.run("print(open('answers.json').read())")


def test_a_zip_goes_on_in_another_browser(served, tmp_path):
    [sources] = lite.solved("00").values()
    with lite.profile(served.address) as (_context, tab):
        tab.name("ada")
        tab.ready()
        tab.open("00_start.ipynb", sources)
        assert not lite.not_there(tab.run_all())
        with tab.page.expect_download() as download:
            tab.bar().get_by_role("button", name="Download").click()
        download.value.save_as(tmp_path / "ada.zip")
    with lite.profile(served.address) as (_context, tab):
        tab.name("somebody")
        tab.ready()
        tab.run_all()
        with tab.page.expect_file_chooser() as chooser:
            tab.bar().get_by_role("button", name="Go on with a zip…").click()
        chooser.value.set_files(tmp_path / "ada.zip")
        tab.page.wait_for_function(
            "() => /files are here now/.test(document.querySelector('.labcourse-bar').textContent)"
        )
        tab.page.on("dialog", lambda dialog: dialog.accept())
        tab.page.reload()
        tab.ready()
        assert not lite.not_there(tab.run_all())
        assert "ada" in tab.bar().inner_text()


def test_the_arm_is_pulled_and_stopped_by_mouse(tab):
    tab.run_all()
    tab.bar()
    handle = tab.page.locator(".labcourse-explorer .handle[data-shape=grab]").first
    handle.scroll_into_view_if_needed()
    box = handle.bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    tab.page.mouse.move(x, y)
    tab.page.mouse.down()
    tab.page.mouse.move(x + 60, y, steps=6)
    tab.page.wait_for_function(ASIDE)
    tab.page.mouse.up()
    tab.page.get_by_role("button", name="STOP").first.click()
    tab.page.wait_for_function("() => /stopped/.test(document.querySelector('table.readout').textContent)")


def test_poles_are_moved_by_keyboard(tab):
    tab.open("00_start.ipynb", {"console": POLES})
    tab.run_all()
    tab.bar()
    handle = tab.page.locator('.labcourse-explorer .handle[data-name="p3"]').first
    handle.focus()
    before = handle.get_attribute("aria-valuetext")
    tab.page.keyboard.press("ArrowLeft")
    tab.page.wait_for_function(f"(before) => ({P3})() !== before", arg=before)
