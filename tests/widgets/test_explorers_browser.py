"""The explorers in the JupyterLab that students use: opened, dragged, typed at, stopped."""

import browser
import explorer_notebooks
import pytest
from explorer_notebooks import middle, settled

needs_chromium = pytest.mark.skipif(
    browser.CHROMIUM is None, reason="chromium is not installed (apt-get install chromium)"
)
pytestmark = needs_chromium


@pytest.fixture(scope="module")
def served(jupyterlab):
    """JupyterLab with a notebook for each explorer. Gives the address and the folder."""
    folder = jupyterlab.course("explorers")
    explorer_notebooks.write(folder)
    return jupyterlab.address, folder


@pytest.fixture(scope="module")
def opened(served, request):
    """The explorer that tests name, in one page for all of them; whatever they do there, it stays in order."""
    address, _ = served
    with browser.visit(address, f"explorers/{request.param}.ipynb") as seen:
        explorer_notebooks.show(seen)
        yield seen.page
        assert not seen.errors
        assert not seen.abroad


def gain(page):
    rows = page.locator("table.readout", has_text="Gain K").locator("tr")
    return [float(row.locator("td").first.inner_text().replace("−", "-")) for row in rows.all()]


def verdicts(page):
    return page.locator("table.readout", has_text="Specifications").locator("td.mark").all_inner_texts()


def painted(page):
    return page.locator(".labcourse-explorer canvas").evaluate("canvas => canvas.toDataURL()")


def wait_for_text(page, selector, text):
    page.wait_for_function(
        "([selector, text]) => document.querySelector(selector)?.textContent.includes(text)", arg=[selector, text]
    )


def button(page, name):
    return page.locator(".labcourse-explorer").get_by_role("button", name=name, exact=True)


@pytest.mark.scheduled
@pytest.mark.parametrize("name", ["poles", "results"])
def test_a_notebook_that_is_opened_again_shows_the_picture_and_what_to_do(served, name):
    """Not "Loading widget..." for ever; and the page that it was saved from keeps its explorer."""
    with browser.visit(served[0], f"explorers/{name}.ipynb") as seen:
        explorer_notebooks.show(seen)
        seen.page.evaluate("() => window.jupyterapp.shell.currentWidget.context.save()")
        settled(seen.page)
        assert seen.page.locator(".labcourse-explorer button").count() > 0
        seen.page.evaluate("() => window.jupyterapp.shell.currentWidget.sessionContext.shutdown()")
    with browser.visit(served[0], f"explorers/{name}.ipynb") as seen:
        output = seen.page.locator(".jp-OutputArea-output", has_text="run this cell")
        output.wait_for()
        assert "widget" not in output.inner_text()
        for text in ("Loading widget", "model not found"):
            assert seen.page.get_by_text(text).count() == 0
        if name == "poles":
            image = output.locator("img")
            assert image.evaluate("one => one.complete && one.naturalWidth") > 500
            assert "Desired poles" in image.get_attribute("alt")
        assert not seen.errors
        explorer_notebooks.show(seen)  # and run again, it is there


@pytest.mark.parametrize("opened", ["poles"], indirect=True)
def test_the_pole_explorer_works_by_keyboard_alone(opened):
    page = opened
    page.locator('[data-name="zeta"]').focus()
    walked = []
    for _ in range(18):
        walked.append(page.evaluate("document.activeElement.dataset.name"))
        page.keyboard.press("Tab")
    numbers = [name + kind for name in ("zeta", "omega_n", "p3", "p4") for kind in ("", "-number")]
    assert walked == [*numbers, "feedback", "beside", "reset", "ghost", "forget", "figure", "keep", "pair", "p3", "p4"]

    def press(selector, *keys):
        page.locator(selector).focus()
        for key in keys:
            page.keyboard.press(key)
        settled(page)

    def number(name):
        return float(page.locator(f'[data-name="{name}-number"]').input_value())

    first = gain(page)
    press('[data-name="omega_n"]', "ArrowRight", "ArrowRight")
    assert number("omega_n") == pytest.approx(20.2)
    press('.handle[data-name="p3"]', "ArrowLeft", "Shift+ArrowLeft")
    assert number("p3") == pytest.approx(-30 - 0.5 - 5)
    press('.handle[data-name="pair"]', "ArrowUp", "ArrowUp", "ArrowUp")
    assert number("zeta") < 0.6 and number("omega_n") > 20.5
    page.locator('[data-name="zeta-number"]').fill("0.8")
    press('[data-name="zeta-number"]', "Enter")
    assert number("zeta") == 0.8
    assert gain(page) != first
    page.locator('[data-name="feedback"]').select_option("partial")
    settled(page)
    press('[data-name="reset"]', "Enter")
    assert gain(page) == first and number("zeta") == 0.6
    assert page.locator('[data-name="feedback"]').input_value() == "full"


