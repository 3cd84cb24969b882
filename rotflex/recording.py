"""What an experiment leaves behind: a time axis, channels with their units, and where they come from.

Inside, angles are in radians and voltages in volts. In a file they have the layout of the laboratory's logs: arrays
whose first column is the time in seconds and whose angles are in degrees,

========================  =====================================================
``data_theta``            t, reference, theta (in a validation: t, model, theta)
``data_alpha``            t, alpha (in a validation: t, model, alpha)
``data_theta_l``          t, reference, theta + alpha (may be there; not needed)
``data_vm``               t, V_m
``rotflex_metadata``      JSON text: where the recording comes from
========================  =====================================================
"""

from __future__ import annotations

import csv
import html
import json
import os
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from rotflex import files, recording_files, unanswered
from rotflex.config import finite_vector, positive
from rotflex.doubts import UNEVEN, Doubt, of_recording
from rotflex.errors import RecordingError
from rotflex.units import DEG, Vector

if TYPE_CHECKING:
    from control import TimeResponseData
    from pandas import DataFrame

__all__ = ["UNITS", "Channel", "Recording"]


def __dir__() -> list[str]:
    return __all__


#: Channels with their unit in memory.
UNITS = {
    "theta_ref": "rad",
    "theta": "rad",
    "theta_model": "rad",
    "alpha": "rad",
    "alpha_model": "rad",
    "vm": "V",
}
PUSHED = "tau_link"  #: the channel of the torque that pushed the link, N·m
_ACTING = ("theta_ref", "vm", PUSHED)  # on the bench: the inputs of a response
_OTHER = "other_channels"  # in a file's description: those that it has no usual place for, name → unit
_WIDEST_GAP = 2  # usual steps, over which a recording is resampled


@dataclass(frozen=True, eq=False)
class Channel:
    """One signal: ``values`` (n,) in ``unit``."""

    values: Vector
    unit: str


