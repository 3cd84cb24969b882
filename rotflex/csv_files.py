"""Recordings in text files: a row for each sample, and above them a heading with its unit for each column.

A comment line with a description may come first. Columns are separated by commas, semicolons or tabs; beside semicolons
and tabs, numbers may have decimal commas. A heading is ``theta_deg`` or ``theta (deg)``; ``Time (s)`` and ``V_m (V)``
are understood.
"""

from __future__ import annotations

import codecs
import csv
import io
import json
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotflex.errors import RecordingError
from rotflex.units import DEG

ENDINGS = (".csv", ".tsv", ".txt")  #: of text files
EXAMPLE = "t_s,theta_deg,alpha_deg,vm_V"  #: how columns are named
#: Unit in a heading, in small letters → the unit inside, and the factor that leads to it.
_SCALES = {"s": ("s", 1.0), "ms": ("s", 1e-3), "deg": ("rad", DEG), "°": ("rad", DEG), "rad": ("rad", 1.0)}
_SCALES |= {"v": ("V", 1.0), "mv": ("V", 1e-3)}
_HEADING = re.compile(r"(.+?)\s*[(\[](.+)[)\]]|(.+)_(.+)")
_NO_NUMBER = re.compile(r"[^-+.\deE ]")
_OF_NO_INTEREST = "-"  # in place of a name

Array = NDArray[np.float64]


def table(path: Path, names: Sequence[str]) -> tuple[Sequence[str], Array, dict[str, Any]]:
    """A file's headings, its numbers (a row for each sample), and its description.

    Parameters
    ----------
    path : of the file
    names : of its columns, in place of headings; may be empty for a file that has headings

    Raises
    ------
    RecordingError
        If it cannot be read, has another form, or has no headings and none are given.
    """
    rows, metadata = _read(path)
    first = rows[0] if rows else []
    bare = bool(first) and _NO_NUMBER.search("".join(first)) is None
    if bare and not names:
        raise RecordingError(f"{path.name} has no headings. {name_columns(len(first))}")
    headings = names or first
    return headings, _numbers(path.name, rows[0 if bare else 1 :], len(headings)), metadata


def name_columns(count: int) -> str:
    """Tell how to name so many columns."""
    return (
        f'Name its {count} columns with their units, as in columns="{EXAMPLE}" (in a command, --columns {EXAMPLE}), '
        f"and those of no interest {_OF_NO_INTEREST}."
    )


def signals(
    file: str, headings: Sequence[str], numbers: Array, units: Mapping[str, str]
) -> tuple[Array, dict[str, Array]]:
    """The time (n,) in s, and the channels (n,) in the units inside, of a table of numbers.

    Parameters
    ----------
    file : its name, for messages
    headings : of the columns
    numbers : a row for each sample
    units : of the channels that there may be: name → unit inside

    Raises
    ------
    RecordingError
        If a heading is not understood, stands there twice, or none is the time's.
    """
    inside = {"t": "s", **units}
    spelled = {"time": "t"} | {name.replace("_", ""): name for name in inside}
    found: dict[str, Array] = {}
    for heading, values in zip(headings, numbers.T, strict=True):
        if heading.strip() == _OF_NO_INTEREST:
            continue
        match = _HEADING.fullmatch(heading.strip())
        written, unit = (part for part in match.groups() if part) if match else (heading, "")
        name = spelled.get(re.sub(r"[\W_]", "", written.casefold()), "")
        into, factor = _SCALES.get(unit.strip().casefold(), ("", 1.0))
        if not name or into != inside[name]:
            raise RecordingError(
                f"{file}: column {heading!r} is none of {', '.join(inside)} with its unit, as in theta_deg or "
                f"theta (deg). {name_columns(len(headings))}"
            )
        if name in found:
            raise RecordingError(f"{file}: there are two columns for {name}.")
        found[name] = values * factor
    if "t" not in found:
        raise RecordingError(f"{file}: a column should be headed t_s, or time (s); the headings are {list(headings)}.")
    return found.pop("t"), found


def _read(path: Path) -> tuple[list[list[str]], dict[str, Any]]:
    try:
        content = path.read_bytes()
        wide = content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))  # Excel's "Unicode text"
        try:
            text = content.decode("utf-16" if wide else "utf-8-sig")  # spreadsheets put a byte order mark first
        except UnicodeDecodeError:
            text = content.decode("cp1252", "replace")  # or write no Unicode at all
        first, _newline, rest = text.partition("\n")
        metadata = metadata_of(first[1:], path.name) if first.startswith("#") else {}
        if first.startswith("#"):
            text, first = rest, rest.partition("\n")[0]
        separator = next((one for one in "\t;" if one in first), ",")
        rows = [row for row in csv.reader(io.StringIO(text, newline=""), delimiter=separator) if any(row)]
        while rows and all(len(row) > 1 and not row[-1].strip() for row in rows):  # each line ends in a separator
            rows = [row[:-1] for row in rows]
        if separator != ",":
            rows = [[cell.replace(",", ".") for cell in row] for row in rows]
        return rows, metadata
    except FileNotFoundError:
        raise RecordingError(f"There is no file {path}.") from None
    except (OSError, csv.Error) as error:
        raise RecordingError(f"{path.name} cannot be read as a table: {error}") from None


def _numbers(file: str, rows: list[list[str]], count: int) -> Array:
    for row in rows:
        if len(row) != count:
            raise RecordingError(f"{file}: every row needs {count} numbers, one for each heading; one is {row}.")
    try:
        return np.array(rows, dtype=np.float64).reshape(len(rows), count)
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