@pytest.mark.parametrize("opened", ["poles"], indirect=True)
def test_a_pole_is_dragged_by_the_mouse_and_all_follows(opened, served):
    page = opened
    before, picture = gain(page), painted(page)
    assert verdicts(page) == ["✓ met"] * 4
    x, y = middle(page, "pair")
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x - 5, y - 40, steps=8)
    page.mouse.up()
    settled(page)
    now = middle(page, "pair")
    assert now == pytest.approx((x - 5, y - 40), abs=3)
    assert painted(page) != picture
    assert gain(page) != before
    assert "✗ not met" in verdicts(page)

    button(page, "Keep this design").click()
    wait_for_text(page, ".labcourse-explorer .notice", "K = np.array(")
    button(page, "Figure for the report").click()
    wait_for_text(page, ".labcourse-explorer .notice", "pole_design.svg")
    assert (served[1] / "pole_design.png").read_bytes().startswith(b"\x89PNG")


KEYS = ("d", "d", "j", "a", "x", "m", "Shift+Enter")
STATE = """() => {
    const notebook = window.jupyterapp.shell.currentWidget.content;
    const types = notebook.widgets.map((cell) => cell.model.type);
    return [types, notebook.activeCellIndex, notebook.activeCell.model.executionCount];
}"""


@pytest.mark.parametrize("opened", ["poles"], indirect=True)
def test_no_key_acts_on_the_notebook_after_a_click_on_the_explorer_and_beside_it_one_does(opened):
    """After a click on any of its elements: tests/labcourse/scene/test_plots.py."""
    page = opened
    before = page.evaluate(STATE)
    for element in (".handle", ".stage"):
        found = page.locator(".labcourse-explorer").locator(element).first
        found.click(position={"x": 2, "y": 2} if element == ".stage" else None)
        for key in KEYS:
            page.keyboard.press(key)
        assert page.evaluate(STATE) == before, element
    page.locator(".jp-Notebook .jp-InputPrompt").first.click()
    for key in ("d", "d"):
        page.keyboard.press(key)
    page.wait_for_function(f"count => ({STATE})()[0].length === count", arg=len(before[0]) - 1)


@pytest.mark.scheduled
@pytest.mark.parametrize("opened", ["poles"], indirect=True)
def test_a_kernel_that_is_restarted_is_noticed(opened):
    page = opened
    page.evaluate("() => window.jupyterapp.shell.currentWidget.sessionContext.session.kernel.restart()")
    page.wait_for_timeout(1000)
    page.locator('[data-name="zeta"]').focus()
    page.keyboard.press("ArrowRight")
    wait_for_text(page, ".labcourse-explorer .notice", "run this cell again")


ASIDE = """([name, sign, degrees]) => {
    const aside = document.querySelector(`.handle[data-name="${name}"]`).getAttribute("aria-valuetext");
    return sign * parseFloat(aside) > degrees;
}"""
#: Remember each place of a handle from now on: a swing may be over before somebody looks.
WATCH = """(name) => {
    const handle = document.querySelector(`.handle[data-name="${name}"]`);
    window.seen = [];
    new MutationObserver(() => window.seen.push(parseFloat(handle.getAttribute("aria-valuetext"))))
        .observe(handle, {attributes: true, attributeFilter: ["aria-valuetext"]});
}"""
SWUNG = "([sign, degrees]) => window.seen.some((angle) => sign * angle > degrees)"


