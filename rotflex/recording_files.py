"""Recordings in files as people have them: tables of text, and the ``.mat`` files of MATLAB, Simulink and Octave.

A text file has a row of numbers for each sample. Columns are separated by commas, semicolons, tabs or blanks; beside
any but commas, numbers may have decimal commas. Lines above the first row are headings, also behind ``#`` or ``%``:
a name with its unit, ``theta_deg`` or ``theta (deg)``, or names and below them units. A description in JSON behind
``#`` may come first.

In a ``.mat`` file, an array of time and signals, ``data_theta``, is found as

* a matrix with a row for each sample, or with a column for each;
* a structure with time, as Simulink leaves it: ``data_theta.time`` and ``data_theta.signals.values``, in rows or
  columns, of one signal or several;
* one of these within other structures, as ``log.run.data_theta``.

Names are found however they are capitalised (the workbook has ``data_Vm`` and ``data_vm``).

Of any other ``.mat`` file, all vectors, and the columns of all matrices, are a table, also those within structures:
MATLAB's plain vectors, structures with time under any name, the matrix that Simulink's *To File* writes. Files of
MATLAB's format 7.3 (HDF5) are read by h5py, the extra ``hdf5``.
"""

from __future__ import annotations

import codecs
import csv
import json
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from rotflex.errors import RecordingError, UnknownColumns
from rotflex.units import DEG, Array, Vector

MAT = ".mat"  #: ending of the files of MATLAB, Simulink and Octave
#: Unit in a heading, in small letters → the unit inside, and the factor that leads to it.
_SCALES = {"s": ("s", 1.0), "ms": ("s", 1e-3), "us": ("s", 1e-6), "µs": ("s", 1e-6)}
_SCALES |= {"deg": ("rad", DEG), "°": ("rad", DEG), "rad": ("rad", 1.0), "v": ("V", 1.0), "mv": ("V", 1e-3)}
_HEADING = re.compile(r"(.+?)\s*[(\[](.+)[)\]]|(.+)_(.+)")
#: What MATLAB has about the name of a signal: structures that it is in, and the number of a column.
_OF_STRUCTURES = re.compile(r"^(\w+(\(\d+\))?\.)+(?=\w)(?!signals|values)|(\.signals(\(\d+\))?\.values)?(\(\d+\))?$")
_NUMBER = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)(e[-+]?\d+)?|nan|[-+]?inf", re.IGNORECASE)
_SEPARATORS = (";", "\t", ",", None)  # None: blanks
_OF_NO_INTEREST = "-"  # in place of a name
_GUESSED = ("t", "theta", "alpha", "vm")  # the channels of a log, in the order in which most tables have them
_SPELLED = {"time": "t", "millis": "t", "position": "theta", "deflection": "alpha", "voltage": "vm", "u": "vm"}
_LARGEST_STEP = 0.25  # s, between samples of a log; more are ms, or µs
_LARGEST_ANGLE = 2 * np.pi  # of a joint in a log, rad; more are degrees
_LINE = 100_000  # characters of a line that are looked at
_SHOWN = 30  # columns of a table in a message
_SHORT, _FEWEST = 0.1, 20  # of the longest vector of a file, and samples: shorter ones are no signals
COLUMNS = {"data_theta": (2, 3), "data_alpha": (2, 3), "data_vm": (2,)}  #: of an array, its time among them
_KNOWN = re.compile(rf"((?:.*\.)?({'|'.join(COLUMNS)}))(\.time|\.signals(?:\(\d+\))?\.values|)", re.IGNORECASE)
OTHER = "rotflex_other"  #: name of the matrix of time and of what has no array above; the description names its columns
METADATA = "rotflex_metadata"  #: name of the text that says where a recording comes from
_DEEPEST = 5  # structures within structures
_HDF5 = (b"MATLAB 7.3 MAT-file", b"\x89HDF")  # how such files begin
_OCTAVE = b"# Created by Octave"
#: Ending of files that hold no table which can be read here → what they are, and the way out.
_NO_TABLE = {
    ".m": "a program for MATLAB or Octave. Run it there, and save its vectors: save('log.mat', 't', 'theta', '-v7').",
    ".tdms": "a file of LabVIEW. Convert it by npTDMS: TdmsFile.read(name).as_dataframe().to_csv('log.csv').",
    ".bin": "bare numbers, and only the program that wrote them knows their order. Read them by numpy.fromfile, and "
    "build the recording by Recording.of.",
}


