"""The record of a commissioning: of which board and wiring, when, and what was measured.

It repeats all that it is of, so that it says itself what has changed since: another sign, another cable, another board.
"""

from __future__ import annotations

import datetime
from collections.abc import Mapping
from typing import Any

from rotflex.hil.real import not_commissioned

VERSION = 1
_STIFFEST = 10.0  # N·m/rad; seven times as stiff as the workbook's


def record(of: Mapping[str, Any], measured: Mapping[str, Any], provisional: bool = False) -> dict[str, Any]:
    """A record of today.

    Parameters
    ----------
    of : the board, its parts and its wiring, plain values
    measured : what was found, plain values
    provisional : for the commissioning's own first closed loop; it is not written down
    """
    today = datetime.datetime.now(datetime.UTC).date().isoformat()
    return {
        "version": VERSION,
        "date": today,
        "provisional": provisional,
        "of": dict(of),
        "measured": dict(measured),
    }


def why_not(kept: Mapping[str, Any], of: Mapping[str, Any]) -> str:
    """Why no loop is closed on a bench that has this record; empty text if one may be.

    Parameters
    ----------
    kept : the record; empty if there is none
    of : the bench as it is wired now
    """
    if not kept:
        return not_commissioned()
    before = kept.get("of")
    if kept.get("version") != VERSION or not isinstance(before, Mapping) or stiffness(kept) is None:
        return f"The record of this bench's commissioning cannot be read: {_again()}"
    changed = [
        f"{name} was {before.get(name)!r} and is {of.get(name)!r}"
        for name in {**of, **before}
        if before.get(name) != of.get(name) or type(before.get(name)) is not type(of.get(name))
    ]
    if not changed:
        return ""
    return (
        f"This bench was commissioned on {kept.get('date')}, and has changed since ({'; '.join(changed)}). {_again()}"
    )


def stiffness(kept: Mapping[str, Any]) -> float | None:
    """Of the joint, N·m/rad, as a record has it; None if it has none."""
    measured = kept.get("measured")
    found = measured.get("stiffness") if isinstance(measured, Mapping) else None
    return found if isinstance(found, float) and 0 < found < _STIFFEST else None


def _again() -> str:
    return "No loop is closed on it until it is commissioned again: rotflex bench setup."
