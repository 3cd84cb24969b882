"""Recordings in files as people have them: tables of text, and the ``.mat`` files of MATLAB, Simulink and Octave.

A text file has a row for each sample, and above them a heading with its unit for each column. A comment line with a
description may come first. Columns are separated by commas, semicolons or tabs; beside semicolons and tabs, numbers may
have decimal commas. A heading is ``theta_deg`` or ``theta (deg)``; ``Time (s)`` and ``V_m (V)`` are understood.

In a ``.mat`` file, an array of time and signals, ``data_theta``, is found as

* a matrix with a row for each sample, or with a column for each;
* a structure with time, as Simulink leaves it: ``data_theta.time`` and ``data_theta.signals.values``, in rows or
  columns, of one signal or several;
* one of these within other structures, as ``log.run.data_theta``.

Names are found however they are capitalised (the workbook has ``data_Vm`` and ``data_vm``).

The matrix of Simulink's *To File* has a row for the time and one for each signal, and no names: see :func:`matrix`.
Files of MATLAB's format 7.3 (HDF5), which *To File* writes as well, are read by h5py, the extra ``hdf5``.
"""

from __future__ import annotations

import codecs
import csv
import io
import json
import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rotflex.errors import RecordingError
from rotflex.units import DEG, Array

ENDINGS = (".csv", ".tsv", ".txt")  #: of text files
EXAMPLE = "t_s,theta_deg,alpha_deg,vm_V"  #: how columns are named
#: Unit in a heading, in small letters → the unit inside, and the factor that leads to it.
_SCALES = {"s": ("s", 1.0), "ms": ("s", 1e-3), "deg": ("rad", DEG), "°": ("rad", DEG), "rad": ("rad", 1.0)}
_SCALES |= {"v": ("V", 1.0), "mv": ("V", 1e-3)}
_HEADING = re.compile(r"(.+?)\s*[(\[](.+)[)\]]|(.+)_(.+)")
_NO_NUMBER = re.compile(r"[^-+.\deE ]")
_OF_NO_INTEREST = "-"  # in place of a name
COLUMNS = {"data_theta": (2, 3), "data_alpha": (2, 3), "data_vm": (2,)}  #: of an array, its time among them
OTHER = "rotflex_other"  #: name of the matrix of time and of what has no array above; the description names its columns
METADATA = "rotflex_metadata"  #: name of the text that says where a recording comes from
_DEEPEST = 5  # structures within structures
_HDF5 = (b"MATLAB 7.3 MAT-file", b"\x89HDF")  # how such files begin
_OCTAVE = b"# Created by Octave"


# --- tables of text ---------------------------------------------------------------------------------------------------


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
    headings, rows = names or first, rows[0 if bare else 1 :]
    needed = f"{path.name}: every row needs {len(headings)} numbers"
    for row in rows:
        if len(row) != len(headings):
            raise RecordingError(f"{needed}, one for each heading; one is {row}.")
    try:
        return headings, np.array(rows, dtype=np.float64).reshape(len(rows), len(headings)), metadata
    except ValueError as error:
        raise RecordingError(f"{needed}: {error}") from None


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


# --- MATLAB, Simulink, Octave -----------------------------------------------------------------------------------------


def arrays(path: Path) -> tuple[dict[str, Array], dict[str, Any]]:
    """The known arrays of a file, each with a row for each sample, and its description.

    Raises
    ------
    RecordingError
        If the file cannot be read, holds none of the arrays, or one in several places, or one of another form; or its
        description is no JSON object.
    """
    content = _content(path)
    found: dict[str, tuple[str, Any]] = {}
    for name, where, value in _places(content):
        if name in found and not _same(found[name][1], value):
            raise RecordingError(
                f"{path.name} holds {name} twice, as {found[name][0]} and as {where}: save the one that is meant "
                "by itself."
            )
        found.setdefault(name, (where, value))
    made = {name: _array(path, *found[name], COLUMNS[name]) for name in COLUMNS if name in found}
    other = np.asarray(content.get(OTHER, ()))
    if other.ndim == 2 and other.dtype.kind in "fiu":
        made[OTHER] = other.astype(np.float64)
    if not made:
        rows = max(_matrices(content).values(), key=np.size, default=np.empty((0, 0))).shape
        hint = f" It holds a matrix without names. {name_columns(min(rows))}" if any(rows) else ""
        raise RecordingError(f"{path.name} holds none of {', '.join(COLUMNS)}.{hint}")
    described = np.asarray(content.get(METADATA, ""))
    text = str(described.flat[0]) if described.size else ""
    return made, metadata_of(text, path.name) if text else {}


def matrix(path: Path, count: int) -> Array:
    """The one matrix of a file with so many signals, its time among them: a row for each sample.

    Raises
    ------
    RecordingError
        If the file cannot be read, or holds no such matrix, or several.
    """
    found = _matrices(_content(path))
    fitting = [value for value in found.values() if min(value.shape) == count]
    if len(fitting) != 1:
        listed = ", ".join(f"{name} {value.shape}" for name, value in found.items()) or "none"
        raise RecordingError(
            f"{path.name} should hold one matrix with {count} rows, as many as there are names in columns; of matrices "
            f"it holds {listed}."
        )
    return np.asarray(fitting[0] if fitting[0].shape[1] == count else fitting[0].T, dtype=np.float64)


