"""Plots on the page: what their legends name, what a drag tells, what is in view."""

import browser
import numpy as np
import pytest
from checkout import ROOT

from labcourse.scene.live import LiveExplorer
from labcourse.scene.scene import GROUND, Button, Choice, Column, Moving, Panel, Play, Readout, Row, Scene, Slider

pytestmark = pytest.mark.skipif(browser.CHROMIUM is None, reason="chromium is not installed (apt-get install chromium)")

MARKS = ("as it was", "as it is now", "as it was asked for", "as somebody else has it", "a limit", "where it is good")


_SHOW = """async ([module, style, scene, data, width]) => {
    const { render } = await import(URL.createObjectURL(new Blob([module], { type: 'text/javascript' })));
    window.values = { scene, data: new DataView(Float32Array.from(data).buffer) };
    window.told = [];
    window.heard = {};
    const sheet = document.createElement('style');
    sheet.textContent = style;
    const el = document.createElement('div');
    el.style.width = width + 'px';
    document.body.style.margin = 0;
    document.body.replaceChildren(sheet, el);
    const model = { get: (name) => values[name], on: (what, call) => { heard[what] = call; }, off() {},
        send: (event) => told.push(event) };
    render({ model, el });
    await new Promise((done) => document.querySelector('.labcourse-explorer').addEventListener('painted', done));
}"""
_UPDATE = """async ([scene, data]) => {
    window.values = { ...window.values, scene, data: new DataView(Float32Array.from(data).buffer) };
    heard['change:scene']();
    await new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)));
}"""


@pytest.fixture(scope="module")
def page():
    page = browser.chromium().new_page(viewport={"width": 1280, "height": 720})
    page.set_content("<!doctype html>")
    yield page
    page.close()


def show(page, scene, width=836):
    """Show a scene, so many px wide. What the page tells Python is then in ``window.told``."""
    style = (ROOT / "labcourse" / "scene" / "explorer.css").read_text(encoding="utf-8")
    page.evaluate(_SHOW, [LiveExplorer._esm, style, *_sent(scene, {}), width])


def update(page, scene, **more):
    """Show another scene in its place; ``more`` is what else an explorer puts into it: notice, version, answered."""
    page.evaluate(_UPDATE, list(_sent(scene, more)))


def _sent(scene, more):
    fixed, data = scene.packed()
    about = {"notice": {"kind": "info", "text": ""}, "version": 1, "answered": {}}
    return fixed | about | more, np.frombuffer(data, np.float32).tolist()


def marked():
    panel = Panel("imaginary (rad/s)", (-10.0, 2.0), (-5.0, 5.0), "real (rad/s)")
    panel.mark(-1, 0, "ghost", "circle", MARKS[0])
    panel.mark(-2, 0, "model", "square", MARKS[1])
    panel.mark(-3, 0, "measured", "cross", "")
    panel.points([-3.0, -4.0], [0.0, 1.0], "highlight", MARKS[3])
    panel.level(0.0, "highlight", MARKS[4])
    panel.band(1, 2, "voltage", MARKS[5])
    panel.handle("pole", -5.0, 1.0, "a pole", "−5", (0.5, 0.5), legend=MARKS[2])
    panel.handle("other", -6.0, 0.0, "another pole", "−6", (0.5, 0.0), axis="x")
    return panel


def scene(**more):
    controls = [[Slider("gain", "gain", "V", 0, 10, 1, 5), Choice("kind", "kind", {"a": "A", "b": "B"}, "a")]]
    controls.append([Button("reset", "Reset"), Button("never", "Never", disabled=True)])
    readouts = [
        Readout("Found", [Row("gain", ("5 V",), "met", "met")]),
        Readout("More", [Row("x", ("1",))], folded=True),
    ]
    fixed = {"alt": "poles", "columns": [Column([marked()])], "controls": controls, "readouts": readouts}
    return Scene(**fixed | more)


WRITTEN = """() => {
    const found = [];
    const write = CanvasRenderingContext2D.prototype.fillText;
    CanvasRenderingContext2D.prototype.fillText = function (text, x, y) {
        const wide = this.measureText(text).width;
        const left = x - { left: 0, right: wide, center: wide / 2 }[this.textAlign];
        found.push([text, left, left + wide, y]);
    };
    heard['change:scene']();
    return new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => {
        CanvasRenderingContext2D.prototype.fillText = write;
        done(found);
    })));
}"""


@pytest.mark.parametrize("width", [836, 260])
def test_a_legend_names_every_mark_once_and_wraps(page, width):
    show(page, scene(), width)
    written = page.evaluate(WRITTEN)
    entries = {text: (left, right, y) for text, left, right, y in written if text in MARKS}
    assert sorted(text for text, *_ in written if text in MARKS) == sorted(MARKS)
    assert all(left > 0 and right < width for left, right, _ in entries.values())
    (title,) = [(left, right, y) for text, left, right, y in written if text == "imaginary (rad/s)"]
    lines = {}
    for left, right, y in [title, *entries.values()]:
        lines.setdefault(y, []).append((left, right))
    assert len(lines) > (width < 500)
    for line in lines.values():
        for (_, end), (begin, _) in zip(sorted(line), sorted(line)[1:], strict=False):
            assert begin - end >= 14  # with room for the mark
    ticks = [y for text, _, _, y in written if text in ("−4", "−2", "0", "2", "4")]
    assert max(lines) < min(ticks)  # above the plot


