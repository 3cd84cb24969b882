"""How quick the explorers are in a browser, against `interact` with inline matplotlib, in one run.

    python benchmarks/explorers.py --changes 60

JupyterLab and headless Chromium on this machine. A time begins when the page hears of a change, and ends with the frame
after the new picture is there. Both sides place the same poles and simulate the same response, and draw the same four
plots. Then: the time from a pull at the console's arm until the picture has the arm elsewhere, with some 10 ms in which
the arm begins to move, against the same yardstick; updates a second while a pole is dragged, pictures a second of the
bench console's animation (live and in recorded time), and the time from pressing STOP in the page until the motor is at
0 V in Python.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from statistics import quantiles
from typing import Any

import nbformat
import playwright.sync_api

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "tests" / "helpers"))

import browser  # noqa: E402

KERNEL = {"kernelspec": {"name": "python3", "display_name": "Python 3", "language": "python"}}
BEGIN = """
import numpy as np
import rotflex.course.lab
from rotflex import model
from rotflex import widgets
lab = rotflex.course.lab.start("ada", quiet=True)
system = model.state_space(lab.servo, lab.joint, lab.joint.J_l * 20.7**2, input="voltage")
A, B = np.asarray(system.A), np.asarray(system.B)
"""
YARDSTICK = """
import matplotlib.pyplot as plt
from ipywidgets import FloatSlider, interact

@interact(zeta=FloatSlider(value=0.6, min=0.2, max=0.99, step=0.005))
def shown(zeta):
    found = widgets.design(A, B, widgets.Dominant(zeta).poles)
    figure = plt.figure(figsize=(9.5, 4.6), layout="constrained")
    plane, *rest = figure.subplot_mosaic([["s", "a"], ["s", "b"], ["s", "c"]]).values()
    plane.plot(found.poles.real, found.poles.imag, "x")
    recording = found.recording
    curves = recording.degrees("theta"), recording.degrees("alpha"), recording["vm"]
    for axes, curve, limit in zip(rest, curves, (20.8, 12.5, 10.0)):
        axes.plot(recording.time, curve)
        axes.axhline(limit, linestyle=":")
    plt.show()
