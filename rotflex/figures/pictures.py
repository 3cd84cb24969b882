"""How the laboratory's figures look, and how a notebook shows one.

The colours are Okabe and Ito's, which people with any kind of colour vision can tell apart. Each stands for one thing
throughout the course, and what is drawn together differs in line style too, so that a grey print can be read.
"""

from __future__ import annotations

import base64
import html
import io
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import matplotlib as mpl
from matplotlib.figure import Figure
from PIL import Image

from rotflex.errors import RotflexError

BLACK, BLUE, VERMILLION, GREEN, PURPLE = "#000000", "#0072B2", "#D55E00", "#009E73", "#CC79A7"

#: What a line stands for -> how it is drawn. Keyword arguments of ``Axes.plot``.
ROLES: dict[str, dict[str, Any]] = {
    "reference": {"color": BLACK, "linestyle": (0, (5, 2)), "linewidth": 1.2},
    "measured": {"color": VERMILLION, "linestyle": "-", "linewidth": 1.5},
    "model": {"color": BLUE, "linestyle": (0, (6, 1.5, 1.5, 1.5)), "linewidth": 1.8},
    "voltage": {"color": GREEN, "linestyle": "-", "linewidth": 1.2},
    "highlight": {"color": PURPLE, "linestyle": (0, (1.2, 1.2)), "linewidth": 2.0},
}

WIDTH = 7.0  #: inches; the width of every plot
DOTS_PER_INCH = 130  # crisp on paper and on dense screens ...
SHOWN_PER_INCH = 100  # ... while the notebook shows it at this size
#: Environment variable; "off" draws no image, as where nobody looks at the notebook.
PICTURES_SWITCH = "LABCOURSE_PICTURES"

_DRAWINGS = Path(__file__).with_name("drawings")
_STYLE = mpl.rc_params_from_file(Path(__file__).with_name("laboratory.mplstyle"), use_default_template=False)


@contextmanager
def style() -> Iterator[None]:
    """Use the laboratory's matplotlib settings within a ``with`` block.

    Only these are restored afterwards. (``rc_context`` restores all: a pyplot that is first imported inside the block
    would lose its notebook backend's settings, and students' plots would not show.)
    """
    before = {name: mpl.rcParams[name] for name in _STYLE}
    mpl.rcParams.update(_STYLE)
    try:
        yield
    finally:
        mpl.rcParams.update(before)


class Picture(Figure):
    """A matplotlib figure that carries its own description.

    Attributes
    ----------
    alt_text : what is to be seen, for somebody who cannot see it

    It is not registered with pyplot: nothing has to be closed, and a notebook shows it once.
    """

    alt_text: str = ""

    def _repr_mimebundle_(self, **_: Any) -> tuple[dict[str, str], dict[str, Any]]:
        return bundle(self, self.alt_text)


def new_picture(width: float, height: float) -> Picture:
    """An empty picture of the given size (inches). Call it, and draw, within ``style()``."""
    return Picture(figsize=(width, height), layout="constrained")


def png(figure: Figure) -> bytes:
    """The figure as an opaque PNG image, of 128 colours: a third of the size, and none is missed in a plot."""
    drawn, packed = io.BytesIO(), io.BytesIO()
    if figure.get_layout_engine() is None and any(axes.get_subplotspec() for axes in figure.axes):
        # Else a label may be cut off.
        figure.set_layout_engine("constrained")
    with style():
        figure.savefig(drawn, format="png", dpi=DOTS_PER_INCH, facecolor="white")
    Image.open(drawn).convert("RGB").quantize(128, Image.Quantize.FASTOCTREE).save(packed, format="PNG", optimize=True)
    return packed.getvalue()


def bundle(figure: Figure, alt: str) -> tuple[dict[str, str], dict[str, Any]]:
    """A notebook's display data and metadata for a figure."""
    if os.environ.get(PICTURES_SWITCH) == "off":
        return {"text/plain": repr(figure)}, {}
    image = base64.b64encode(png(figure)).decode("ascii")
    width = round(figure.get_figwidth() * SHOWN_PER_INCH)
    return {"image/png": image, "text/plain": repr(figure)}, {"image/png": {"alt": alt, "width": width}}


def show(figure: Figure, alt: str | None = None, caption: str | None = None) -> None:
    """Show a figure in the notebook, with a description for those who cannot see it, and close it.

    Parameters
    ----------
    figure : any matplotlib figure
    alt : what is to be seen; the figures of this package bring their own
    caption : Markdown, shown below the figure

    The description goes into the image's metadata, and again below the caption, folded away: neither JupyterLab nor
    nbconvert's usual template hands an image's metadata to a screen reader. Outside a notebook there is nowhere to show
    the figure: it is checked and closed. Where nobody looks (``LABCOURSE_PICTURES=off`` in the environment), it is not
    drawn.

    Raises
    ------
    RotflexError
        If there is no description.
    """
    alt = alt or getattr(figure, "alt_text", "")
    if not alt:
        raise RotflexError(
            "The figure has no description: give one, as in show(figure, alt='The speed against time.')."
        )
    data, metadata = bundle(figure, alt)
    if "matplotlib.pyplot" in sys.modules:
        sys.modules["matplotlib.pyplot"].close(figure)
    _publish(data, metadata, alt, caption)


def show_drawing(name: str, caption: str | None = None) -> None:
    """Show a drawing of the laboratory in the notebook, with its description for those who cannot see it.

    Parameters
    ----------
    name : of a file in ``rotflex/figures/drawings``, without ``.svg``; the description is the file's ``<desc>``
    caption : Markdown, shown below the drawing

    If nobody looks (``LABCOURSE_PICTURES=off`` in the environment), the image is left out.

    Raises
    ------
    RotflexError
        If there is no drawing of this name.
    """
    files = {path.stem: path for path in _DRAWINGS.glob("*.svg")}
    if name not in files:
        raise RotflexError(f"There is no drawing {name!r}. These exist: {', '.join(sorted(files))}.")
    svg = files[name].read_bytes()
    alt = ElementTree.fromstring(svg).findtext("{*}desc", "")
    data = {"text/plain": f"<drawing {name}>"}
    if os.environ.get(PICTURES_SWITCH) != "off":
        # An image in HTML: JupyterLab shows image/svg+xml in trusted notebooks only, and without its description.
        source = base64.b64encode(svg).decode("ascii")
        data["text/html"] = f'<img alt="{html.escape(alt)}" src="data:image/svg+xml;base64,{source}">'
    _publish(data, {}, alt, caption)


def _publish(data: dict[str, str], metadata: dict[str, Any], alt: str, caption: str | None) -> None:
    """Display a figure's data, then its caption and its folded description; nothing outside a notebook."""
    from IPython.core.interactiveshell import InteractiveShell
    from IPython.display import display

    if not InteractiveShell.initialized():
        return
    display(data, metadata=metadata, raw=True)
    folded = f"<details><summary>The figure in words</summary>{html.escape(alt)}</details>"
    words = [caption, folded] if caption else [folded]
    display({"text/markdown": "\n\n".join(words), "text/plain": caption or alt}, raw=True)
