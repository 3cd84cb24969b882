"""The explorers' colours, read from their style sheet: contrast (WCAG 2.2), and what a colour-blind reader sees."""

import itertools
import re

import numpy as np
import pytest
from checkout import ROOT
from contrast import XYZ, contrast, linear

CSS = (ROOT / "labcourse" / "scene" / "explorer.css").read_text(encoding="utf-8")
# Machado, Oliveira, Fernandes (2009), severity 1, on linear RGB.
SEEN_WITH = {
    "usual vision": np.eye(3),
    "protanopia": np.array(
        [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]]
    ),
    "deuteranopia": np.array(
        [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]]
    ),
    "tritanopia": np.array(
        [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602], [0.004733, 0.691367, 0.303900]]
    ),
}


def colours(theme):
    blocks = re.findall(r"([^{}]*\.labcourse-explorer) \{([^{}]*)\}", CSS)
    selector, block = next(
        (one, text) for one, text in blocks if "--page" in text and ("false" in one) == (theme == "dark")
    )
    assert selector
    return {name: value for name, value in re.findall(r"--([a-z]+): (#[0-9a-f]{6})", block)}


def lab(rgb):
    xyz = XYZ @ np.clip(rgb, 0, 1) / (XYZ @ np.ones(3))
    f = np.where(xyz > 0.008856, np.cbrt(xyz), 7.787 * xyz + 16 / 116)
    return np.array([116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])])


@pytest.mark.parametrize("theme", ["light", "dark"])
@pytest.mark.parametrize(
    ("ink", "least"),
    [
        ("text", 7.0),
        ("faint", 4.5),
        ("good", 4.5),
        ("bad", 4.5),
        *((curve, 3.0) for curve in ("measured", "model", "voltage", "highlight", "ghost", "reference", "edge")),
    ],
)
def test_what_is_to_be_read_stands_out_from_the_page(theme, ink, least):
    found = colours(theme)
    assert contrast(found[ink], found["page"]) >= least


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_buttons_can_be_read(theme):
    found = colours(theme)
    on_main = "#ffffff" if theme == "light" else "#000000"
    assert contrast(on_main, found["model"]) >= 4.5
    assert contrast("#ffffff", found["stop"]) >= 4.5
    assert contrast(found["text"], found["body"]) >= 4.5


@pytest.mark.parametrize("theme", ["light", "dark"])
@pytest.mark.parametrize("eyes", SEEN_WITH)
def test_curves_that_are_drawn_together_can_be_told_apart_by_everybody(theme, eyes):
    found = colours(theme)
    seen = {name: lab(SEEN_WITH[eyes] @ linear(found[name])) for name in ("measured", "model", "voltage", "highlight")}
    for one, other in itertools.combinations(seen, 2):
        assert np.linalg.norm(seen[one] - seen[other]) > 12, (one, other)