@dataclass(frozen=True, eq=False)
class Recording:
    """Signals sampled together.

    Parameters
    ----------
    time : (n,) array, s, increasing; evenly for all but a look at it (see ``sample_time`` and ``resampled``)
    channels : mapping of name to :class:`Channel`; one that is named in ``UNITS`` has that unit, others any
    metadata : plain data (what JSON can hold): source, experiment, bench, software, ...

    Raises
    ------
    RecordingError
        If the time does not increase, if lengths differ, if values are not finite, or if a known channel is not
        in its unit.
    """

    time: Vector
    channels: Mapping[str, Channel]
    metadata: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        time = _read_only("time", self.time)
        if time.size < 2:
            raise RecordingError(f"A recording needs at least two samples; this one has {time.size}.")
        back = np.flatnonzero(np.diff(time) <= 0)
        if back.size:
            before, after = time[back[0] : back[0] + 2]
            raise RecordingError(f"The time does not increase: after t = {before:.6g} s comes {after:.6g} s.")
        channels = {}
        for name, channel in self.channels.items():
            values = _read_only(f"channel {name!r}", channel.values)
            if values.size != time.size:
                raise RecordingError(f"Channel {name!r} has {values.size} samples, the time has {time.size}.")
            if channel.unit != UNITS.get(name, channel.unit):
                raise RecordingError(f"Channel {name!r} is in {channel.unit}; inside, it should be in {UNITS[name]}.")
            channels[name] = Channel(values, channel.unit)
        object.__setattr__(self, "time", time)
        object.__setattr__(self, "channels", MappingProxyType(channels))
        object.__setattr__(self, "metadata", dict(self.metadata))

    @classmethod
    def of(cls, time: Any, metadata: Mapping[str, Any] | None = None, **channels: Any) -> Recording:
        """Build a recording from arrays in SI units, with the known channel names: ``Recording.of(t, alpha=alpha)``."""
        for name in channels:
            if name not in UNITS:
                raise RecordingError(f"There is no channel {name!r}; there are {', '.join(UNITS)}.")
        return cls(time, {name: Channel(values, UNITS[name]) for name, values in channels.items()}, metadata or {})

    @classmethod
    def of_response(cls, response: TimeResponseData) -> Recording:
        """Build a recording from a time response of python-control with signals that have our names, SI units.

        Examples
        --------
        >>> loop = control.ss(A, B, C, D, inputs="theta_ref", outputs=["theta", "alpha", "vm"])  # doctest: +SKIP
        >>> Recording.of_response(control.forced_response(loop, time, theta_ref))  # doctest: +SKIP

        Raises
        ------
        RecordingError
            If a signal is no channel of ours, or of several lengths, as responses to several inputs by turns are.
        """
        named = ((response.input_labels, response.u), (response.output_labels, response.y))
        signals = {
            label: row.ravel() for labels, rows in named if labels for label, row in zip(labels, rows, strict=True)
        }
        return cls.of(response.time, **signals)

    def __getitem__(self, name: str) -> Vector:
        """Samples (n,) of a channel, in SI units."""
        if name not in self.channels:
            raise RecordingError(f"This recording has no channel {name!r}; it has {', '.join(self.channels)}.")
        return self.channels[name].values

    def __contains__(self, name: object) -> bool:
        return name in self.channels

    def __len__(self) -> int:
        return int(self.time.size)

    def __repr__(self) -> str:
        listed = ", ".join(f"{name} ({channel.unit})" for name, channel in self.channels.items())
        doubted = "".join(f"; doubt: {doubt.code}" for doubt in self.doubts)
        return f"<Recording: {self._extent()}; {listed}{doubted}>"

    def _repr_html_(self) -> str:
        """A table of the channels, angles in degrees, for a notebook."""
        rows = []
        for name, channel in self.channels.items():
            values, unit = (self.degrees(name), "deg") if channel.unit == "rad" else (channel.values, channel.unit)
            numbers = (f"{one:.4g}" for one in (values.min(), values.max(), values.mean(), values[-1]))
            cells = "".join(f"<td>{one}</td>" for one in (html.escape(unit), *numbers))
            rows.append(f'<tr><th scope="row">{html.escape(name)}</th>{cells}</tr>')
        heads = "".join(f'<th scope="col">{one}</th>' for one in ("channel", "unit", "min", "max", "mean", "last"))
        about = f"{self._extent()}, {len(self)} samples"
        return (
            f"<table><caption>Recording: {about}</caption><thead><tr>{heads}</tr></thead>"
            f"<tbody>{''.join(rows)}</tbody></table>{''.join(f'<p>{html.escape(str(one))}</p>' for one in self.doubts)}"
        )

    def _extent(self) -> str:
        """Duration and sample time, for people."""
        usual, _worst, even = self._steps()
        return f"{self.time[-1] - self.time[0]:g} s at {usual * 1e3:.4g} ms{'' if even else ', unevenly'}"

    def _steps(self) -> tuple[float, int, bool]:
        """The usual step (s), the place of the one that differs most from it, and whether all are alike."""
        steps = np.diff(self.time)
        usual = float(np.median(steps))
        worst = int(np.argmax(np.abs(steps - usual)))
        return usual, worst, bool(abs(steps[worst] - usual) <= UNEVEN * usual + 1e-9)

    @property
    def sample_time(self) -> float:
        """Sample time, s.

        Raises
        ------
        RecordingError
            If the samples are not evenly spaced.
        """
        usual, worst, even = self._steps()
        if not even:
            raise RecordingError(
                f"The samples are not evenly spaced: after t = {self.time[worst]:.6g} s comes "
                f"{self.time[worst + 1]:.6g} s, where steps of {usual:.6g} s are usual. Call "
                f"recording.resampled({usual:.3g}) first."
            )
        return float((self.time[-1] - self.time[0]) / (self.time.size - 1))

    @cached_property
    def doubts(self) -> tuple[Doubt, ...]:
        """Reasons why the recording may not be relied on, see :mod:`rotflex.doubts`; empty where there is none."""
        signals = {name: channel.values for name, channel in self.channels.items()}
        return tuple(of_recording(self.time, signals, self.metadata))

    def resampled(self, sample_time: float) -> Recording:
        """Return the recording with evenly spaced samples, each on the line between its neighbours.

        The metadata say it, under ``resampled``. No filter is applied: what is faster than half the new rate folds.

        Parameters
        ----------
        sample_time : s

        Raises
        ------
        RecordingError
            If two samples are more than two usual steps apart, for nobody knows what was between them; or if the
            recording is not longer than ``sample_time``.
        ConfigurationError
            If ``sample_time`` is not positive.
        """
        positive("sample_time", sample_time, "s")
        usual, worst, _even = self._steps()
        before, after = self.time[worst : worst + 2].tolist()
        if after - before > _WIDEST_GAP * usual * (1 + 1e-6):
            raise RecordingError(
                f"Nothing is known between t = {before:.6g} s and {after:.6g} s, more than two steps of {usual:.3g} s "
                "apart. Take a part without the gap, by recording.between(start, stop)."
            )
        time = np.arange(int((self.time[-1] - self.time[0]) / sample_time + 1e-6) + 1, dtype=np.float64) * sample_time
        channels = {
            name: Channel(np.interp(self.time[0] + time, self.time, channel.values), channel.unit)
            for name, channel in self.channels.items()
        }
        about = {"resampled": {"method": "linear", "from": usual}, "sample_time": sample_time}
        return Recording(time, channels, {**unanswered.resampled(self.metadata, time.size / len(self)), **about})

    def degrees(self, name: str) -> Vector:
        """Samples (n,) of an angle, in degrees, for plots and tables."""
        values = self[name]
        if self.channels[name].unit != "rad":
            raise RecordingError(f"Channel {name!r} is in {self.channels[name].unit}; only angles can be in degrees.")
        return values / DEG

    def between(self, start: float, stop: float) -> Recording:
        """The part with start <= t < stop (s), its time counted from its own beginning."""
        rounding = 1e-6 * self._steps()[0]  # 7 * 0.1 is a little more than 0.7
        inside = (self.time >= start - rounding) & (self.time < stop - rounding)
        if inside.sum() < 2:
            raise RecordingError(f"There is nothing between {start:g} s and {stop:g} s in {self!r}.")
        time = self.time[inside]
        parts = {name: Channel(channel.values[inside], channel.unit) for name, channel in self.channels.items()}
        first = int(np.argmax(inside))
        return Recording(time - time[0], parts, unanswered.cut(self.metadata, first, time.size))

    def with_channels(self, **channels: Any) -> Recording:
        """Return this recording with further channels, or others in the place of its own; see :meth:`of`."""
        return replace(self, channels={**self.channels, **Recording.of(self.time, **channels).channels})

    def to_response(self) -> TimeResponseData:
        """Convert to a time response of python-control, SI units, with signals by their names.

        Its inputs are what acted (theta_ref, vm, tau_link), and its outputs all other channels.

        Raises
        ------
        RecordingError
            If there is no channel for an output.
        """
        import control

        inputs = [name for name in self.channels if name in _ACTING]
        outputs = [name for name in self.channels if name not in _ACTING]
        if not outputs:
            raise RecordingError(f"A response needs an output beside {', '.join(inputs)}, such as theta.")
        u, y = (np.array([self[name] for name in names]) for names in (inputs, outputs))
        named = {"output_labels": outputs, "input_labels": inputs or None, "plot_inputs": bool(inputs)}
        return control.TimeResponseData(self.time, y, inputs=u if inputs else None, issiso=False, **named)

    def to_pandas(self) -> DataFrame:
        """Convert to a table of pandas: a row for each time (s), a column for each channel, SI units.

        Raises
        ------
        RecordingError
            If pandas is not installed.
        """
        try:
            import pandas
        except ImportError:
            raise RecordingError("pandas is not installed: pip install pandas.") from None
        columns = {name: channel.values for name, channel in self.channels.items()}
        return pandas.DataFrame(columns, index=pandas.Index(self.time, name="time"))

    def save(self, path: str | os.PathLike[str], variables: Iterable[str] | None = None) -> Path:
        """Save to ``.mat`` (version 5, for MATLAB and Octave) or ``.csv``, by the name's ending.

        The file is written under a temporary name and renamed, so that a crash leaves no half of one.

        Parameters
        ----------
        path : where to
        variables : for ``.mat``, which of ``data_theta``, ``data_alpha``, ``data_vm`` and ``rotflex_other`` (time, and
            every channel that has no place in the others) to write; all by default

        Raises
        ------
        RecordingError
            If the file cannot be written, or would not hold the whole recording as it is.
        """
        target = Path(path)
        write = {".mat": self._write_mat, ".csv": self._write_csv}[saved_ending(target)]
        try:
            files.write(target, lambda scratch: write(scratch, variables))
        except OSError as error:
            raise RecordingError(f"{target} cannot be written: {error.strerror or error}.") from None
        return target

    @classmethod
    def load(cls, *paths: str | os.PathLike[str], columns: str | Sequence[str] = ()) -> Recording:
        """Load a recording from one text or ``.mat`` file, or from several ``.mat`` files of one experiment.

        A log of the real bench loads as it is. Arrays are read as the module's docstring says; a three-column
        ``data_theta`` beside a three-column ``data_alpha`` is a validation, whose second columns are the model's.

        Parameters
        ----------
        paths : ``.mat``; any other is a table of text with headings, such as ``theta_deg`` or ``theta (deg)``
        columns : what the columns of one file are, with their units, where its headings do not say it. Those of
            interest, by number or name, ``"t_ms=1,theta_deg=pot"``; or all in order, ``"t_s,theta_deg,-,vm_V"``, with
            ``-`` for what is of no interest

        Raises
        ------
        UnknownColumns
            If a file does not say what its columns are; the message has a guess.
        RecordingError
            If a file cannot be read, or if files do not belong together.
        """
        if not paths:
            raise RecordingError("Name at least one file to load.")
        names = columns.split(",") if isinstance(columns, str) and columns else list(columns)
        if names and len(paths) > 1:
            raise RecordingError("columns= names those of one file: load one file at a time.")
        if names or (len(paths) == 1 and Path(paths[0]).suffix.casefold() != recording_files.MAT):
            return _read_table(Path(paths[0]), names)
        arrays: dict[str, Vector] = {}
        metadata: dict[str, Any] = {}
        for path in map(Path, paths):
            found, described = recording_files.arrays(path)
            if not found and len(paths) == 1:
                return _read_table(path, names)
            differing = [name for name in found if name in arrays and not np.array_equal(found[name], arrays[name])]
            known = {key: metadata[key] for key in ("bench", "experiment") if key in metadata}
            differing += [key for key, value in known.items() if described.get(key, value) != value]
            if differing:
                raise RecordingError(f"{path.name} is of another experiment than the files before: see {differing[0]}.")
            arrays |= found
            metadata |= described
        source = ", ".join(Path(path).name for path in paths)
        try:
            return cls._from_arrays(arrays, {"source": source, **metadata})
        except RecordingError as error:
            raise RecordingError(f"{source}: {error}") from None

    # --- the files' layout ---------------------------------------------------------------------------------------

    def _arrays(self) -> tuple[dict[str, Vector], list[str]]:
        """The channels as the laboratory's arrays, in degrees and volts, and names of those without a usual place."""
        arrays = {}
        second = {"theta": "theta_model" if "theta_model" in self else "theta_ref", "alpha": "alpha_model"}
        for angle in ("theta", "alpha"):
            if angle in self:
                columns = [self.time, self.degrees(angle)]
                if second[angle] in self:
                    columns.insert(1, self.degrees(second[angle]))
                arrays[f"data_{angle}"] = np.column_stack(columns)
        if "vm" in self:
            arrays["data_vm"] = np.column_stack([self.time, self["vm"]])
        placed = self._placed(arrays)
        if placed - set(self.channels):  # a command that would be taken for a model's angle, or the other way round
            arrays["data_theta"] = arrays["data_theta"][:, ::2]
            placed = self._placed(arrays)
        other = [name for name in self.channels if name not in placed]
        if other:
            arrays[recording_files.OTHER] = np.column_stack([self.time, *(self[name] for name in other)])
        return arrays, other

    def _placed(self, arrays: Mapping[str, Vector]) -> set[str]:
        """Names of the channels that some of the laboratory's arrays hold."""
        return set(self._from_arrays(arrays, self.metadata).channels) if arrays else set()

    @classmethod
    def _from_arrays(cls, arrays: Mapping[str, Vector], metadata: Mapping[str, Any]) -> Recording:
        time = next(iter(arrays.values()))[:, 0]
        metadata = dict(metadata)
        other = _take_other(metadata)
        channels: dict[str, Channel] = {}
        validation = all(name in arrays and arrays[name].shape[1] == 3 for name in ("data_theta", "data_alpha"))
        validation = validation or metadata.get("experiment") == "validation"
        for name, array in arrays.items():
            if array.shape[0] != time.size or (np.abs(array[:, 0] - time) > 1e-6).any():
                raise RecordingError(f"{name} has another time axis than {next(iter(arrays))}.")
            if name == "data_vm":
                channels["vm"] = Channel(array[:, 1], "V")
            elif name in ("data_theta", "data_alpha"):
                angle = name.removeprefix("data_")
                channels[angle] = Channel(array[:, -1] * DEG, "rad")
                if array.shape[1] == 3:
                    second = f"{angle}_model" if validation or angle == "alpha" else "theta_ref"
                    channels[second] = Channel(array[:, 1] * DEG, "rad")
            elif name == recording_files.OTHER:
                if len(other) != array.shape[1] - 1:
                    raise RecordingError(f"{name} has {array.shape[1] - 1} channels, and its description {len(other)}.")
                channels |= {one: Channel(array[:, n], unit) for n, (one, unit) in enumerate(other.items(), 1)}
        return cls(time - time[:1], channels, metadata)

    def _write_mat(self, path: Path, variables: Iterable[str] | None) -> None:
        from scipy.io import savemat

        arrays, other = self._arrays()
        wanted = list(arrays) if variables is None else list(variables)
        missing = [name for name in wanted if name not in arrays]
        if missing:
            raise RecordingError(f"This recording cannot give {missing[0]}; it can give {', '.join(arrays)}.")
        content: dict[str, Any] = {name: arrays[name] for name in wanted}
        content[recording_files.METADATA] = self._description(other if recording_files.OTHER in wanted else ())
        savemat(str(path), content, appendmat=False, format="5", do_compression=True)

    def _write_csv(self, path: Path, variables: Iterable[str] | None) -> None:
        if variables is not None:
            raise RecordingError("A .csv file holds all channels; choose variables only with .mat.")
        other = set(self.channels) - set(UNITS)
        with path.open("w", newline="", encoding="utf-8") as file:
            file.write(f"# {self._description(other)}\n")
            writer = csv.writer(file, lineterminator="\n")
            header, columns = ["t_s"], [self.time]
            for name, channel in self.channels.items():
                in_degrees = channel.unit == "rad" and name in UNITS
                header.append(f"{name}_deg" if in_degrees else f"{name}_{channel.unit}")
                columns.append(self.degrees(name) if in_degrees else channel.values)
            if any(sign in "".join(header) for sign in ";\t\n"):
                raise RecordingError(f"A .csv file cannot have a channel or unit with ; or a tab in it: {header}.")
            writer.writerow(header)
            writer.writerows([f"{value:.10g}" for value in row] for row in zip(*columns, strict=True))

    def _description(self, other: Collection[str]) -> str:
        """The metadata as JSON text, with the units of the channels that the file has no usual place for."""
        units = {name: channel.unit for name, channel in self.channels.items() if name in other}
        try:
            about = {**self.metadata, _OTHER: list(units.items())} if units else self.metadata  # a list keeps its order
            return json.dumps(about, sort_keys=True)
        except (TypeError, ValueError, RecursionError) as error:
            raise RecordingError(f"The metadata must be plain data, as JSON can hold: {error}.") from None


