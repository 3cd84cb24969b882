"""Recordings in .csv files: a comment with a description, a header with units, and a row for each sample."""

from __future__ import annotations

import csv
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotflex.errors import RecordingError
from rotflex.units import DEG

#: Unit in a heading → the unit inside, and the factor that leads to it.
_SCALES = {"deg": ("rad", DEG), "rad": ("rad", 1.0), "V": ("V", 1.0)}

Array = NDArray[np.float64]


def columns(path: Path, units: Mapping[str, str]) -> tuple[Array, dict[str, Array], dict[str, Any]]:
    """A file's time (n,) in s, its channels (n,) in the units inside, and its description.

    Parameters
    ----------
    path : of the file
    units : of the channels that there may be: name → unit inside

    Raises
    ------
    RecordingError
        If it cannot be read, or has another form.
    """
    rows, metadata = _read(path)
    header = rows[0] if rows else []
    if not header or header[0] != "t_s":
        raise RecordingError(f"{path.name}: the first column should be headed t_s; the header is {header}.")
    table = _table(path.name, rows)
    channels: dict[str, Array] = {}
    for index, heading in enumerate(header[1:], start=1):
        name, _sign, unit = heading.rpartition("_")
        if unit not in _SCALES or units.get(name) != _SCALES[unit][0]:
            raise RecordingError(
                f"{path.name}: column {heading!r} is none of {', '.join(units)} with its unit, as in theta_deg."
            )
        if name in channels:
            raise RecordingError(f"{path.name}: there are two columns for {name}.")
        channels[name] = table[:, index] * _SCALES[unit][1]
    return table[:, 0], channels, metadata


def _read(path: Path) -> tuple[list[list[str]], dict[str, Any]]:
    try:
        with path.open(newline="", encoding="utf-8-sig") as file:  # spreadsheets put a byte order mark first
            first = file.readline()
            metadata = metadata_of(first[1:], path.name) if first.startswith("#") else {}
            if not first.startswith("#"):
                file.seek(0)
            return [row for row in csv.reader(file) if any(row)], metadata
    except FileNotFoundError:
        raise RecordingError(f"There is no file {path}.") from None
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise RecordingError(f"{path.name} cannot be read as a .csv file: {error}") from None


def _table(file: str, rows: list[list[str]]) -> Array:
    count = len(rows[0])
    for row in rows[1:]:
        if len(row) != count:
            raise RecordingError(f"{file}: every row needs {count} numbers, as the header; one is {row}.")
    try:
        return np.array(rows[1:], dtype=np.float64).reshape(-1, count)
    except ValueError as error:
        raise RecordingError(f"{file}: every row needs {count} numbers: {error}") from None


def metadata_of(text: str, source: str) -> dict[str, Any]:
    """A file's description, which is a JSON object.

    Parameters
    ----------
    text : of it
    source : name of the file, for the message

    Raises
    ------
    RecordingError
        If it is something else.
    """
    try:
        metadata = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise RecordingError(f"{source}: its description is not JSON: {error}") from None
    if not isinstance(metadata, dict):
        raise RecordingError(f"{source}: its description should be a JSON object.")
    return metadata