class Table(NamedTuple):
    """The columns of a file.

    Attributes
    ----------
    headings : of the columns; none, or one for each
    columns : vectors; of a ``.mat`` file, they may differ in length
    metadata : the file's description
    """

    headings: Sequence[str]
    columns: Sequence[Vector]
    metadata: dict[str, Any]


# --- what the columns are ---------------------------------------------------------------------------------------------


def signals(
    file: str, table: Table, columns: Sequence[str], units: Mapping[str, str]
) -> tuple[Vector, dict[str, Vector]]:
    """Return the time (n,) in s, and the channels (n,) in the units inside, of a table.

    Parameters
    ----------
    file : its name, for messages
    table : the file's
    columns : what its columns are; see ``Recording.load``. If there are none, its headings say it
    units : of the channels that there may be: name → unit inside

    Raises
    ------
    UnknownColumns
        If the headings do not say what all columns are.
    RecordingError
        If ``columns`` is not understood, stands for a channel twice, or for no time; or if no column is a time.
    """
    if not columns and not table.headings:
        raise _unknown(file, table, "it has no headings")
    inside = {"t": "s", **units}
    found: dict[str, Vector] = {}
    for heading, place in _chosen(file, table, columns):
        name, unit = _meaning(heading, inside)
        into, factor = _SCALES.get(unit.casefold(), ("", 1.0))
        if not name or into != inside[name]:
            why = f"{heading!r} should be one of {', '.join(inside)} with its unit, as in theta_deg or theta (deg)"
            raise RecordingError(f"{file}: {why}.") if columns else _unknown(file, table, why)
        if name in found:
            raise RecordingError(f"{file}: there are two columns for {name}.")
        found[name] = table.columns[place] * factor
    if "t" not in found:
        raise RecordingError(f"{file}: no column is headed t_s, or time (s): {list(columns or table.headings)}.")
    return found.pop("t"), found


def _chosen(file: str, table: Table, columns: Sequence[str]) -> Iterator[tuple[str, int]]:
    """Yield a name with its unit, and the place of its column, for each column that is of interest."""
    count = len(table.columns)
    if not any("=" in entry for entry in columns):
        if len(columns) not in (0, count):
            raise RecordingError(
                f"{file} has {count} columns, and columns= names {len(columns)}: name them all in order, with "
                f"{_OF_NO_INTEREST} for what is of no interest, or those of interest, as in t_s=1,theta_deg=3."
            )
        names = enumerate(columns or table.headings)
        yield from ((name.strip(), place) for place, name in names if name.strip() != _OF_NO_INTEREST)
        return
    for entry in columns:
        name, _equals, which = (part.strip() for part in entry.partition("="))
        places = [n for n in range(count) if which in (str(n + 1), *table.headings[n : n + 1])]
        if len(places) != 1:
            many = "no column of it is meant" if not places else "several columns may be meant"
            raise RecordingError(f"{file}: {entry!r}: {many}. {_first_rows(table)}")
        yield name, places[0]


def _meaning(heading: str, names: Iterable[str]) -> tuple[str, str]:
    """Return which of the names a heading means, "" for none, and its unit, "" where it has none that is known."""
    heading = _OF_STRUCTURES.sub("", heading.strip())
    spelled = {"time": "t"} | {name.replace("_", ""): name for name in names}
    match = _HEADING.fullmatch(heading)
    written, unit = (part.strip() for part in match.groups() if part) if match else ("", "")
    if unit.casefold() not in _SCALES:
        written, unit = heading, ""
    name = spelled.get(re.sub(r"[\W_]", "", written.casefold()), "")
    return name, unit if name else ""