def saved_ending(path: Path) -> str:
    """The ending of a file as which a recording can be saved.

    Raises
    ------
    RecordingError
        If it is another one.
    """
    ending = path.suffix.lower()
    if ending not in (".mat", ".csv"):
        raise RecordingError(f"{path.name}: a recording is saved as .mat or .csv.")
    return ending


def _read_only(what: str, values: Any) -> Vector:
    vector = finite_vector(f"The {what}", values, RecordingError)
    vector.setflags(write=False)
    return vector


def _take_other(metadata: dict[str, Any]) -> dict[str, str]:
    """Take out of a file's description the names and units of what it has no usual place for."""
    try:
        other = dict(metadata.pop(_OTHER, ()))
    except (TypeError, ValueError):
        other = {0: 0}
    if not all(isinstance(text, str) for pair in other.items() for text in pair):
        raise RecordingError(f"{_OTHER} in a description should be a list of names with their units.")
    return other


def _read_table(path: Path, columns: Sequence[str]) -> Recording:
    """Read a table. Columns that the metadata give a unit are further channels. Time begins at 0."""
    table = recording_files.table(path)
    further = {f"{name}_{unit}": (name, unit) for name, unit in _take_other(table.metadata).items()}
    other = [] if columns else [n for n, heading in enumerate(table.headings) if n and heading in further]
    usual = [f"{heading}={n + 1}" for n, heading in enumerate(table.headings) if n not in other]
    time, found = recording_files.signals(path.name, table, usual if other else columns, UNITS)
    try:
        channels = {name: Channel(values, UNITS[name]) for name, values in found.items()}
        for n in other:
            name, unit = further[table.headings[n]]
            channels[name] = Channel(table.columns[n], unit)
        return Recording(time - time[:1], channels, {"source": path.name, **table.metadata})
    except RecordingError as error:
        raise RecordingError(f"{path.name}: {error}") from None
