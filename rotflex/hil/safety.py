"""What keeps a bench from harm: its limits, the guard, the mark, its commissioning, and the end at 0 V."""

from __future__ import annotations

import json
import uuid
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from rotflex import files
from rotflex.errors import BenchError, MotorNotStopped
from rotflex.hil.connection import Connection, Outcome
from rotflex.hil.guard import Guard, Limits, Supervision
from rotflex.hil.halt import PATIENCE, halt, note, uninterrupted
from rotflex.units import DEG

_NO_MARK = (
    "It is not known how far the arm is from its mark: the servo's counter does not read what it read when this bench "
    "was closed last, as after power-off, or after somebody turned the arm. With the amplifier off, turn the arm back "
    "to its mark, where theta was set to zero in the commissioning, and look that no cable is twisted."
)
_A_FEW = 5  # counts, half a degree
_THIS_PROGRAM = uuid.uuid4().hex


class Mark:
    """Where theta is zero on a real bench: at the mark of its commissioning, however often the arm was turned since.

    Cables twist, so the limit of theta is about one place. A counter goes on counting while its board is powered. A
    small file has what it read last and what it reads at the mark; where it reads something else now, nobody knows
    where the arm stands. The file is away while the bench is open: a program that was killed leaves none.

    Parameters
    ----------
    path : of its file
    needed : whether the arm must be put at the mark where it is not known; else zero is where it stands then

    Attributes
    ----------
    zero : what the servo's counter reads at the mark; None if it is not known
    """

    def __init__(self, path: Path, needed: bool) -> None:
        self._path, self._needed = path, needed
        self.zero: int | None = None
        self._set_by = ""  # the program in which the arm merely stood there; none for a mark that a person set

    def find(self, counts: int) -> None:
        """Find the zero of a bench that was just opened; ``counts`` is what the servo's counter reads."""
        self.zero = None
        try:
            saved = json.loads(self._path.read_text(encoding="utf-8"))
            last, zero, set_by = int(saved["counts"]), int(saved["zero"]), str(saved["set_by"])
            files.patiently(self._path.unlink)
        except (OSError, ValueError, TypeError, LookupError):
            last, zero, set_by = counts, counts, "nobody"
        if abs(counts - last) <= _A_FEW and set_by in ("", "" if self._needed else _THIS_PROGRAM):
            self.zero, self._set_by = zero, set_by
        elif not self._needed:
            self.zero, self._set_by = counts, _THIS_PROGRAM

    def set(self, counts: int) -> None:
        """Take where the arm stands now."""
        self.zero, self._set_by = counts, ""

    def save(self, counts: int) -> None:
        """Save the zero of a bench that is closed; ``counts`` is what the servo's counter reads at rest.

        Raises
        ------
        OSError
            If it cannot be written.
        """
        self._path.parent.mkdir(parents=True, exist_ok=True)
        files.write(self._path, json.dumps({"counts": counts, "zero": self.zero, "set_by": self._set_by}) + "\n")


@dataclass
class Safety:
    """What a bench has that can come to harm, and what became of its motor.

    Parameters
    ----------
    limits : of angles, rate, voltage and time
    guard : watches every run for motion that cannot be
    commissioned : asked before each closed loop; returns why there is none yet on this bench, None if there may be
    mark : from which the servo's angle is limited; without one it is from where each run begins

    Attributes
    ----------
    outcome : what is known of the motor since the bench was stopped last; None before
    supervision : of the last run; None before
    """

    limits: Limits = field(default_factory=Limits)
    guard: Guard | None = None
    commissioned: Callable[[], str | None] | None = None
    mark: Mark | None = None
    outcome: Outcome | None = field(default=None, init=False)
    supervision: Supervision | None = field(default=None, init=False)

    def halt(self, connection: Connection) -> None:
        """Set 0 V, and take no more samples.

        Raises
        ------
        MotorNotStopped
            If the board does not take 0 V: it is asked for two seconds, and only once where that was in vain before.
        """
        was_in_vain = self.outcome is not None and not self.outcome.at_zero
        try:
            with uninterrupted():
                try:
                    halt(connection, None if was_in_vain else PATIENCE)
                finally:
                    self.outcome = connection.outcome()
        except BaseException as error:
            if self.outcome is not None and not isinstance(error, MotorNotStopped):  # which says it itself
                note(error, self.outcome)
            raise

    def start(self, sample_time: float, begun: float) -> None:
        """Begin to supervise a run, which begins at an angle of the servo, rad from the mark."""
        self.outcome = None
        self.supervision = Supervision(self.limits, self.guard, sample_time, begun)

    def require_commissioned(self) -> None:
        """Raise :class:`BenchError` unless this bench was commissioned as it is wired now."""
        if self.commissioned is not None and (why := self.commissioned()):
            raise BenchError(why)

    @property
    def mark_unknown(self) -> str | None:
        """Why the arm must be put at its mark before the motor drives; None if it need not be."""
        return _NO_MARK if self.mark is not None and self.mark.zero is None else None

    def require_place(self, theta: float) -> None:
        """Raise :class:`BenchError` unless it is known that ``theta`` (rad from the mark) is within the limits."""
        if self.mark_unknown:
            then = "Then call set_zero() of the open bench; or in a terminal: rotflex bench zero bench.toml."
            raise BenchError(f"{self.mark_unknown} {then}")
        if abs(theta) > self.limits.theta:
            most = self.limits.theta / DEG
            raise BenchError(
                f"The arm stands at {theta / DEG:.0f} deg from its mark, and the limit is ±{most:.0f} deg. With the "
                "amplifier off, turn it back to its mark, and look that no cable is twisted."
            )
