"""The rotary flexible joint laboratory: a bench, real or virtual, experiments, identification and design.

::

    from rotflex import experiments, hil

    with hil.open("virtual:?seed=7") as bench:
        recording = experiments.sweep(bench)

Modules load when they are first used, so that ``import rotflex`` stays quick.
"""

from __future__ import annotations

import importlib
import importlib.util
from typing import Any

__version__ = "0.2.0"

_PUBLIC = (
    *("config", "controller", "design", "errors", "experiments", "figures", "greybox", "hil", "identification"),
    *("model", "observers", "plant", "recording", "response", "sampled", "signals", "simulation", "specifications"),
    *("symbolic", "units", "widgets"),
)


def __getattr__(name: str) -> Any:
    if not name.startswith("_") and importlib.util.find_spec(f"{__name__}.{name}") is not None:
        return importlib.import_module(f"{__name__}.{name}")
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return [*_PUBLIC, "__version__"]
