"""What a board need not have: it is asked for, and a refusal is kept in words and ends nothing."""

from __future__ import annotations

from typing import Any

from rotflex.errors import HILError
from rotflex.hil.board import Board

_TESTED = "rotflex bench setup tests with the motor whether the watchdog sets 0 V all the same."
#: What the user does about a board that refuses a verb.
TO_DO = {
    "watchdog_set_analog_expiration_state": _TESTED,
    "watchdog_set_digital_expiration_state": _TESTED,
    "task_set_buffer_overflow_mode": "Runs go on, but a program that pauses for a second ends its run with an error.",
    "set_encoder_quadrature_mode": "rotflex bench setup counts a full turn, and so finds whether all edges count.",
    "set_encoder_filter_frequency": "The board keeps its own filter: set filter = 0 in bench.toml.",
}


def ask(board: Board, verb: str, *arguments: Any) -> dict[str, str]:
    """Ask a board for what it need not have; a refusal by its verb, in words and with what to do."""
    try:
        getattr(board, verb)(*arguments)
    except HILError as error:
        return {verb: f"{error} {TO_DO[verb]}"}
    return {}
