"""An explorer in a saved notebook: its picture, and what to do to have it again.

JupyterLab shows a widget's view wherever an output has one, whatever else is beside it, and without the kernel that
made it says "Loading widget..." for ever, or that there is no model. So a saved notebook has the picture instead; the
page that is open keeps its explorer.
"""

from __future__ import annotations

import html
from collections.abc import Mapping
from typing import Any

VIEW = "application/vnd.jupyter.widget-view+json"  #: a live widget's kind of output
EXPLORER = "explorer"  #: in that output's metadata, of an explorer


def with_pictures(model: Mapping[str, Any], **_others: Any) -> None:
    """Put pictures in the place of explorers, in a notebook that is about to be saved: a server's ``pre_save_hook``."""
    if model.get("type") != "notebook" or not model.get("content"):
        return
    for cell in model["content"].get("cells", []):
        for output in cell.get("outputs", []):
            if output.get("metadata", {}).get(VIEW, {}).get(EXPLORER):
                _replace(output)


def _replace(output: dict[str, Any]) -> None:
    data, metadata = output["data"], output["metadata"]
    data.pop(VIEW, None)
    metadata.pop(VIEW)
    picture, about = _text(data.pop("image/png", "")).replace("\n", ""), metadata.pop("image/png", {})
    shown = _text(data.get("text/html", ""))
    if picture:
        alt = html.escape(about.get("alt", ""), quote=True)
        shown = f'<img src="data:image/png;base64,{picture}" alt="{alt}" width="{int(about.get("width", 0)) or ""}">'
    elif not shown:
        shown = f"<p>{html.escape(_text(data.get('text/plain', '')))}</p>"
    words = "Run this cell again to use this explorer: Python has to be there for it. Below is how it began."
    data["text/html"] = f"<p><b>{words}</b></p>\n{shown}"


def _text(value: str | list[str]) -> str:
    """A text that a notebook may keep in lines."""
    return value if isinstance(value, str) else "".join(value)
