"""The boxes that warn of a real bench can be read, in JupyterLab's light theme and in its dark one."""

import json
import re

import browser
import pytest
from checkout import ROOT
from contrast import contrast

WARNING = re.compile(r'<div class="alert alert-block alert-warning"([^>]*)>')
BOXES = [
    (path.name, found)
    for path in sorted((ROOT / "notebooks").glob("*.ipynb"))
    for cell in json.loads(path.read_text(encoding="utf-8"))["cells"]
    for found in WARNING.findall("".join(cell["source"]))
]


@pytest.mark.parametrize(("name", "attributes"), BOXES)
def test_a_warning_brings_colours_of_its_own_that_can_be_read(name, attributes):
    """JupyterLab's own are 2.99 to 1 (light) and 2.13 to 1 (dark)."""
    ink, paper = re.search(r'style="color: (#[0-9a-f]{6}); background-color: (#[0-9a-f]{6})"', attributes).groups()
    assert contrast(ink, paper) >= 4.5


COLOURS = """() => {
    const box = document.querySelector('.alert-warning'), style = getComputedStyle(box);
    return [style.color, style.backgroundColor];
}"""


def as_hex(colour):
    red, green, blue = map(int, re.findall(r"[0-9]+", colour)[:3])
    assert not colour.startswith("rgba")  # it covers what is behind it
    return f"#{red:02x}{green:02x}{blue:02x}"


@pytest.mark.skipif(browser.CHROMIUM is None, reason="chromium is not installed (apt-get install chromium)")
def test_in_jupyterlab_the_box_can_be_read_in_both_themes(jupyterlab):
    jupyterlab.course("boxes")
    with browser.visit(jupyterlab.address, "boxes/00_start.ipynb") as seen:
        for theme, light in (("Dark", "false"), ("Light", "true")):  # the last one stays
            change = "name => window.jupyterapp.commands.execute('apputils:change-theme', {theme: name})"
            seen.page.evaluate(change, f"JupyterLab {theme}")
            seen.page.wait_for_selector(f'body[data-jp-theme-light="{light}"]', state="attached")
            seen.page.wait_for_timeout(500)
            seen.page.wait_for_selector(".alert-warning")
            ink, paper = map(as_hex, seen.page.evaluate(COLOURS))
            assert contrast(ink, paper) >= 4.5, theme
