"""The explorers in the JupyterLab that students use: opened, dragged, typed at, stopped."""

import json

import browser
import explorer_notebooks
import pytest
from checkout import ROOT
from explorer_notebooks import middle, run_to_the_end, settled

from rotflex.widgets.placement import design

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


@pytest.fixture
def opened(served, request):
    """The explorer that the test names, in a page; whatever the test does there, the page stays in order."""
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

    handle = page.locator('.handle[data-name="pair"]')
    pair = complex(float(handle.get_attribute("data-x")), float(handle.get_attribute("data-y")))
    from rotflex.config import srv02  # the same by the plain function
    from rotflex.hil.student_benches import student_bench, student_seed
    from rotflex.model import state_space

    arms = student_bench(student_seed("ada")).joint
    system = state_space(srv02(), arms, arms.J_l * 20.7**2, input="voltage")
    expected = design(system.A, system.B, [pair, pair.conjugate(), -30, -40])
    assert gain(page) == pytest.approx(expected.K.ravel().tolist(), rel=2e-3)
    assert [
        ("not" in words) is not finding.met for words, finding in zip(verdicts(page), expected.findings, strict=True)
    ]

    button(page, "Keep this design").click()
    wait_for_text(page, ".labcourse-explorer .notice", "recorded")
    kept = json.loads((served[1] / "answers.json").read_text())["answers"]["3.8"]["K"]["value"]
    assert kept[0] == pytest.approx(expected.K.ravel().tolist(), rel=1e-5)
    button(page, "Figure for the report").click()
    wait_for_text(page, ".labcourse-explorer .notice", "pole_design.svg")
    assert (served[1] / "pole_design.png").read_bytes().startswith(b"\x89PNG")


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


@pytest.mark.scheduled
@pytest.mark.parametrize("opened", ["sweep"], indirect=True)
def test_the_sweep_explorer_runs_a_sweep_and_its_cursor_moves(opened):
    page = opened
    stiffness = page.locator("table.readout", has_text="Stiffness by the cursor")
    peaks = page.locator("table.readout", has_text="Peaks")
    before, said = stiffness.inner_text(), peaks.inner_text()
    page.locator('.handle[data-name="cursor"]').focus()
    page.keyboard.press("Shift+ArrowRight")
    settled(page)
    assert stiffness.inner_text() != before
    page.locator('[data-name="drive"]').select_option("voltage")
    page.wait_for_function(
        "said => [...document.querySelectorAll('table.readout')].every(table => table.innerText.trim() !== said)",
        arg=said.strip(),
    )
    assert "V" in page.locator("label.slider", has_text="amplitude").inner_text()


@pytest.mark.parametrize("opened", ["validation"], indirect=True)
def test_the_validation_explorer_follows_its_sliders_and_fits(opened):
    page = opened
    figures = page.locator("table.readout")
    before, picture = figures.inner_text(), painted(page)
    page.locator('[data-name="K_s"]').focus()
    page.keyboard.press("ArrowRight")
    settled(page)
    assert figures.inner_text() != before and painted(page) != picture
    button(page, "Fit").click()
    wait_for_text(page, ".labcourse-explorer .notice", "Fitted")
    assert float(figures.locator("tr", has_text="α").locator("td").first.inner_text().split()[0]) > 90


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


ASIDE = """([name, sign, degrees]) => {
    const aside = document.querySelector(`.handle[data-name="${name}"]`).getAttribute("aria-valuetext");
    return sign * parseFloat(aside) > degrees;
}"""


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
    page.mouse.up()
    wait_until_aside(-1, 3)
    page.locator('.handle[data-name="arm"]').focus()
    for _press in range(5):
        page.keyboard.down("ArrowRight")
    wait_until_aside(-1, 8)
    page.keyboard.up("ArrowRight")
    wait_until_aside(1, 3)
    button(page, "STOP").click()
    wait_for_text(page, ".readouts", "You stopped it.")


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


@pytest.mark.scheduled
@pytest.mark.parametrize("opened", ["console"], indirect=True)
def test_a_run_is_recorded_and_played(opened, served):
    page = opened
    run_to_the_end(page)
    picture = painted(page)
    page.locator(".player button").click()
    page.wait_for_function("parseFloat(document.querySelector('.player output').textContent) > 0.2")
    page.locator(".player button").click()
    assert painted(page) != picture
    button(page, "Save the recording").click()
    wait_for_text(page, ".labcourse-explorer .notice", "console_free_decay.mat")
    assert (served[1] / "console_free_decay.mat").exists()


@pytest.mark.scheduled
@pytest.mark.parametrize("opened", ["poles"], indirect=True)
def test_a_theme_that_changes_and_a_kernel_that_is_restarted_are_noticed(opened):
    page = opened
    light = painted(page)
    dark = "() => window.jupyterapp.commands.execute('apputils:change-theme', {theme: 'JupyterLab Dark'})"
    page.evaluate(dark)
    page.wait_for_selector('body[data-jp-theme-light="false"]', state="attached")
    settled(page)
    assert painted(page) != light
    page.evaluate("() => window.jupyterapp.shell.currentWidget.sessionContext.session.kernel.restart()")
    page.wait_for_timeout(1000)
    page.locator('[data-name="zeta"]').focus()
    page.keyboard.press("ArrowRight")
    wait_for_text(page, ".labcourse-explorer .notice", "run this cell again")


def test_the_page_needs_nothing_from_elsewhere():
    folder = ROOT / "labcourse" / "scene"
    for path in [*folder.glob("*.js"), *folder.glob("*.css")]:
        text = path.read_text(encoding="utf-8")
        assert "http" not in text and "import " not in text