@pytest.mark.parametrize("opened", ["console"], indirect=True)
def test_the_arm_is_pulled_aside_by_mouse_and_by_keyboard_and_swings_back(opened):
    page = opened

    def wait_until_aside(sign, degrees):
        page.wait_for_function(ASIDE, arg=["arm", sign, degrees])

    x, y = middle(page, "arm")
    page.mouse.move(x, y)
    page.mouse.down()  # nothing runs before
    page.mouse.move(x - 120, y, steps=4)
    wait_until_aside(1, 8)
    page.wait_for_timeout(500)  # more than 0.2 s without a movement
    wait_until_aside(1, 8)
    page.evaluate(WATCH, "arm")
    page.mouse.up()
    page.wait_for_function(SWUNG, arg=[-1, 3])
    page.locator('.handle[data-name="arm"]').focus()
    for _press in range(5):
        page.keyboard.down("ArrowRight")
    wait_until_aside(-1, 8)
    page.evaluate(WATCH, "arm")
    page.keyboard.up("ArrowRight")
    page.wait_for_function(SWUNG, arg=[1, 3])
    button(page, "STOP").click()
    wait_for_text(page, ".readouts", "You stopped it.")


BUSY = """async (code) => {
    const kernel = window.jupyterapp.shell.currentWidget.sessionContext.session.kernel;
    const future = kernel.requestExecute({code});
    window.said = ''; window.ended = false;
    future.onIOPub = (message) => { window.said += message.content.text ?? message.content.evalue ?? ''; };
    future.done.then(() => { window.ended = true; });
}"""
#: Choose a virtual bench that runs in real time, as a real one does.
IN_REAL_TIME = """explorer._addresses.append('virtual:?clock=wall')
explorer.receive({'kind': 'set', 'name': 'address', 'value': 'virtual:?clock=wall', 'view': 'page', 'n': 0})"""


@pytest.mark.parametrize("opened", ["console"], indirect=True)
def test_stop_ends_a_running_experiment(opened):
    page = opened
    page.evaluate(BUSY, IN_REAL_TIME)
    button(page, "Connect").click()
    wait_for_text(page, ".readouts", "watchdog")
    for stop in ("click", "key"):
        page.locator('[data-name="experiment"]').select_option("sweep")
        button(page, "Start").click()
        page.wait_for_selector('[data-name="start"][aria-disabled="true"]')
        version = int(page.locator(".labcourse-explorer").get_attribute("data-version"))
        page.wait_for_function(
            "v => Number(document.querySelector('.labcourse-explorer').dataset.version) > v + 5", arg=version
        )
        if stop == "click":
            button(page, "STOP").click()
        else:
            page.locator('[data-name="experiment"]').focus()
            page.keyboard.press("Escape")  # wherever the focus is
        wait_for_text(page, ".readouts", "You stopped it. The motor is at 0 V.")
    button(page, "Disconnect").click()
    wait_for_text(page, ".readouts", "not connected")


#: Ends by itself once the motor is at 0 V, which is to be so before the cell ends.
KEEPS_PYTHON_BUSY = """import time
print("busy", flush=True)
while explorer._run.at_zero is None:
    time.sleep(0.05)
print(0)"""


@pytest.mark.parametrize("opened", ["console"], indirect=True)
def test_a_run_ends_at_0_volts_while_another_cell_keeps_python_busy(opened):
    """By STOP where JupyterLab has a thread beside the cell for it; else because nothing is heard of the page."""
    page = opened
    page.evaluate(BUSY, IN_REAL_TIME)
    button(page, "Connect").click()
    wait_for_text(page, ".readouts", "watchdog")
    page.locator('[data-name="experiment"]').select_option("sweep")
    button(page, "Start").click()
    page.wait_for_selector('[data-name="start"][aria-disabled="true"]')
    page.evaluate(BUSY, KEEPS_PYTHON_BUSY)
    page.wait_for_function("window.said.includes('busy')")
    button(page, "STOP").click()
    page.wait_for_function("window.ended")
    assert page.evaluate("window.said").split() == ["busy", "0"]
    wait_for_text(page, ".readouts", "The motor is at 0 V.")
