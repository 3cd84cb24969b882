"""Where theta is zero on a real bench: at the mark of its commissioning, however often the arm was turned since.

Cables twist, so the limit of theta is about one place. A counter goes on counting while its board is powered. A small
file has what it read last and what it reads at the mark; where it reads something else now, nobody knows where the arm
stands. The file is away while the bench is open: a program that was killed leaves none.
"""

from __future__ import annotations

import json
import uuid
from pathlib import Path

from rotflex import files

_A_FEW = 5  # counts, half a degree
_THIS_PROGRAM = uuid.uuid4().hex


class Mark:
    """The mark of one bench.

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
            kept = json.loads(self._path.read_text(encoding="utf-8"))
            last, zero, set_by = int(kept["counts"]), int(kept["zero"]), str(kept["set_by"])
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

    def keep(self, counts: int) -> None:
        """Save the zero of a bench that is closed; ``counts`` is what the servo's counter reads at rest.

        Raises
        ------
        OSError
            If it cannot be written.
        """
        if self.zero is not None:
            self._path.parent.mkdir(parents=True, exist_ok=True)
            files.write(self._path, json.dumps({"counts": counts, "zero": self.zero, "set_by": self._set_by}) + "\n")