def grasp(page):
    """Take the handle of the pole."""
    box = page.locator('.handle[data-name="pole"]').bounding_box()
    page.mouse.move(box["x"] + 13, box["y"] + 13)
    page.mouse.down()
    return box["x"] + 23, box["y"] + 13


def test_what_is_told_while_a_handle_is_dragged_is_within_the_plot(page):
    show(page, scene())
    grasp(page)
    page.mouse.move(2000, -500, steps=3)
    page.mouse.up()
    first = page.evaluate("() => told[0]")  # Python answers it: then the latest goes out
    update(page, scene(), version=2, answered={"view": first["view"], "n": first["n"]})
    last = page.evaluate("() => told.at(-1)")
    assert (last["x"], last["y"]) == pytest.approx((2.0, 5.0))


@pytest.mark.parametrize(("width", "beside"), [(836, False), (1200, True)])
def test_a_whole_explorer_is_in_view_and_readouts_stand_beside_the_plots_where_there_is_room(page, width, beside):
    show(page, scene(height=900), width)
    whole, stage, readouts = (
        page.locator(one).bounding_box() for one in (".labcourse-explorer", ".stage", ".readouts")
    )
    assert whole["y"] >= 0 and whole["y"] + whole["height"] <= 720
    assert stage["height"] >= 500  # and makes use of the room
    assert (readouts["x"] >= stage["x"] + stage["width"]) is beside
    assert (readouts["y"] >= stage["y"] + stage["height"]) is not beside


@pytest.mark.parametrize(("width", "height"), [(352, 779), (409, 359), (560, 779), (690, 359)])
def test_on_a_small_screen_a_handle_and_the_plots_that_answer_are_in_view_without_a_sideways_scroll(
    page, width, height
):
    """A window of 720 px, and one of 1280 by 720 at 150 %: with JupyterLab's list of files, and without."""
    page.set_viewport_size({"width": width, "height": height})
    answer = [Panel(f"answer {number} (m)", (0, 1), (0, 1), "time (s)" if number == 2 else "") for number in range(3)]
    for panel in answer:
        for label in MARKS:
            panel.line([0, 1], [0, 1], "model", label)
    sliders = [Slider(name, f"the {name} pole", "rad/s", -80, 10, 0.5, -40) for name in ("third", "fourth")]
    wide = Readout(
        "Table 2: results of the laboratory. All entries are missing.", [Row("a number", ("not filled in yet",))]
    )
    drawing = Moving({"x": 0.0}, (0, 1), (0, 1))
    columns = [Column([marked()]), Column(answer), Column([drawing], 0.5)]
    show(page, scene(columns=columns, controls=[sliders], readouts=[wide], height=460), width)
    written = {text: y for text, _, _, y in page.evaluate(WRITTEN)}
    stage = page.locator(".stage").bounding_box()
    assert written["time (s)"] <= height and 0 < stage["height"] <= max(height, 3 * 460)
    ends = [written["real (rad/s)"], written["time (s)"]]
    assert (ends[1] - ends[0] > 200) is (width < 620 < height)  # below each other where two are in view at once
    assert page.evaluate("() => document.documentElement.scrollWidth") <= width
    page.set_viewport_size({"width": 1280, "height": 720})


#: As JupyterLab shows them in a notebook: printed text, a formula in a sentence, and the first line of a folded cell.
NOTEBOOK = """<!doctype html><style>
.jp-OutputArea-output pre { word-break: break-all; white-space: pre-wrap; }
mjx-math { display: inline-block; width: 98px; height: 10px; }
.jp-Placeholder { display: flex; }
.jp-Placeholder-content { flex: 1 1 auto; }
.jp-PlaceholderText { white-space: nowrap; overflow-x: hidden; }
</style><div class="jp-Notebook" style="width: 130px; font: 16px monospace">
<div class="jp-OutputArea-output"><pre>a number of <b>sentences</b></pre></div>
<p>an <mjx-container><mjx-math></mjx-math></mjx-container><b>.</b> Then</p>
<div class="jp-Placeholder"><div class="jp-Placeholder-content"><div class="jp-PlaceholderText">a long first line
of a folded cell</div></div></div></div>"""


def test_the_bars_style_keeps_words_whole_full_stops_at_the_end_and_the_notebook_in_its_width(page):
    page.set_viewport_size({"width": 150, "height": 700})
    page.set_content(NOTEBOOK)
    where = """() => [document.querySelector('pre b').getClientRects().length,
        document.querySelector('p b').offsetTop - document.querySelector('mjx-math').offsetTop,
        document.documentElement.scrollWidth]"""
    again, below, wide = page.evaluate(where)
    assert again == 2 and below > 5 and wide > 150  # as JupyterLab has them
    page.add_style_tag(path=ROOT / "labcourse" / "scene" / "course_bar.css")
    again, below, wide = page.evaluate(where)
    assert again == 1 and below < 5 and wide <= 150
    page.set_viewport_size({"width": 1280, "height": 720})


