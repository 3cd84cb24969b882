"""How long it takes from an empty tab until a visitor's own bench answers a pull, and what a visitor loads for it.

    python benchmarks/front_door.py [--smoke]

Headless Chromium with an empty profile, before a static server on this machine, with Pyodide beside the page. Then the
times between two pictures, while a pole is dragged 60 times in a second and while the bench runs. Needs the wheel with
Pyodide that the tests need.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import pairwise
from pathlib import Path
from statistics import median, quantiles
from typing import Any

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT / "tests" / "helpers"), str(ROOT / "tools")]

import browser  # noqa: E402
import make_site  # noqa: E402
import pyodide_files  # noqa: E402
from static_server import Static, static  # noqa: E402
from website import try_it  # noqa: E402

MOVES = 60
PULLED = "() => parseFloat(document.querySelector('#bench .handle')?.getAttribute('aria-valuetext')) < -1"
WATCH = """(name) => {
    window.times = [];
    const explorer = document.querySelector(`#${name} .labcourse-explorer`);
    explorer.addEventListener('painted', () => window.times.push(performance.now()));
}"""


@contextmanager
def opened(served: Static) -> Iterator[Any]:
    """The page in an empty profile, from before it is asked for until the block ends."""
    context = browser.chromium().new_context(viewport={"width": 1280, "height": 1500})
    try:
        page = context.new_page()
        page.set_default_timeout(browser.PATIENCE)
        page.goto(f"{served.address}{try_it.FOLDER}/")
        yield page
    finally:
        context.close()


def take(page: Any, handle: str) -> tuple[float, float]:
    """Press the pointer on a handle, and return where it is, px."""
    box = page.locator(handle).first.bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    page.mouse.move(x, y)
    page.mouse.down()
    return x, y


def between(page: Any, name: str) -> str:
    """Describe the times between two pictures of an explorer since it is watched."""
    times = page.evaluate("() => window.times")
    apart = [later - sooner for sooner, later in pairwise(times)]
    return f"{name}: {median(apart):.0f} ms between two pictures (median), {quantiles(apart, n=20)[-1]:.0f} ms (95 %)"


def main() -> None:
    """The command."""
    parser = argparse.ArgumentParser(description="Time the page that needs no installation.")
    parser.add_argument("--smoke", action="store_true", help="one visit")
    visits = 1 if parser.parse_args().smoke else 5
    with tempfile.TemporaryDirectory() as folder:
        try_it.write(
            Path(folder) / try_it.FOLDER, make_site.arm(moving=True), try_it.TESTED._replace(address="../pyodide/")
        )
        taken = []
        for _ in range(visits):
            with static({"pyodide": pyodide_files.folder(), "": Path(folder)}) as served:
                began = time.perf_counter()
                with opened(served) as page:
                    page.wait_for_selector("body[data-stage=ready]")
                    x, y = take(page, "#bench .handle")
                    page.mouse.move(x + 80, y + 30, steps=3)
                    page.wait_for_function(PULLED)
                    taken.append(time.perf_counter() - began)
                    loaded = sum(served.sent.values()) / 1e6, served.gzipped() / 1e6
                    page.mouse.up()
                    page.evaluate(WATCH, "bench")
                    page.wait_for_timeout(2000)
                    running = between(page, "a bench that runs")
                    page.keyboard.press("Escape")
                    page.evaluate(WATCH, "poles")
                    x, y = take(page, "#poles .handle")
                    for step in range(MOVES):
                        page.mouse.move(x - step, y - step / 2)
                        page.wait_for_timeout(1000 / MOVES)
                    dragged = between(page, "a pole that is dragged")
    print(f"first picture after a pull: {', '.join(f'{one:.1f}' for one in taken)} s after the page was asked for")
    print(f"loaded: {loaded[0]:.1f} MB, gzipped {loaded[1]:.1f} MB")
    print(dragged, running, sep="\n")
    browser.close()


if __name__ == "__main__":
    main()
