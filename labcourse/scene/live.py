"""Explorers and the course bar as widgets, in a notebook that somebody looks at."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import anywidget
import traitlets

from labcourse.scene.saved_explorers import VIEW

_HERE = Path(__file__).parent
# One module, in files that can be read.
_SCRIPTS = ("drawing.js", "moving.js", "controls.js", "handles.js", "grabs.js", "player.js", "explorer.js")


class Live(anywidget.AnyWidget):
    """A widget that hands on what its page says.

    Parameters
    ----------
    hear : called with each message, in whichever thread it comes
    state : traits, as they are to begin with
    """

    def __init__(self, hear: Callable[[Mapping[str, Any]], None], **state: Any) -> None:
        super().__init__(**state)
        self.on_msg(lambda _widget, content, _buffers: hear(content))

    def bundled(
        self, kind: str, instead: Mapping[str, str], about: Mapping[str, Any], **options: Any
    ) -> tuple[dict[str, Any], dict[str, Any]]:
        """Return display data and metadata: the widget, and what stands for it elsewhere.

        Parameters
        ----------
        kind : of widget, which the metadata name
        instead, about : display data of what stands for it, and their metadata
        options : as a notebook gives them
        """
        live = super()._repr_mimebundle_(**options)
        data, metadata = live if isinstance(live, tuple) else (live, {})
        mark = {VIEW: {kind: True}} if VIEW in (data or {}) else {}
        return {**(data or {}), **instead}, {**metadata, **about, **mark}


class LiveExplorer(Live):
    """An explorer's widget, with what :class:`labcourse.scene.explorer.Explorer` shows."""

    _esm = "\n".join((_HERE / name).read_text(encoding="utf-8") for name in _SCRIPTS)
    _css = _HERE / "explorer.css"
    scene = traitlets.Dict().tag(sync=True)
    data = traitlets.Bytes().tag(sync=True)

    def show(self, scene: dict[str, Any], data: bytes) -> None:
        """Show another scene, and its data, at once."""
        with self.hold_sync():
            self.data = data
            self.scene = scene
