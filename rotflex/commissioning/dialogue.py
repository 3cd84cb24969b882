"""How a commissioning speaks with the person at the bench: a terminal, a notebook, or a test in their place."""

from __future__ import annotations

import time
from collections.abc import Iterator
from typing import Protocol

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
    """Whoever sits at a terminal; in a notebook, a field for the answer appears below the cell.

    What is to be done is printed, so that it stays to be read; what is asked for is short, for that field has little
    room beside it.

    Parameters
    ----------
    turn : s, for a full turn by hand
    """

    def __init__(self, turn: float = 15.0) -> None:
        self._turn = turn

    def say(self, text: str) -> None:
        """Print a line."""
        print(text, flush=True)

    def wait(self, text: str) -> None:
        """Print, and wait for Enter."""
        self.say(text)
        input("Then press Enter. ")

    def agree(self, text: str) -> bool:
        """Ask until the answer is yes or no."""
        self.say(text)
        while True:
            answer = input("yes or no? ").strip().lower()
            if answer[:1] in ("y", "n"):
                return answer[0] == "y"

    def turning(self, text: str) -> Iterator[None]:
        """Yield from Enter on, for as long as a turn may take."""
        self.say(f"{text} You have {self._turn:g} s for it.")
        input("Press Enter, and turn. ")
        end = time.monotonic() + self._turn
        while time.monotonic() < end:
            yield
            time.sleep(_POLL)