def _unknown(file: str, table: Table, why: str) -> RecordingError:
    """Return the error that asks what the columns are, with a guess; or that says that none is a time."""
    longest = max(column.size for column in table.columns)
    places = [n for n, column in enumerate(table.columns) if column.size == longest and not np.isnan(column).all()]
    growing = [place for place in places if (np.diff(table.columns[place]) > 0).all()]
    if not growing:
        return RecordingError(
            f"{file}: {why}, and no column grows from row to row, as a time does. Save the time with the signals; or, "
            "if you know the sample time, build the recording by Recording.of(np.arange(n) * 0.002, theta=…). "
            f"{_first_rows(table)}"
        )
    meant: dict[str, tuple[int, str]] = {}
    for place in places if table.headings else ():
        name, unit = _meaning(table.headings[place], [*_GUESSED, *_SPELLED])
        meant.setdefault(_SPELLED.get(name, name), (place, unit))
    if meant.get("t", (-1,))[0] not in growing:
        meant["t"] = growing[0], ""
    if meant.keys().isdisjoint(_GUESSED[1:]):
        meant |= zip(_GUESSED[1:], ((place, "") for place in places if place != meant["t"][0]), strict=False)
    step = float(np.median(np.diff(table.columns[meant["t"][0]])))
    angles = [table.columns[meant[name][0]] for name in ("theta", "alpha") if name in meant]
    likely = dict.fromkeys(_GUESSED, "deg" if any(np.abs(one).max() > _LARGEST_ANGLE for one in angles) else "rad")
    likely |= {"t": "s" if step < _LARGEST_STEP else "ms" if step < 1e3 * _LARGEST_STEP else "us", "vm": "V"}
    error = UnknownColumns(f"{file}: {why}. {_first_rows(table)}")
    found = {name: meant[name] for name in _GUESSED if name in meant}
    error.guess |= {name: f"{place + 1} {unit or likely[name]}" for name, (place, unit) in found.items()}
    return error


def _first_rows(table: Table) -> str:
    """Return a line for each column: its number, its name, its first values, and what it lies between."""
    names = table.headings or [""] * len(table.columns)
    lines = [f"{n:3} {name:{max(map(len, names))}}" for n, name in enumerate(names[:_SHOWN], 1)]
    values = ([*column[:3], column.min(), column.max()] for column in table.columns)
    numbers = ("".join(f" {value:12.6g}" for value in some) for some in values)
    return "\n".join(["Its columns, their first values, the least and the largest:", *map(str.__add__, lines, numbers)])


# --- tables of text ---------------------------------------------------------------------------------------------------


def table(path: Path) -> Table:
    """Read the columns of a file.

    Raises
    ------
    RecordingError
        If it cannot be read, or holds no table of numbers; it then says what it is.
    """
    ending = path.suffix.casefold()
    if ending in _NO_TABLE and path.exists():
        raise RecordingError(f"{path.name} is {_NO_TABLE[ending]}")
    return _vectors(path) if ending == MAT else _text(path)


def _text(path: Path) -> Table:
    lines = [line for line in _decoded(path).splitlines() if line.strip()]
    metadata = {}
    if lines and lines[0].startswith("#") and lines[0][1:].lstrip().startswith("{"):
        metadata = metadata_of(lines.pop(0)[1:], path.name)
    first, cells = next(((n, cells) for n, line in enumerate(lines) if (cells := _numbers(line))), (0, []))
    if not cells:
        begins = "".join(lines[:1])[:80]
        raise RecordingError(f"{path.name} has no row of numbers, which every sample should be; it begins: {begins!r}.")
    separator = _separator(lines[first])
    if separator != ",":
        lines[first:] = [line.replace(",", ".") for line in lines[first:]]
    rows = (line.replace('"', "") for line in lines[first:])
    convert: dict[int | str, Callable[[str], float]] = {
        place: (lambda _text: np.nan) if cell and not _NUMBER.fullmatch(cell) else _or_none
        for place, cell in enumerate(cells)
    }
    try:
        numbers = np.loadtxt(rows, np.float64, ["#", "%"], separator, convert, ndmin=2)
    except ValueError as error:
        raise RecordingError(f"{path.name}: every row needs {len(cells)} numbers, as the first: {error}") from None
    headings = _headings(lines[:first], separator, len(cells))
    last = np.flatnonzero(~np.isnan(numbers).all(axis=0)).max() + 1  # each line may end in a separator
    return Table(headings[:last], list(numbers.T[:last]), metadata)


