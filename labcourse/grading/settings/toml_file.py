"""A file of the course's folder that a person writes as TOML: read, or refused with all that is wrong with it."""

from __future__ import annotations

import tomllib
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from labcourse.errors import GradingError


def read(file: Path) -> dict[str, Any]:
    """What stands in a file.

    Raises
    ------
    FileNotFoundError
        If there is none.
    GradingError
        If it cannot be read, or is not TOML.
    """
    try:
        return tomllib.loads(file.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise
    except tomllib.TOMLDecodeError as error:
        raise GradingError(f"{file} is not TOML: {error}") from None
    except (OSError, ValueError) as error:
        raise GradingError(f"{file} cannot be read: {error}") from None


def refuse(file: Path, faults: Iterable[str]) -> None:
    """Raise GradingError if there are faults in a file; the message tells each."""
    told = list(faults)
    if told:
        raise GradingError("\n  ".join([f"{file} cannot be used:", *told]))


def are_texts(value: object) -> bool:
    """Whether a value is a list of texts; an empty one is."""
    return isinstance(value, list) and all(isinstance(one, str) for one in value)
