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


def record(
    of: Mapping[str, Any], measured: Mapping[str, Any], provisional: bool = False, watchdog: object = None
) -> dict[str, Any]:
    """A record of today.

    Parameters
    ----------
    of : the board, its parts and its wiring, plain values
    measured : what was found, plain values
    provisional : for the commissioning's own first closed loop; it is not written down
    watchdog : the result of its test with the motor
    """
    made = {"version": VERSION, "date": today(), "provisional": provisional, "of": dict(of), "measured": dict(measured)}
    return made | ({} if watchdog is None else {"watchdog": watchdog})


def today() -> str:
    """The date, for a record."""
    return datetime.datetime.now(datetime.UTC).date().isoformat()


def why_not(kept: Mapping[str, Any], of: Mapping[str, Any], serial: str = "") -> str:
    """Why no loop is closed on a bench that has this record; empty text if one may be.

    Parameters
    ----------
    kept : the record; empty if there is none
    of : the bench as it is wired now
    serial : number of the board that is open; empty where it does not tell it
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
    known = kept["measured"].get("serial_number", "")
    if known and serial and known != serial:
        changed.append(f"the board's serial number was {known!r} and is {serial!r}")
    if not changed:
        return _untested(kept, of)
    return (
        f"This bench was commissioned on {kept.get('date')}, and has changed since ({'; '.join(changed)}). {_again()}"
    )


def _untested(kept: Mapping[str, Any], of: Mapping[str, Any]) -> str:
    """Why no loop is closed while the watchdog has not stopped the motor; a simulator harms nobody."""
    if "@" in str(of.get("address")):
        return ""
    watchdog = kept.get("watchdog")
    if not isinstance(watchdog, Mapping):
        why = f"This bench was commissioned on {kept.get('date')}, but its watchdog was not tested with the motor."
    elif watchdog.get("passed") is not True:
        why = f"The watchdog failed its test with the motor on {watchdog.get('date')}: {watchdog.get('found')}"
    else:
        return ""
    return (
        f"{why} Until it passes, no loop is closed on this bench, and the motor gets at most 1 V. The test takes a "
        "minute: rotflex bench setup --watchdog bench.toml."
    )


def stiffness(kept: Mapping[str, Any]) -> float | None:
    """Of the joint, N·m/rad, as a record has it; None if it has none."""
    measured = kept.get("measured")
    found = measured.get("stiffness") if isinstance(measured, Mapping) else None
    return found if isinstance(found, float) and 0 < found < _STIFFEST else None


def _again() -> str:
    return "No loop is closed on it until it is commissioned again: rotflex bench setup."