"""
CELLS = {
    "yardstick": YARDSTICK,
    "poles": "widgets.explore_poles(A, B)",
    "console": "console = widgets.open_console(lab, K=[18.2, -17.2, 1.59, 0.633])\nconsole",
}

# Times of isolated changes, ms: the change, then the first frame after the new picture is there.
SLIDER = """async (changes) => {
    const host = document.querySelector('.labcourse-explorer'), input = host.querySelector('[data-name=zeta]');
    const times = [];
    for (let i = 0; i < changes; i++) {
        const version = Number(host.dataset.version);
        times.push(await new Promise((done) => {
            const began = performance.now();
            const heard = (event) => {
                if (event.detail <= version) return;
                host.removeEventListener('painted', heard);
                requestAnimationFrame(() => done(performance.now() - began));
            };
            host.addEventListener('painted', heard);
            input.value = 0.3 + 0.6 * ((i * 7) % changes) / changes;
            input.dispatchEvent(new Event('input', {bubbles: true}));
        }));
        await new Promise((rest) => setTimeout(rest, 100));
    }
    return times;
}"""
INTERACT = """async (changes) => {
    const output = document.querySelector('.jp-OutputArea-output .jupyter-widgets, .jp-OutputArea');
    const handle = document.querySelector('.noUi-handle');
    const times = [];
    for (let i = 0; i < changes; i++) {
        times.push(await new Promise((done) => {
            const began = performance.now();
            const watch = new MutationObserver((records) => {
                for (const record of records) for (const node of record.addedNodes) {
                    const image = node.querySelector?.('img') ?? (node.tagName === 'IMG' ? node : null);
                    if (!image) continue;
                    watch.disconnect();
                    const end = () => requestAnimationFrame(() => done(performance.now() - began));
                    if (image.complete) end(); else image.addEventListener('load', end, {once: true});
                    return;
                }
            });
            watch.observe(document.body, {childList: true, subtree: true});
            handle.dispatchEvent(new KeyboardEvent('keydown', {key: 'ArrowRight', bubbles: true, cancelable: true}));
        }));
        await new Promise((rest) => setTimeout(rest, 100));
    }
    return times;
}"""
COUNT_IMAGES = """() => {
    window.images = 0;
    new MutationObserver((records) => {
        for (const record of records) for (const node of record.addedNodes)
            if (node.querySelector?.('img') || node.tagName === 'IMG') window.images += 1;
    }).observe(document.body, {childList: true, subtree: true});
}"""
COUNT_VERSIONS = """() => {
    window.versions = new Set(); window.frames = 0;
    document.querySelector('.labcourse-explorer').addEventListener('painted', (event) => {
        window.versions.add(event.detail); window.frames += 1;
    });
}"""
RUN = """async (code) => {
    const kernel = window.jupyterapp.shell.currentWidget.sessionContext.session.kernel;
    const future = kernel.requestExecute({code});
    let said = '';
    future.onIOPub = (message) => { if (message.header.msg_type === 'stream') said += message.content.text; };
    await future.done;
    return said;
}"""
STOP = """() => new Promise((done) => {
    const button = document.querySelector('[data-name=stop]');
    const tell = () => done(performance.timeOrigin + performance.now());
    button.addEventListener('click', tell, {once: true, capture: true});
    button.click();
})"""
DRAG_SECONDS, DRAG_RATE = 4.0, 60.0  # s, moves a second
STOPS = 20


def shown(what: str, times: list[float]) -> tuple[float, float]:
    """Print median and 95th percentile (ms), and return them."""
    cuts = quantiles(times, n=20, method="inclusive")
    print(f"{what:44}{cuts[9]:9.0f}{cuts[18]:9.0f}{len(times):6}")
    return cuts[9], cuts[18]


def drag(page: Any, place: tuple[float, float], lasts: float) -> float:
    """Move the mouse, button down, as fast as a hand does; returns the seconds that it took."""
    x, y = place
    page.mouse.move(x, y)
    page.mouse.down()
    began = time.perf_counter()
    count = round(lasts * DRAG_RATE)
    for number in range(count):
        page.mouse.move(x - 40 * (number % 60) / 60, y + 30 * (number % 45) / 45)
        time.sleep(max(0.0, began + (number + 1) / DRAG_RATE - time.perf_counter()))
    taken = time.perf_counter() - began
    page.mouse.up()
    return taken


def dragged_times(page: Any, place: tuple[float, float], changes: int, handle: str = "", rest: int = 60) -> list[float]:
    """Times (ms) from one movement of the mouse to the picture that shows it: of a given handle, elsewhere.

    ``rest`` is how long to wait after each, ms.
    """
    page.evaluate(
        """(handle) => {
        const at = () => handle && document.querySelector(handle).style.transform;
        let before = "";
        const host = document.querySelector('.labcourse-explorer');
        window.times = []; let began = null, version = 0;
        host.addEventListener('pointermove', () => {
            began ??= performance.now();
            version = Number(host.dataset.version);
            before = at();
        }, true);
        host.addEventListener('painted', (event) => {
            if (began === null || event.detail <= version || (handle && at() === before)) return;
            const since = began; began = null;
            requestAnimationFrame(() => window.times.push(performance.now() - since));
        });
    }""",
        handle,
    )
    x, y = place
    page.mouse.move(x, y)
    page.mouse.down()
    page.wait_for_timeout(rest)
    page.evaluate("() => { window.times.length = 0; }")
    for number in range(changes):
        page.evaluate("() => { window.seen = window.times.length; }")
        page.mouse.move(x - 3 * (number % 9) - 1, y + 2 * (number % 7) + 1)
        page.wait_for_function("() => window.times.length > window.seen")
        page.wait_for_timeout(rest)
    page.mouse.up()
    return list(page.evaluate("() => window.times"))


def middle(page: Any, selector: str) -> tuple[float, float]:
    """Where an element is."""
    box = page.locator(selector).bounding_box()
    return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2


def yardstick(address: str, changes: int, lasts: float) -> tuple[float, float]:
    """`interact` with inline matplotlib."""
    with browser.visit(address, "yardstick.ipynb") as seen:
        browser.run_all(seen)
        seen.page.wait_for_selector(".jp-OutputArea-output img")
        seen.page.evaluate(INTERACT, 5)
        found = shown("interact, slider → picture", seen.page.evaluate(INTERACT, changes))
        seen.page.evaluate(COUNT_IMAGES)
        drag(seen.page, middle(seen.page, ".noUi-handle"), lasts)
        print(f"{'interact, updates/s in a drag':44}{seen.page.evaluate('() => window.images') / lasts:9.1f}")
        return found


def poles(address: str, changes: int, lasts: float) -> list[tuple[float, float]]:
    """The pole explorer."""
    with browser.visit(address, "poles.ipynb") as seen:
        browser.run_all(seen)
        page = seen.page
        page.wait_for_selector(".labcourse-explorer[data-version]")
        page.evaluate(SLIDER, 5)
        found = [shown("pole explorer, slider → picture", page.evaluate(SLIDER, changes))]
        handle = '.handle[data-name="pair"]'
        found.append(shown("pole explorer, drag → picture", dragged_times(page, middle(page, handle), changes)))
        page.evaluate(COUNT_VERSIONS)
        taken = drag(page, middle(page, handle), lasts)
        print(f"{'pole explorer, updates/s in a drag':44}{page.evaluate('() => window.versions.size') / taken:9.1f}")
        taken_p3 = drag(page, middle(page, '.handle[data-name="p3"]'), lasts)
        rate = page.evaluate("() => window.versions.size") / (taken + taken_p3)
        print(f"{'  and with the region drawn anew (both drags)':44}{rate:9.1f}")
        return found


def arm(address: str, changes: int) -> tuple[float, float]:
    """The bench console's arm, pulled while the servo is held."""
    with browser.visit(address, "console.ipynb") as seen:
        browser.run_all(seen)
        page = seen.page
        page.wait_for_selector(".labcourse-explorer[data-version]")
        handle = '.handle[data-name="arm"]'
        times: list[float] = []
        while len(times) < changes:  # a run takes 20 s
            pulls = min(20, changes - len(times))
            times += dragged_times(page, middle(page, handle), pulls, handle, rest=500)
            page.locator('[data-name="stop"]').click()
            page.wait_for_selector('[data-name="start"][aria-disabled="false"]')
        return shown("console, pull → arm", times)


