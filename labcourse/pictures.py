"""The style of all pictures. Their colours are :data:`labcourse.scene.scene.ROLES`."""

from __future__ import annotations

import base64
import io
import os
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import matplotlib as mpl
from matplotlib.figure import Figure
from PIL import Image

from labcourse import job

WIDTH = 7.0  #: inches; the width of every plot
DOTS_PER_INCH = 130  # crisp on paper and on dense screens ...
SHOWN_PER_INCH = 100  # ... while the notebook shows it at this size

STYLE: Any = {
    "axes.axisbelow": True,
    "axes.edgecolor": "#333333",
    "axes.grid": True,
    "axes.labelsize": 12,
    "axes.spines.right": False,
    "axes.spines.top": False,
    "figure.facecolor": "white",  # opaque: it must read on a dark notebook too
    "font.family": "DejaVu Sans",  # comes with matplotlib, so that figures are the same everywhere
    "font.size": 11,
    "grid.color": "#DDDDDD",
    "grid.linewidth": 0.8,
    "legend.fontsize": 10.5,
    "legend.frameon": False,
    "legend.handlelength": 2.8,
    "mathtext.fontset": "cm",
    "savefig.facecolor": "white",
    "xtick.labelsize": 10.5,
    "ytick.labelsize": 10.5,
}


@contextmanager
def style() -> Iterator[None]:
    """Use the course's matplotlib settings within a ``with`` block.

    Only these are restored afterwards. (``rc_context`` restores all: a pyplot that is first imported inside the block
    would lose the settings of its notebook backend, and students' plots would not show.)
    """
    before = {name: mpl.rcParams[name] for name in STYLE}
    mpl.rcParams.update(STYLE)
    try:
        yield
    finally:
        mpl.rcParams.update(before)


class Picture(Figure):
    """A matplotlib figure that carries its own description. Make it, and draw, within :func:`style`.

    Attributes
    ----------
    alt_text : a description, for somebody who cannot see it

    It is not registered with pyplot: nothing has to be closed, and a notebook shows it once.
    """

    alt_text: str = ""

    def _repr_mimebundle_(self, **_: Any) -> tuple[dict[str, str], dict[str, Any]]:
        """Return a notebook's display data and metadata."""
        if os.environ.get(job.PICTURES) == "off":
            return {"text/plain": repr(self)}, {}
        image = base64.b64encode(png(self)).decode("ascii")
        width = round(self.get_figwidth() * SHOWN_PER_INCH)
        return {"image/png": image, "text/plain": repr(self)}, {"image/png": {"alt": self.alt_text, "width": width}}


def png(figure: Figure) -> bytes:
    """Render a figure as an opaque PNG of 128 colours, which are enough for a plot, at a third of the size."""
    drawn, packed = io.BytesIO(), io.BytesIO()
    if figure.get_layout_engine() is None and any(axes.get_subplotspec() for axes in figure.axes):
        # Else a label may be cut off.
        figure.set_layout_engine("constrained")
    with style():
        figure.savefig(drawn, format="png", dpi=DOTS_PER_INCH, facecolor="white")
    Image.open(drawn).convert("RGB").quantize(128, Image.Quantize.FASTOCTREE).save(packed, format="PNG", optimize=True)
    return packed.getvalue()
