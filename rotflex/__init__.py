"""Courseware for the rotary flexible joint laboratory.

A notebook starts with ``lab = rotflex.lab.start(student, bench="virtual")``; everything else hangs on that.
Rooms load when they are first used, so that ``import rotflex`` stays quick.
"""

from __future__ import annotations

import importlib
import importlib.util
from typing import Any

__version__ = "0.1.0"

_ROOMS = {
    "config",
    "design",
    "errors",
    "experiments",
    "figures",
    "greybox",
    "hil",
    "identification",
    "lab",
    "model",
    "plant",
    "recording",
    "response",
    "signals",
    "simulation",
    "stiffness",
    "symbolic",
    "units",
    "workbook",
}


def __getattr__(name: str) -> Any:
    # The instructor's rooms are not in a student's copy.
    if name in _ROOMS and importlib.util.find_spec(f"rotflex.{name}") is not None:
        return importlib.import_module(f"rotflex.{name}")
    raise AttributeError(f"module 'rotflex' has no attribute {name!r}")
