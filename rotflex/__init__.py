"""Courseware for the rotary flexible joint laboratory.

A notebook starts with ``lab = rotflex.course.lab.start(student, bench="virtual")``; everything else hangs on that.
Modules load when they are first used, so that ``import rotflex`` stays quick.
"""

from __future__ import annotations

import importlib
import importlib.util
from typing import Any

__version__ = "0.2.0"


def __getattr__(name: str) -> Any:
    if not name.startswith("_") and importlib.util.find_spec(f"{__name__}.{name}") is not None:
        return importlib.import_module(f"{__name__}.{name}")
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
