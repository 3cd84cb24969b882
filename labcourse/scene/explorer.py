"""What is behind every explorer: shows a scene, receives what the reader does, and never fails in silence.

Nothing here needs Jupyter: an explorer calls :attr:`Explorer.tell` with what is to be seen, and is called by
:meth:`Explorer.hear` with what the page says. In a notebook a widget does so, see :mod:`labcourse.scene.live`.
"""

from __future__ import annotations

import asyncio
import math
import os
import sys
import threading
from collections.abc import Callable, Mapping
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from labcourse import files, job
from labcourse.errors import CourseError, speaks_for_itself
from labcourse.scene.saved_explorers import EXPLORER
from labcourse.scene.scene import Item, Scene

if TYPE_CHECKING:
    from labcourse.pictures import Picture
    from labcourse.scene.live import LiveExplorer

_EMPTY: Item = {"alt": "", "columns": [], "controls": []}


class KernelLoop:
    """Where a page's events are received, one after the other: the loop that runs now."""

    threads = sys.platform != "emscripten"  #: whether there are any; in a browser there are none

    _loop: asyncio.AbstractEventLoop | None = None

    def __init__(self) -> None:
        with suppress(RuntimeError):
            self._loop = asyncio.get_running_loop()

    @property
    def loop(self) -> asyncio.AbstractEventLoop | None:
        """The loop of the kernel while it runs; None outside of a kernel."""
        return self._loop if self._loop is not None and self._loop.is_running() else None

    def later(self, call: Callable[..., None], *values: Any) -> None:
        """Call a function in the thread that receives events, from any thread: only that one may change a page."""
        if self.loop is not None:
            self.loop.call_soon_threadsafe(call, *values)
        else:
            call(*values)