def console(address: str, stops: int) -> None:
    """The bench console: animation, and STOP."""
    with browser.visit(address, "console.ipynb") as seen:
        browser.run_all(seen)
        page = seen.page
        page.locator(".labcourse-explorer").get_by_role("button", name="Start", exact=True).click()
        page.wait_for_timeout(2000)
        page.evaluate(COUNT_VERSIONS)
        page.wait_for_timeout(3000)
        print(f"{'console, pictures/s live':44}{page.evaluate('() => window.versions.size') / 3:9.1f}")
        page.wait_for_function("document.querySelector('.readouts').textContent.includes('finished')")
        print(f"  missed deadlines: {page.evaluate(RUN, 'print(console._run.late, len(console.recording))').strip()}")
        page.locator(".player button").click()
        page.evaluate("() => { window.frames = 0; }")
        page.wait_for_timeout(3000)
        print(f"{'console, pictures/s in recorded time':44}{page.evaluate('() => window.frames') / 3:9.1f}")
        times = []
        for _ in range(stops):
            page.locator('[data-name="experiment"]').select_option("sweep")
            page.locator(".labcourse-explorer").get_by_role("button", name="Start", exact=True).click()
            page.wait_for_selector('[data-name="start"][aria-disabled="true"]')
            page.wait_for_timeout(900)
            pressed = page.evaluate(STOP)
            page.wait_for_selector('[data-name="start"][aria-disabled="false"]')
            stopped = float(page.evaluate(RUN, "print(repr(console._run.at_zero))"))
            times.append(1000 * stopped - pressed)
        shown("console, STOP → 0 V", times)


def measured(parts: Mapping[str, Callable[[], Any]]) -> tuple[dict[str, Any], list[str]]:
    """Measure one part after the other: what each found, and which failed by the browser's timeout or a closed page."""
    found, failed = dict[str, Any](), list[str]()
    for name, measure in parts.items():
        try:
            found[name] = measure()
        except (playwright.sync_api.Error, AssertionError) as error:  # the latter of JupyterLab
            failed.append(f"{name}: {error}")
    return found, failed


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--changes", type=int, default=60)
    parser.add_argument("--smoke", action="store_true", help="few changes, short drags, two stops")
    asked = parser.parse_args()
    changes, lasts, stops = (3, 0.5, 2) if asked.smoke else (asked.changes, DRAG_SECONDS, STOPS)
    print(f"{os.cpu_count()} processors; load before: {os.getloadavg()[0]:.1f}")
    print(f"{'':44}{'p50, ms':>9}{'p95, ms':>9}{'n':>6}", flush=True)
    with tempfile.TemporaryDirectory(prefix="rotflex-benchmark-") as scratch:
        folder = Path(scratch) / "work"
        with browser.jupyterlab(folder, "--student", "ada", "--", "--expose-app-in-browser") as address:
            for name, cell in CELLS.items():
                cells = [nbformat.v4.new_code_cell(source) for source in (BEGIN, cell)]
                nbformat.write(nbformat.v4.new_notebook(cells=cells, metadata=KERNEL), folder / f"{name}.ipynb")
            parts = {
                "interact": lambda: yardstick(address, changes, lasts),
                "pole explorer": lambda: poles(address, changes, lasts),
                "arm": lambda: arm(address, changes),
                "console": lambda: console(address, stops),
            }
            found, failed = measured(parts)
    if "interact" in found:
        theirs = found["interact"]
        ours = dict(zip(("pole slider", "pole drag"), found.get("pole explorer", ()), strict=False))
        for name, (p50, p95) in (ours | {"pull": found["arm"]} if "arm" in found else ours).items():
            print(f"{name}: {theirs[0] / p50:.1f} times quicker than interact at p50, {theirs[1] / p95:.1f} at p95")
    if failed:
        raise SystemExit("\nfailed:\n" + "\n".join(failed))


if __name__ == "__main__":
    main()
