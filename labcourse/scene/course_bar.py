"""The course bar at the top of a notebook: where the student is, what is answered, and the commands as buttons.

The page draws the same HTML that a saved notebook has; the buttons and what the commands print are around it.
"""

from __future__ import annotations

import asyncio
import base64
import html
import threading
from collections.abc import AsyncIterator, Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple, cast

import traitlets

from labcourse.safe_text import no_escapes
from labcourse.scene.explorer import KernelLoop
from labcourse.scene.live import Live
from labcourse.scene.saved_explorers import BAR

ANSWERED, IN_PART, WAITS, EMPTY = "answered", "in part", "waiting", "empty"
_SIGNS = {ANSWERED: "✓", IN_PART: "◐", WAITS: "…", EMPTY: "○"}
_PROGRESS = "Running "  # the beginning of a line that the next one of its kind replaces
_HERE = Path(__file__).parent
_CHIP = "display:inline-block;margin:1px 4px 1px 0;padding:0 6px;border:1px solid;border-radius:9px;white-space:nowrap"
_NEXT = (
    "display:inline-block;max-width:11em;overflow:hidden;text-overflow:ellipsis;white-space:nowrap;vertical-align:top"
)
_LINE = "margin:0;line-height:1.6"

_OLD_FILE = "This notebook is not saved. What is checked is the file as it was saved last."
#: What to do before a command that needs the saved file, by what the page knows: not saved; not known.
NOT_SAVED: dict[bool | None, str] = {
    False: "This notebook is not saved; only the saved file counts. Save it (Ctrl+S, on a Mac ⌘+S). Then press again.",
    None: "This page cannot see whether the notebook is saved. Save it, and run lab.{command} in a cell of your own.",
}


_QUIET = {"title": "Your work", "text": "", "busy": False}
UNPACKED = "{count} files are here now. Reload the page: notebooks that are open show the old ones."


class Kept(NamedTuple):
    """What is done with work that is kept in a browser alone."""

    is_loose: Callable[[], bool]  #: whether something was not downloaded
    packed: Callable[[], Path]  #: packs all into a zip
    unpack: Callable[[bytes], int]  #: puts a zip's files there, and counts them


@dataclass(frozen=True)
class Chip:
    """A question as the bar shows it: number, state, address of its cell, and more words on the state."""

    number: str
    state: str
    href: str
    words: str = ""


def page(
    line: str,
    before: tuple[str, str] | None,
    after: tuple[str, str] | None,
    chips: Sequence[Chip],
    about: Sequence[str],
) -> str:
    """Return the bar's HTML.

    Parameters
    ----------
    line : where the student is
    before, after : address and title of the notebooks beside this one
    chips : of the notebook's questions
    about : student, bench and notes, a line each
    """
    links = (
        _link(*before, "← ") if before else "",
        f"<b>{html.escape(line)}</b>" if line else "",
        _link(*after, "", " →") if after else "",
    )
    legend = " ".join(f"{sign} {state}" for state, sign in _SIGNS.items()) if chips else ""
    rows = [" &nbsp; ".join(filter(None, links)), "".join(map(_chip, chips))]
    rows += [f"<small>{html.escape(text)}</small>" for text in about]
    rows[-1] += f" &nbsp; <small>{legend}</small>"
    return "".join(f'<p style="{_LINE}">{row}</p>' for row in rows if row)


def _link(href: str, title: str, left: str = "", right: str = "") -> str:
    """Return a link with an arrow to its left or right, which stays beside a title that is cut."""
    text = html.escape(title)
    shown = f'{left}<span style="{_NEXT}">{text}</span>{right}'
    return f'<a href="{html.escape(href)}" title="{left}{text}{right}" style="white-space:nowrap">{shown}</a>'


def _chip(chip: Chip) -> str:
    words = html.escape(f"{chip.number}: {chip.state}{f' ({chip.words})' if chip.words else ''}", quote=True)
    text = f"{html.escape(chip.number)} {_SIGNS[chip.state]}"
    return f'<a href="{html.escape(chip.href)}" title="{words}" aria-label="{words}" style="{_CHIP}">{text}</a>'