def _headings(lines: Sequence[str], separator: str | None, count: int) -> list[str]:
    """Return the headings of so many columns: the last line above them with as many cells, with the units below it."""
    rows: list[list[str]] = []
    for line in lines:
        bare = line.strip().lstrip("#%").strip(" \r\n")
        tried = (_cells(bare, one) for one in (separator, *_SEPARATORS))  # numpy's savetxt has other ones in its header
        rows += next(([row] for row in tried if len(row) == count), [])
    if len(rows) > 1 and all(unit.strip("()[] ").casefold() in (*_SCALES, "", _OF_NO_INTEREST) for unit in rows[-1]):
        return [f"{name} ({unit.strip('()[] ')})" for name, unit in zip(*rows[-2:], strict=True)]
    return rows[-1] if rows else []


def _separator(line: str) -> str | None:
    """Return what separates the numbers of a row; None for blanks, beside which commas are decimal."""
    in_blanks = re.search(r"\d\s+[-+.\d]", line) is not None
    return next((one for one in _SEPARATORS if one and one in line and not (one == "," and in_blanks)), None)


def _numbers(line: str) -> list[str]:
    """Return the cells of a row of numbers, in which text may stand, too; none if the line is another one."""
    separator = _separator(line)
    cells = _cells(line if separator == "," else line.replace(",", "."), separator)
    numbers = [_NUMBER.fullmatch(cell) is not None for cell in cells]
    return cells if sum(numbers) > 1 and numbers[0] else []


def _cells(line: str, separator: str | None) -> list[str]:
    if separator is None:  # a unit in brackets belongs to the name before it
        return re.sub(r"\s+(?=[(\[])", "", line).split()
    return [cell.strip() for cell in next(csv.reader([line[:_LINE]], delimiter=separator, skipinitialspace=True), [])]


def _or_none(cell: str) -> float:
    return float(cell.strip() or "nan")