def _matrices(content: Mapping[str, Any]) -> dict[str, NDArray[Any]]:
    """The matrices of numbers that can be signals: two or more, of more samples."""
    found = {name: one for name, one in content.items() if isinstance(one, np.ndarray) and one.ndim == 2}
    return {name: one for name, one in found.items() if min(one.shape) > 1 and one.dtype.kind in "fiu"}


def _content(path: Path) -> dict[str, Any]:
    """The variables, structures as dictionaries; where not all can be read, those that are known."""
    from scipy.io import loadmat

    try:
        try:
            content: dict[str, Any] = loadmat(str(path), simplify_cells=True)
        except Exception:  # of what lies beside ours, too
            content = loadmat(str(path), variable_names=[*COLUMNS, OTHER, METADATA], simplify_cells=True)
    except FileNotFoundError:
        raise RecordingError(f"There is no file {path}.") from None
    except Exception as error:  # scipy's reader fails on a broken file in many ways
        return _saved_otherwise(path, error)
    return {name: value for name, value in content.items() if not name.startswith("__")}


def _saved_otherwise(path: Path, error: Exception) -> dict[str, Any]:
    """The variables of a file that is in none of scipy's formats, if it is HDF5."""
    try:
        with path.open("rb") as file:
            begins = file.read(len(_OCTAVE))
    except OSError:
        begins = b""
    if begins.startswith(_HDF5):
        return _of_hdf5(path)
    if begins == _OCTAVE:
        raise RecordingError(f"{path.name} is in Octave's own text format. Save it with the option -v7.") from None
    raise RecordingError(f"{path.name} cannot be read as a .mat file: {error}") from None


def _of_hdf5(path: Path) -> dict[str, Any]:
    try:
        import h5py
    except ImportError:
        raise RecordingError(
            f"{path.name} is in MATLAB's format 7.3 (HDF5), which needs h5py: pip install 'rotflex[hdf5]'. Or save it "
            "with the option -v7."
        ) from None

    def plain(node: Any) -> Any:
        if "OCTAVE_NEW_FORMAT" in node.attrs:
            raise ValueError("it is Octave's own")
        if isinstance(node, h5py.Group):
            fields = {name: plain(one) for name, one in node.items()}
            if fields and all(isinstance(one, list) for one in fields.values()):  # an array of structures
                return [dict(zip(fields, row, strict=True)) for row in zip(*fields.values(), strict=True)]
            return fields
        value = node[()]
        if h5py.check_ref_dtype(node.dtype):
            return [plain(node.file[one]) for one in np.ravel(value)]
        if node.attrs.get("MATLAB_class") == b"char":
            return "".join(map(chr, np.ravel(value)))
        return np.transpose(value)  # MATLAB's columns come first

    try:
        with h5py.File(path) as file:
            return {name: plain(one) for name, one in file.items() if not name.startswith("#")}
    except Exception as error:  # a broken file, in many ways
        raise RecordingError(
            f"{path.name} cannot be read as HDF5 (MATLAB's format 7.3): {error}. Save it with the option -v7."
        ) from None


def _places(content: Mapping[str, Any], within: str = "", depth: int = 0) -> Iterator[tuple[str, str, Any]]:
    """(name, where it is, value) of what is named like an array, in structures as well."""
    for name, value in content.items():
        where = f"{within}{name}"
        if name.casefold() in COLUMNS:
            yield name.casefold(), where, value
        elif isinstance(value, Mapping) and depth < _DEEPEST:
            yield from _places(value, f"{where}.", depth + 1)


def _same(one: Any, other: Any) -> bool:
    return not isinstance(one, Mapping) and not isinstance(other, Mapping) and np.array_equal(one, other)


def _array(path: Path, where: str, value: Any, allowed: tuple[int, ...]) -> Array:
    """A matrix of a time column and the signals."""
    if isinstance(value, Mapping):
        value = _with_time(path, where, value)
    array = np.asarray(value)
    if array.ndim == 2 and array.shape[1] not in allowed and array.shape[0] in allowed:
        array = array.T
    if array.ndim != 2 or array.shape[1] not in allowed or array.dtype.kind not in "fiu":
        raise RecordingError(
            f"{path.name}: {where} is {array.shape} of {array.dtype}; it should be a time column and "
            f"{' or '.join(str(columns - 1) for columns in allowed)} more, all numbers."
        )
    return np.ascontiguousarray(array, dtype=np.float64)


def _with_time(path: Path, where: str, value: Mapping[str, Any]) -> Array:
    """The matrix of a structure with time."""
    signals = value.get("signals")
    one_or_more: list[Any] = signals if isinstance(signals, list) else [signals]
    try:
        time = np.asarray(value["time"], dtype=np.float64).ravel()
        columns = [_columns(one["values"], time.size) for one in one_or_more]
        return np.column_stack([time, *columns])
    except (KeyError, TypeError, ValueError, IndexError):
        raise RecordingError(
            f"{path.name}: {where} is a structure; it should have the fields time and signals.values, of one "
            "length and all numbers."
        ) from None


def _columns(values: Any, samples: int) -> Array:
    """Signals (samples, n), whether they come in rows or in columns."""
    array = np.squeeze(np.asarray(values, dtype=np.float64))
    if array.ndim == 2 and array.shape[0] != samples:
        array = array.T
    if array.shape[:1] != (samples,):
        raise ValueError(array.shape)
    return array.reshape(samples, -1)
