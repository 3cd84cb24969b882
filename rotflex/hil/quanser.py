"""A board over the maker's own Python package, ``quanser.hardware``: the same verbs, passed on as they are.

The package is in no registry: it comes as a wheel inside the maker's SDK, and is a layer over the SDK's libraries. It
is imported only when such a board is opened.
"""

from __future__ import annotations

import contextlib
import functools
import importlib
import os
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

from rotflex.errors import BenchError, HILError
from rotflex.hil import real
from rotflex.hil.bench import Bench
from rotflex.hil.board import VERBS, Board
from rotflex.hil.real import BOARDS, BoardKind, Setup

#: What the maker's layer raises for arguments that it cannot pass on.
_UNFIT = (TypeError, ValueError, OverflowError, BufferError)
_WHERE = (
    "It is in no package registry: it comes with the Quanser SDK, from the board's maker. Install the SDK, then, with "
    f"pip install, the wheel files in its folder {'%QSDK_DIR%python' if os.name == 'nt' else '$QSDK_DIR/python'}. "
    "A bench without a Quanser board needs none of it."
)


class QuanserBoard(Board):
    """A board with the verbs of the maker's ``HIL``, which checks what they are given; its errors are ours.

    Parameters
    ----------
    card : an open ``quanser.hardware.HIL``
    hardware : the maker's package
    """

    def __init__(self, card: Any, hardware: Any) -> None:
        self._card, self._hardware = card, hardware
        passed_on = {verb: _translated(verb, getattr(card, verb), hardware.HILError) for verb in VERBS}
        self._close, self._clear = passed_on.pop("close"), passed_on.pop("watchdog_clear")
        vars(self).update(passed_on)

    def watchdog_clear(self) -> None:
        """Let the board be used again after its watchdog expired.

        A board may fail here where there was nothing to clear, or where it could not restore all that was before. The
        code that the maker's own QUARC writes ignores that; what counts is whether the board is still locked.
        """
        try:
            self._clear()
        except HILError:
            if self.watchdog_is_expired():
                raise

    def serial_number(self) -> str:
        """Return the board's serial number; empty where it has none."""
        with contextlib.suppress(Exception):  # whatever fails: no run depends on it
            return str(self._card.get_string_property(self._hardware.StringProperty.SERIAL_NUMBER, 64)).strip("\0 ")
        return ""

    def close(self) -> None:
        """Close the board; a second call does nothing."""
        if self._card.is_valid():
            self._close()


def bench(uri: str, setup: Setup | None) -> Bench:
    """Return the bench on one of the maker's boards, at ``quanser:BOARD/ID``.

    Raises
    ------
    BenchError
        If the address is none.
    """
    board, slash, identifier = uri.partition(":")[2].partition("/")
    if not (board.replace("_", "").isalnum() and slash and identifier):
        raise BenchError(
            f"The address {uri!r} names no board: it is quanser:BOARD/ID, as in 'quanser:q2_usb/0', or for the "
            "maker's simulator \"quanser:qpid_e/0@tcpip://localhost:18000?nagle='off'\"."
        )
    chosen = setup or Setup()
    if board in BOARDS:
        chosen = replace(chosen, wiring=replace(chosen.wiring, digital_outputs=BOARDS[board].digital_outputs))
    simulated = chosen.simulated or "@" in identifier
    return real.make_bench(uri, partial(connect, board, identifier), replace(chosen, simulated=simulated))


def kind(address: str) -> BoardKind | None:
    """Return what the board at an address has; None if it is not among those that the workbook names."""
    return BOARDS.get(address.partition(":")[2].partition("/")[0])


def software() -> str:
    """Make sure that the maker's package is there."""
    package()
    return "the maker's package"


def connect(board: str, identifier: str) -> Board:
    """Open a board.

    Parameters
    ----------
    board : its type, as the maker names it, such as ``q2_usb``
    identifier : which of them, such as ``0``; or where the maker's simulator has it

    Raises
    ------
    BenchError
        If the maker's package is not there, or not whole; the message says what to install.
    HILError
        If there is no such board, in the maker's words.
    """
    hardware = package()
    opened = _translated("open", hardware.HIL, hardware.HILError)
    return QuanserBoard(opened(board, identifier), hardware)


def package() -> Any:
    """Import the maker's package."""
    try:
        return importlib.import_module("quanser.hardware")
    except ImportError as error:
        why = f"The maker's Python package, quanser.hardware, is not installed here ({error})."
    except OSError as error:
        why = f"The maker's Python package is installed, but the Quanser SDK's libraries cannot be loaded ({error})."
    raise BenchError(f"{why} {_WHERE}") from None


def _translated(verb: str, call: Callable[..., Any], failure: type[Exception]) -> Callable[..., Any]:
    """Wrap a verb so that its errors are ours, with the maker's text: by itself an error of theirs is a bare number."""

    @functools.wraps(call)
    def translated(*arguments: Any) -> Any:
        try:
            return call(*arguments)
        except failure as error:
            text = ""
            with contextlib.suppress(Exception):  # one that has no text raises then; its number is in the message
                text = str(error.get_error_message()).strip().rstrip(".")  # type: ignore[attr-defined]
            raise HILError(f"The board failed at {verb}{': ' if text else ''}{text} (error {error}).") from error
        except _UNFIT as error:
            raise HILError(f"The board cannot take these arguments at {verb}: {error}") from error

    return translated
