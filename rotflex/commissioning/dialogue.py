"""How a commissioning speaks with the person at the bench: a terminal, a notebook, or a test in their place."""

from __future__ import annotations

import time
from collections.abc import Iterator
from typing import Protocol

from rotflex.courseware.messages import _

_POLL = 0.005  # s


class Dialogue(Protocol):
    """The person at the bench."""

    def say(self, text: str) -> None:
        """Tell something."""

    def wait(self, text: str) -> None:
        """Ask for something to be done by hand, and return when it has been."""

    def agree(self, text: str) -> bool:
        """Ask a question, yes or no."""

    def turning(self, text: str) -> Iterator[None]:
        """Ask for a slow turn by hand, and yield again and again while it goes on."""


class Terminal:
    """Whoever sits at a terminal; in a notebook, input appears below the cell."""

    def say(self, text: str) -> None:
        """Print a line."""
        print(text, flush=True)

    def wait(self, text: str) -> None:
        """Print, and wait for Enter."""
        input(_("{text} Then press Enter. ").format(text=text))

    def agree(self, text: str) -> bool:
        """Ask until the answer is yes or no."""
        while True:
            answer = input(_("{text} [y/n] ").format(text=text)).strip().lower()
            if answer[:1] in ("y", "n"):
                return answer[0] == "y"

    def turning(self, text: str, duration: float = 15.0) -> Iterator[None]:
        """Yield for a quarter of a minute, from Enter on."""
        input(_("{text} Press Enter, and turn within {duration:g} s. ").format(text=text, duration=duration))
        end = time.monotonic() + duration
        while time.monotonic() < end:
            yield
            time.sleep(_POLL)
