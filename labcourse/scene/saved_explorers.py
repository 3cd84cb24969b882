"""An explorer or a course bar in a saved notebook: a picture or HTML, and what to do to have it again.

JupyterLab shows a widget's view wherever an output has one, whatever else is beside it, and without the kernel that
made it says "Loading widget..." for ever, or that there is no model. So a saved notebook has the picture instead; the
page that is open keeps its widgets.
"""

from __future__ import annotations

import html
from collections.abc import Mapping
from typing import Any

VIEW = "application/vnd.jupyter.widget-view+json"  #: a live widget's kind of output
EXPLORER, BAR = "explorer", "bar"  #: in that output's metadata: what the widget is
_SHOWN_NOW = "labcourse_bar"  # in the notebook's metadata: the bar's HTML, as the page shows it at this moment
_PICTURE = "This is a picture of the explorer as it began."
_RUN_CELL = "To use the explorer, run this cell."
_RUN_ABOVE = (
    "As it was saved. To have it as it is now, click into the cell where you go on, and choose Run → Run All Above "
    "Selected Cell."
)


def with_pictures(model: Mapping[str, Any], **_others: Any) -> None:
    """Put pictures in the place of widgets, in a notebook that is about to be saved: a server's ``pre_save_hook``."""
    if model.get("type") != "notebook" or not model.get("content"):
        return
    bar = model["content"].get("metadata", {}).pop(_SHOWN_NOW, None)
    for cell in model["content"].get("cells", []):
        for output in cell.get("outputs", []):
            mark = output.get("metadata", {}).get(VIEW, {})
            if mark.get(EXPLORER):
                _replace(output)
            elif mark.get(BAR):
                shown = bar if isinstance(bar, str) else _text(output["data"].get("text/html", ""))
                _put(output, f"{shown}\n<p><b>{_RUN_ABOVE}</b></p>")


def _put(output: dict[str, Any], shown: str) -> None:
    output["data"].pop(VIEW, None)
    output["metadata"].pop(VIEW)
    output["data"]["text/html"] = shown


def _replace(output: dict[str, Any]) -> None:
    data, metadata = output["data"], output["metadata"]
    picture, about = _text(data.pop("image/png", "")).replace("\n", ""), metadata.pop("image/png", {})
    above, shown = _RUN_CELL, _text(data.get("text/html", ""))
    if picture:
        alt = html.escape(about.get("alt", ""), quote=True)
        above = f"{_PICTURE} {_RUN_CELL}"
        shown = f'<img src="data:image/png;base64,{picture}" alt="{alt}" width="{int(about.get("width", 0)) or ""}">'
    elif not shown:
        shown = f"<p>{html.escape(_text(data.get('text/plain', '')))}</p>"
    _put(output, f"<p><b>{above}</b></p>\n{shown}")


def _text(value: str | list[str]) -> str:
    """A text that a notebook may keep in lines."""
    return value if isinstance(value, str) else "".join(value)