class Explorer:
    """A scene that answers.

    A subclass says what is to be seen (:meth:`view`), and what to do when a control is set, a button pressed or a
    handle moved. An exception on the way is shown above the plots; what was there stays.

    Attributes
    ----------
    scene, data : what the page shows now, see :meth:`labcourse.scene.scene.Scene.packed`
    tell : set by a page: called with every new scene and its data
    busy : whether something is done in the background
    """

    scene: Item = _EMPTY
    data = b""
    tell: Callable[[Item, bytes], None] | None = None
    busy = False
    _live: LiveExplorer | None = None

    def __init__(self) -> None:
        self.kernel = KernelLoop()
        self._version = 0
        self._answered: dict[str, Any] = {}
        self.notice = ""
        self.refresh()

    # --- what a subclass says ---------------------------------------------------------------------------------------

    def view(self) -> Scene:
        """What is to be seen now."""
        raise NotImplementedError

    def picture(self) -> Picture:
        """The same as a static figure: drawn from the scene, unless a subclass draws another."""
        from labcourse.scene import still

        return still.picture(self.view())

    def set(self, name: str, value: float | str) -> None:
        """A control was set; a slider, within its range."""

    def press(self, name: str) -> None:
        """A button was pressed."""

    def move(self, name: str, x: float, y: float) -> None:
        """A handle was moved."""

    def grab(self, name: str, place: tuple[float, float] | None, begins: bool) -> None:
        """A point of a drawing is held and pulled to a place, in the drawing's units; None when it is let go.

        While it is held and does not move, a page shows by other events that it is there, as long as something runs.
        """

    # --- what comes and goes ----------------------------------------------------------------------------------------

    def hear(self, event: Mapping[str, Any]) -> None:
        """Take a message of the page, on the kernel's own loop: JupyterLab may send it to a thread beside it."""
        self.kernel.later(self.receive, event)

    def receive(self, event: Mapping[str, Any]) -> None:
        """Take an event of the page: ``{"kind": "set" | "press" | "moved" | "grab" | "alive", "name": ..., ...}``."""
        kind, name = event.get("kind"), str(event.get("name", ""))
        if kind == "alive":  # a page shows that it is there, while something runs
            return
        self.notice, trouble = "", ""
        try:
            if kind == "set":
                value = event["value"]
                self.set(name, value if isinstance(value, str) else self._within_slider(name, _finite(value)))
            elif kind == "press":
                self.press(name)
            elif kind == "moved":
                self.move(name, _finite(event["x"]), _finite(event["y"]))
            elif kind == "grab":
                place = (_finite(event["x"]), _finite(event["y"])) if "x" in event else None
                self.grab(name, place, bool(event.get("begins")))
                return  # there are many, and what moves is shown all the time
        except Exception as error:
            trouble = error_text(error)
        self._answered = {"view": event.get("view"), "n": event.get("n")}
        self.refresh(trouble)

    def refresh(self, trouble: str = "") -> None:
        """Show what is to be seen now, and what went wrong; if that was the showing itself, what was there before."""
        scene, data = dict(self.scene), self.data
        try:
            scene, data = self.view().packed()
        except Exception as error:
            trouble = trouble or error_text(error)
        self._version += 1
        notice = {"kind": "error", "text": trouble} if trouble else {"kind": "info", "text": self.notice}
        self.scene = scene | {"notice": notice, "version": self._version, "answered": self._answered}
        self.data = data
        if self.tell is not None:
            self.tell(self.scene, data)

    def _within_slider(self, name: str, value: float) -> float:
        """A number within its slider's range, to which the box beside a slider does not keep."""
        for control in (control for row in self.scene["controls"] for control in row):
            if control["kind"] == "slider" and control["name"] == name:
                value = min(max(value, control["low"]), control["high"])
        return value

    def in_background(self, work: Callable[[], Any], done: Callable[[Any], None]) -> None:
        """Do something long beside the kernel, which stays free for other messages meanwhile; it is ``busy``.

        ``done`` is called with the result, where events are received; then the scene is shown anew, with what went
        wrong. Outside of a kernel, and where there are no threads, it is done at once.
        """
        self.busy = True

        def finish(result: Any) -> None:
            self.busy = False
            if isinstance(result, Exception):
                raise result
            done(result)

        def finish_and_show(result: Any) -> None:
            trouble = ""
            try:
                finish(result)
            except Exception as error:
                trouble = error_text(error)
            self.refresh(trouble)

        if self.kernel.loop is None or not self.kernel.threads:
            finish(_result(work))
        else:
            threading.Thread(target=lambda: self.kernel.later(finish_and_show, _result(work)), daemon=True).start()

    def save_picture(self, name: str) -> None:
        """Save the picture as PNG and as SVG beside the notebook, and say so; earlier ones of that name are replaced.

        Raises
        ------
        CourseError
            If they cannot be written.
        """
        from labcourse.pictures import DOTS_PER_INCH, style

        picture = self.picture()

        def draw(path: Path, kind: str) -> None:
            with style():
                picture.savefig(path, format=kind, dpi=2 * DOTS_PER_INCH, facecolor="white")

        for kind in ("png", "svg"):
            written(Path.cwd() / f"{name}.{kind}", partial(draw, kind=kind))
        self.notice = f"Saved for your report: {name}.png and {name}.svg."

    def static_view(self) -> tuple[dict[str, str], dict[str, Any]]:
        """Display data and metadata for where there are no widgets."""
        return self.picture()._repr_mimebundle_()

    def close(self) -> None:
        """Take the explorer off a notebook's page."""
        if self._live is not None:
            self._live.close()

    def _repr_mimebundle_(self, **options: Any) -> Any:
        """The widget, if somebody looks, and what stands for it in papermill's notebooks and on a printed page."""
        try:
            picture, about = self.static_view()
        except Exception as error:
            if not speaks_for_itself(error):
                raise
            picture, about = {}, {}  # there is nothing to draw yet; the widget says why
        instead = {**picture, "text/plain": repr(self)}
        if os.environ.get(job.PICTURES) == "off":
            return instead, about
        from labcourse.scene.live import LiveExplorer  # it takes a moment

        if self._live is None:
            self._live = LiveExplorer(self.hear, scene=self.scene, data=self.data)
            self.tell = self._live.show
        return self._live.bundled(EXPLORER, instead, about, **options)

    def __repr__(self) -> str:
        return f"{type(self).__name__}: {self.scene['alt']}"


def written(path: Path, content: files.Content) -> Path:
    """Write a file whole or not at all, see :func:`labcourse.files.write`.

    Raises
    ------
    CourseError
        If it cannot be written.
    """
    try:
        files.write(path, content)
    except OSError as error:
        raise CourseError(f"{path.name} cannot be written: {error.strerror or error}.") from None
    return path


def _result(work: Callable[[], Any]) -> Any:
    """What comes of some work, be it an exception."""
    try:
        return work()
    except Exception as error:
        return error


def error_text(error: Exception) -> str:
    """An exception for a student: ours as they are, others with their kind."""
    if speaks_for_itself(error):
        return str(error)
    return f"This did not work ({type(error).__name__}: {error}). What you see is as it was before."


def _finite(value: Any) -> float:
    number = float(value)
    if not math.isfinite(number):
        raise CourseError(f"{value!r} is not a number that can be used here.")
    return number