def test_what_is_folded_opens_and_stays_open_when_it_changes(page):
    show(page, scene())
    table = page.locator("details table.readout")
    assert not table.is_visible()
    page.locator("summary", has_text="More").click()
    assert table.is_visible() and "1" in table.inner_text()
    update(page, scene(readouts=[Readout("Found", []), Readout("More", [Row("x", ("2",))], folded=True)]))
    assert table.is_visible() and "2" in table.inner_text()
    update(page, scene(readouts=[Readout("More", [Row("x", ("3",))])]))
    assert page.locator("details").count() == 0
    assert page.locator("table.readout").inner_text().split() == ["More", "x", "3"]


def test_a_notice_that_goes_waits_until_the_handle_is_let_go(page):
    """What is below it would move away from under the hand."""
    show(page, scene())
    update(page, scene(), notice={"kind": "info", "text": "Kept."}, version=2)
    page.mouse.move(*grasp(page))
    said = page.evaluate("() => told.at(-1)")
    answered = {"view": said["view"], "n": said["n"]}
    top = page.locator(".stage").bounding_box()["y"]
    update(page, scene(), version=3, answered=answered)
    assert not page.locator(".notice").is_visible() and page.locator(".stage").bounding_box()["y"] == top
    page.mouse.up()
    assert page.locator(".notice").inner_text() == "" and page.locator(".stage").bounding_box()["y"] < top


def notice(page, words):
    page.wait_for_function("words => document.querySelector('.notice').textContent.includes(words)", arg=words)


def test_a_drag_on_a_busy_computer_waits_and_one_after_a_restart_is_called_lost(page):
    show(page, scene())
    page.evaluate("() => { window.clock = Date.now; window.told.length = 0; }")
    page.mouse.move(*grasp(page))
    page.mouse.move(300, 300)
    before = page.evaluate("() => { const sent = Date.now(); Date.now = () => sent + 9e9; return sent; }")
    page.mouse.up()
    notice(page, "the computer is busy")
    first = page.evaluate("() => told[0]")
    update(page, scene(), version=2, answered={"view": first["view"], "n": first["n"]})
    last = page.evaluate("() => { Date.now = window.clock; return told.at(-1); }")
    assert last["n"] > first["n"] and last["at"] <= before  # the latest place, with the time when it was there
    update(page, scene(), version=3, answered={"view": last["view"], "n": last["n"]})
    assert page.locator(".notice").inner_text() == ""
    said = page.evaluate(
        "() => { document.body.firstElementChild.nextElementSibling.className = "
        "'jupyter-widgets-disconnected'; return told.length; }"
    )
    page.mouse.move(*grasp(page))
    notice(page, "run this cell again")
    page.mouse.up()
    assert "lost" in page.locator(".notice").inner_text() and page.evaluate("() => told.length") == said


def test_a_pull_that_nobody_answers_is_not_passed_over(page):
    drawing = Moving({"x": 0.0}, (0, 1), (0, 1))
    drawing.grab("arm", GROUND.at(0.5, 0.5), "the arm", "0", 0.1)
    show(page, scene(columns=[Column([drawing])]))
    page.locator('.handle[data-name="arm"]').click()
    notice(page, "the computer is busy")
    update(page, scene(columns=[Column([drawing])], live="silent"), version=2)
    notice(page, "")
    notice(page, "silent")  # no new picture since


def test_a_recording_begins_at_once_where_it_is_asked_to(page):
    play = Play({"x": np.linspace(0, 1, 5)}, 0.2, at_once=True)
    show(page, scene(columns=[Column([Moving({"x": 0.0}, (0, 1), (0, 1))])], play=play))
    page.wait_for_function("() => document.querySelector('.player output').textContent === '0.20 s'")


def test_a_recording_that_changes_begins_by_itself_once_nothing_is_held(page):
    def playing(end):
        drawing = Moving({"x": 0.0}, (0, 1), (0, 1))
        return scene(columns=[Column([marked(), drawing])], play=Play({"x": np.linspace(0, end, 5)}, 0.2, auto=True))

    clock = page.locator(".player output")
    show(page, playing(1.0))
    page.wait_for_timeout(500)
    assert clock.inner_text() == "0.00 s"  # nobody has touched anything yet
    update(page, playing(1.0), version=2)
    page.wait_for_timeout(500)
    assert clock.inner_text() == "0.00 s"  # the same as before
    page.mouse.move(*grasp(page))
    said = page.evaluate("() => told.at(-1)")
    update(page, playing(2.0), version=3, answered={"view": said["view"], "n": said["n"]})
    page.wait_for_timeout(500)
    assert clock.inner_text() == "0.00 s"
    page.mouse.up()
    page.wait_for_function("() => document.querySelector('.player output').textContent === '0.20 s'")