def _decoded(path: Path) -> str:
    try:
        content = path.read_bytes()
    except OSError as error:
        raise RecordingError(f"{path} cannot be read: {error.strerror}.") from None
    wide = content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))  # Excel's "Unicode text"
    if b"\0" in content and not wide:
        raise RecordingError(f"{path.name} is no text: in the program that wrote it, export it as text (.csv).")
    try:
        return content.decode("utf-16" if wide else "utf-8-sig")  # spreadsheets put a byte order mark first
    except UnicodeDecodeError:
        return content.decode("cp1252", "replace")  # or write no Unicode at all


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
        If the file cannot be read, holds one of the arrays in several places, or one of another form; or its
        description is no JSON object.
    """
    content = _content(path)
    found: dict[str, dict[str, list[Array]]] = {name: {} for name in COLUMNS}
    for where, array in _leaves(content):
        if match := _KNOWN.fullmatch(where):
            parts = found[match[2].casefold()].setdefault(match[1], [])
            parts.insert(0 if match[3] == ".time" else len(parts), array)
    made: dict[str, Array] = {}
    for name, places in found.items():
        every = {where: _stacked(path, where, parts, COLUMNS[name]) for where, parts in places.items()}
        for where, array in every.items():
            if made.setdefault(name, array) is not array and not np.array_equal(made[name], array):
                first = next(iter(every))
                raise RecordingError(f"{path.name} holds {name} twice, as {first} and as {where}: save one by itself.")
    other = np.asarray(content.get(OTHER, ()))
    if other.ndim == 2 and other.dtype.kind in "fiu":
        made[OTHER] = other.astype(np.float64)
    described = np.asarray(content.get(METADATA, ""))
    text = str(described.flat[0]) if described.size else ""
    return made, metadata_of(text, path.name) if text else {}


def _vectors(path: Path) -> Table:
    """Read all vectors and columns of matrices as a table, named as MATLAB names them."""
    content = _content(path)
    named: dict[str, Vector] = {}
    for where, array in _leaves(content):
        columns = array.T if array.ndim == 1 or array.shape[0] >= array.shape[1] else array
        for number, column in enumerate(np.atleast_2d(columns), 1):
            named[where if array.ndim == 1 else f"{where}({number})"] = column.astype(np.float64)
    longest = max((column.size for column in named.values()), default=0)
    named = {where: column for where, column in named.items() if column.size > max(_SHORT * longest, _FEWEST - 1)}
    if not named:
        raise RecordingError(
            f"{path.name} holds none of {', '.join(COLUMNS)}, and no vectors of {_FEWEST} real numbers or more. Of "
            "objects (timeseries, Dataset), which only MATLAB reads, save the vectors of their Time and Data."
        )
    return Table(list(named), list(named.values()), {})


def _leaves(value: Any, where: str = "", depth: int = 0) -> Iterator[tuple[str, Array]]:
    """Yield all vectors and matrices of numbers, in structures as well, with their names."""
    if isinstance(value, Mapping) and depth <= _DEEPEST:
        for name, inner in value.items():
            yield from _leaves(inner, f"{where}.{name}".strip("."), depth + 1)
    elif isinstance(value, list) and depth <= _DEEPEST:
        for number, inner in enumerate(value, 1):
            yield from _leaves(inner, f"{where}({number})", depth + 1)
    elif isinstance(value, np.ndarray) and value.dtype.kind in "fiu" and value.ndim in (1, 2) and value.size > 1:
        yield where, np.squeeze(value)


def _content(path: Path) -> dict[str, Any]:
    """The variables, structures as dictionaries; where not all can be read, those that are known."""
    from scipy.io import loadmat

    try:
        try:
            content: dict[str, Any] = loadmat(str(path), simplify_cells=True)
        except Exception:  # of what lies beside ours, too
            content = loadmat(str(path), variable_names=[*COLUMNS, OTHER, METADATA], simplify_cells=True)
    except OSError as error:
        raise RecordingError(f"{path} cannot be read: {error.strerror or error}.") from None
    except Exception as error:  # scipy's reader fails on a broken file in many ways
        return _saved_otherwise(path, error)
    return {name: value for name, value in content.items() if not name.startswith("__")}


def _saved_otherwise(path: Path, error: Exception) -> dict[str, Any]:
    """The variables of a file that is in none of scipy's formats, if it is HDF5."""
    begins = path.read_bytes()[: len(_OCTAVE)]
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


def _stacked(path: Path, where: str, parts: Sequence[Array], allowed: tuple[int, ...]) -> Array:
    """Return a matrix of time and signals: one as it is; or of a structure, its time before its signals."""
    array = parts[0]
    if len(parts) > 1:
        samples = array.size
        columns = [part.T if part.ndim == 2 and part.shape[0] != samples else part for part in parts]
        array = np.column_stack(columns) if all(part.shape[0] == samples for part in columns) else np.empty(0)
    if array.ndim == 2 and array.shape[1] not in allowed and array.shape[0] in allowed:
        array = array.T
    if array.ndim != 2 or array.shape[1] not in allowed:
        shapes, more = " and ".join(str(part.shape) for part in parts), " or ".join(str(n - 1) for n in allowed)
        raise RecordingError(
            f"{path.name}: {where} is {shapes}; it should be a time column and {more} more, or a structure with time "
            "and signals.values."
        )
    return np.ascontiguousarray(array, dtype=np.float64)
