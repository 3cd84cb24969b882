"""How long it takes from `rotflex lab` until the arm is there, and whether a key that is pressed meanwhile is lost.

    python benchmarks/starts.py --starts 20

JupyterLab and headless Chromium on this machine, each start in a new folder; then the same beside two busy processes.
The browser is there already. No key is pressed until the arm is drawn. Then keys: a notebook opens, and some seconds
after its cells are visible Shift+Enter is pressed, in its first cell or in an answer cell. The cell runs, or the page
says at once that it waits, or the key is lost.
"""

from __future__ import annotations

import argparse
import contextlib
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from statistics import quantiles
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "tests" / "helpers"))

import browser  # noqa: E402

ARM = ".labcourse-explorer[data-version] canvas"
LONGEST = 120  # s to wait for an arm or a cell
DELAYS = (0.3, 1.0, 2.0)  # s from cells that are visible to the key
KEYS = {"first cell": ("00_start.ipynb", "console"), "answer cell": ("02_finding_stiffness.ipynb", "q2-9")}
OPTIONS = ("--student", "ada", "--", "--expose-app-in-browser")
IS_VISIBLE = """(id) => {
    const panel = window.jupyterapp?.shell.currentWidget;
    return Boolean(panel?.context?.isReady && panel.content.widgets?.some((cell) => cell.model.id === id));
}"""
CLICK = """(id) => {
    const {content} = window.jupyterapp.shell.currentWidget;
    content.activeCellIndex = content.widgets.findIndex((cell) => cell.model.id === id);
    content.activate();
}"""
HAS_RUN = """(id) => window.jupyterapp.shell.currentWidget.content.widgets
    .find((cell) => cell.model.id === id).model.executionCount"""


@contextlib.contextmanager
def opened(address: str, notebook: str) -> Iterator[Any]:
    """Open a notebook's page, in a browser that knows nothing yet."""
    page = browser.chromium().new_page(viewport={"width": 1280, "height": 720})
    try:
        page.set_default_timeout(1000 * LONGEST)
        page.goto(f"{address}/lab/tree/{notebook}?token={browser.TOKEN}&reset")
        yield page
    finally:
        page.close()


def start() -> tuple[float, float]:
    """Return the seconds from the command to the arm, and from the page to the arm; infinite without an arm."""
    from playwright.sync_api import Error

    with tempfile.TemporaryDirectory() as folder:
        began = time.perf_counter()
        with browser.jupyterlab(Path(folder, "work"), *OPTIONS) as address:
            served = time.perf_counter()
            with contextlib.suppress(Error), opened(address, "00_start.ipynb") as page:
                page.wait_for_selector(ARM)
                there = time.perf_counter()
                return there - began, there - served
    return float("inf"), float("inf")


def key(address: str, notebook: str, cell: str, delay: float) -> str:
    """Press Shift+Enter in a cell, some seconds after it is visible, and return what becomes of it."""
    from playwright.sync_api import Error

    try:
        with opened(address, notebook) as page:
            page.wait_for_function(IS_VISIBLE, arg=cell)
            page.wait_for_timeout(1000 * delay)
            page.evaluate(CLICK, cell)
            page.keyboard.press("Shift+Enter")
            is_said = page.get_by_text("Python is starting").is_visible()
            with contextlib.suppress(Error):
                page.wait_for_function(HAS_RUN, arg=cell)
                return "ran"
            return "said" if is_said else "lost"
    finally:
        browser.end_kernels(address)


@contextlib.contextmanager
def busy(count: int) -> Iterator[None]:
    """Keep processes busy."""
    processes = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(count)]
    try:
        yield
    finally:
        for process in processes:
            process.kill()
            process.wait()


def show(name: str, seconds: list[float]) -> None:
    """Print median, 95th percentile and largest time, and how many starts have no arm."""
    there = sorted(value for value in seconds if value < float("inf"))
    cuts = quantiles(there, n=20, method="inclusive") if len(there) > 1 else there * 19
    figures = f"{cuts[9]:9.1f}{cuts[18]:9.1f}{there[-1]:9.1f}" if there else "        –" * 3
    print(f"{name:40}{figures}{len(seconds) - len(there):9}{len(seconds):9}", flush=True)


def press_keys(presses: int, delays: tuple[float, ...], beside: str) -> None:
    """Press keys while notebooks open, and print what becomes of them."""
    with tempfile.TemporaryDirectory() as folder, browser.jupyterlab(Path(folder, "work"), *OPTIONS) as address:
        browser.end_kernels(address)  # each key has a new kernel
        for name, (notebook, cell) in KEYS.items():
            for delay in delays:
                ends = Counter(key(address, notebook, cell, delay) for _ in range(presses))
                counts = ", ".join(f"{ends[end]} {end}" for end in ("ran", "said", "lost"))
                print(f"key in the {name} after {delay} s, {beside}: {counts}", flush=True)


def main() -> None:
    """Measure, and print a table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--starts", type=int, default=20)
    parser.add_argument("--keys", type=int, default=5, help="presses for each cell and delay")
    parser.add_argument("--smoke", action="store_true", help="one start, one key, and nothing busy")
    given = parser.parse_args()
    starts, presses = (1, 1) if given.smoke else (given.starts, given.keys)
    delays = DELAYS[:1] if given.smoke else DELAYS
    browser.chromium()
    try:
        print(f"{'seconds':40}{'median':>9}{'p95':>9}{'most':>9}{'no arm':>9}{'starts':>9}")
        for count in (0,) if given.smoke else (0, 2):
            with busy(count):
                beside = f"beside {count} busy processes" if count else "idle"
                whole, page = zip(*(start() for _ in range(starts)), strict=True)
                show(f"rotflex lab → arm, {beside}", list(whole))
                show(f"page → arm, {beside}", list(page))
                press_keys(presses, delays, beside)
    finally:
        browser.close()


if __name__ == "__main__":
    main()
