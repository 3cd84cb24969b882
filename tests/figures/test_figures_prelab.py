"""The drawings of the modeling pre-lab: what they name, and that they hold to the conventions of the text."""

from __future__ import annotations

import itertools

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.patches import FancyArrowPatch

from rotflex import figures
from rotflex.figures import prelab

DRAWINGS = [prelab.trolley_with_pendulum, prelab.armature_circuit, prelab.parallel_axes]


def texts(figure):
    return [text for text in figure.findobj(mpl.text.Text) if text.get_text().strip()]


@pytest.mark.parametrize("draw", DRAWINGS)
def test_has_a_description_in_sentences(draw):
    description = draw().alt_text
    assert len(description) > 50
    assert description[0].isupper()
    assert description.endswith(".")
    assert not set(description) & set("\n$\\{}")


@pytest.mark.parametrize("draw", DRAWINGS)
def test_no_words_are_cut_off_or_on_top_of_each_other(draw):
    figure = draw()
    with figures.style():
        canvas = FigureCanvasAgg(figure)
        figure.draw_without_rendering()
        boxes = [(text.get_text(), text.get_window_extent(canvas.get_renderer())) for text in texts(figure)]
    width, height = canvas.get_width_height()
    for words, box in boxes:
        assert min(box.x0, box.y0, width - box.x1, height - box.y1) >= 0, f"{words!r} is cut"
    for (one, a), (other, b) in itertools.combinations(boxes, 2):
        overlap = min(a.x1, b.x1) - max(a.x0, b.x0), min(a.y1, b.y1) - max(a.y0, b.y0)
        assert min(overlap) < 2, f"{one!r} and {other!r} overlap"


@pytest.mark.parametrize(
    ("draw", "symbols"),
    [
        (prelab.trolley_with_pendulum, ["$s$", r"$\phi$", "$k$", "$M$", "$m$", r"$\ell$", "$F$"]),
        (prelab.armature_circuit, ["$V_m$", "$R_m$", "$i_m$", "k_m", r"$\omega_m$", "K_g", r"\dot\theta", r"\tau"]),
        (prelab.parallel_axes, [r"$\vec d$", r"$\vec\rho$", "$dm$", "centre of mass", "new axis"]),
    ],
)
def test_names_every_part_of_the_text(draw, symbols):
    words = " ".join(text.get_text() for text in texts(draw()))
    assert [symbol for symbol in symbols if symbol not in words] == []


def test_arrows_of_the_parallel_axis_theorem_add_up():
    arrows = [patch for patch in prelab.parallel_axes().axes[0].patches if isinstance(patch, FancyArrowPatch)]
    d, rho, total = (arrow._path_original.vertices[-1] - arrow._path_original.vertices[0] for arrow in arrows)
    np.testing.assert_allclose(d + rho, total)
