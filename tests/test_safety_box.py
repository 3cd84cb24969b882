"""The boxes that warn of a real bench can be read, whichever theme JupyterLab has."""

import json
import re

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