class CourseBar(Live):
    """The bar of a live notebook.

    Parameters
    ----------
    draw : returns the HTML as it is now
    text : the same in short, for where there are no widgets
    commands : command → its label
    start : (command) → lines that the program prints; in a browser they come when they can
    is_saved : (id, type and source of each cell) → whether the notebook's file has the same
    kept : of work that is kept in a browser alone; None on a computer
    """

    _esm = _HERE / "course_bar.js"
    _css = _HERE / "course_bar.css"
    html = traitlets.Unicode().tag(sync=True)
    looks = traitlets.Int(0).tag(sync=True)  #: how often the page's question was answered
    commands = traitlets.Dict().tag(sync=True)
    output = traitlets.Dict().tag(sync=True)  #: {"title", "text", "notice", "busy"} of the command that ran last
    kept = traitlets.Unicode("").tag(sync=True)  #: in a browser "safe", or "loose" if something was not downloaded

    def __init__(
        self,
        draw: Callable[[], str],
        text: str,
        commands: Mapping[str, str],
        start: Callable[[str], Iterator[str] | AsyncIterator[str]],
        is_saved: Callable[[list[list[str]]], bool],
        kept: Kept | None = None,
    ) -> None:
        self._draw, self._text, self._start, self._is_saved, self._kept = draw, text, start, is_saved, kept
        self._notice = ""  # on the command that runs
        self._kernel = KernelLoop()
        super().__init__(partial(self._kernel.later, self.receive), commands=dict(commands), html=draw())

    def refresh(self) -> None:
        """Draw what is answered now."""
        self.html = self._draw()
        if self._kept is not None:
            self.kept = "loose" if self._kept.is_loose() else "safe"

    def hand_over(self, path: Path) -> None:
        """Give a file to the browser's downloads."""
        self.send({"name": path.name}, buffers=[path.read_bytes()])

    def receive(self, event: Mapping[str, Any]) -> None:
        """Take an event of the page: it looks again, or a button was pressed."""
        try:
            if event.get("kind") == "press":
                saved = event.get("saved")
                self.press(str(event.get("name")), self._is_saved(saved) if isinstance(saved, list) else saved)
            elif self._kept is not None and event.get("kind") == "download":
                self.hand_over(self._kept.packed())
            elif self._kept is not None and event.get("kind") == "unpack":
                count = self._kept.unpack(base64.b64decode(event["zip"]))
                self.output = {**_QUIET, "notice": UNPACKED.format(count=count)}
            self.refresh()
        except Exception as error:
            self.output = {**_QUIET, **self.output, "notice": no_escapes(str(error))}
        self.looks += 1

    def press(self, command: str, saved: bool | None) -> None:
        """Run a command as a program of its own, unless one runs, or it needs a notebook that is saved."""
        if self.output.get("busy"):
            self.output = {**self.output, "notice": f"{self.output['title']} still runs. Wait until it has ended."}
            return
        runs = bool(saved) or command == "check"
        self._notice = "" if saved else NOT_SAVED[saved].format(command=f"{self.commands[command].lower()}(…)")
        if runs and saved is False:
            self._notice = _OLD_FILE
        self.output = {"title": self.commands[command], "text": "", "notice": self._notice, "busy": runs}
        if runs and KernelLoop.threads:
            threading.Thread(target=self._run, args=(command,), daemon=True).start()
        elif runs:
            self._task = asyncio.ensure_future(self._follow(command))

    def _run(self, command: str) -> None:
        try:
            for line in cast(Iterator[str], self._start(command)):
                self._kernel.later(self._add, line)
        except Exception as error:
            self._kernel.later(self._add, f"{type(error).__name__}: {error}\n")
        self._kernel.later(self._end)

    async def _follow(self, command: str) -> None:
        try:
            async for line in cast(AsyncIterator[str], self._start(command)):
                self._add(line)
        except Exception as error:
            self._add(f"{type(error).__name__}: {error}\n")
        self._end()

    def _add(self, line: str) -> None:
        text = self.output["text"]
        if line.startswith(_PROGRESS) and text.startswith(_PROGRESS) and text.count("\n") == 1:
            text = ""
        self.output = {**self.output, "text": text + no_escapes(line)}

    def _end(self) -> None:
        self.output = {**self.output, "busy": False, "notice": self._notice}
        self.refresh()

    def _repr_mimebundle_(self, **options: Any) -> Any:
        """The widget, and what stands for it in a saved notebook and in a terminal."""
        return self.bundled(BAR, {"text/html": self.html, "text/plain": self._text}, {}, **options)
