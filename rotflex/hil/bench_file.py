"""Benches as files: a laboratory's ``bench.toml``, and ``twin.toml``, a plant that was fitted to recordings.

A ``bench.toml`` has the board and its parts, how it is wired, and its commissioning. ``docs/real_bench.md`` has an
example with comments. What is left out is as on the bench of the workbook.
"""

from __future__ import annotations

import dataclasses
import json
import math
import tomllib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from rotflex import files
from rotflex.config import AMPLIFIERS, CABLE_GAINS, DAC_LIMIT, ENCODERS, Servo, check_mounted, joint, srv02
from rotflex.errors import ConfigurationError
from rotflex.hil import drivers, real
from rotflex.hil.bench import Connection, Limits, Wiring
from rotflex.hil.board import Board, Clock, EncoderQuadratureMode
from rotflex.hil.real import DEFAULT_LIMITS, WORKBOOKS_STIFFNESS, BoardKind, Key, Setup, choice
from rotflex.hil.student_benches import VirtualPlantSpec
from rotflex.hil.virtual import Timing
from rotflex.plant import PlantParameters
from rotflex.units import DEG

LONGEST_NAME = 60  #: characters of a bench's name
_NONE = -1  # of a channel that a bench does not have


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


def _number(default: float, lowest: float, highest: float) -> Key:
    allowed = f"a number above {lowest:g}, at most {highest:g}"
    return Key(default, lambda value: _is_number(value) and lowest < value <= highest, allowed)


def _channel(default: int, lowest: int = 0) -> Key:
    allowed = "the number of a channel, " + ("from 0 on" if lowest == 0 else "or -1 for none")
    return Key(default, lambda value: type(value) is int and lowest <= value < 2**31, allowed)


_FILTER = Key(0, lambda value: _is_number(value) and value >= 0, "a frequency in Hz, or 0 for the board's own")
_FEW_DEG = 5  # deg; with less nothing can be done, and it was meant in radians
#: What any board's file may say; some entries are others for a kind of board (``BoardKind.keys``).
TABLES: dict[str, dict[str, Key]] = {
    "parts": {
        "gear": choice("high", "high", why="The flexible joint is mounted on a servo in high gear."),
        "load": choice("none", "none", why="The flexible joint is mounted on a servo without a load."),
        "encoder": choice("E", *ENCODERS),
        "tachometer": choice(True, True, False),
        "amplifier": choice("VoltPAQ-X1", *AMPLIFIERS),
        "cable_gain": choice(1, *CABLE_GAINS),
        "arm_position": choice(1, 1, 2, 3),
    },
    "wiring": {
        "motor": _channel(0),
        "servo_encoder": _channel(0),
        "link_encoder": _channel(1),
        "loopback_output": _channel(_NONE, _NONE),
        "loopback_input": _channel(_NONE, _NONE),
        "motor_sign": choice(1, 1, -1),
        "servo_sign": choice(1, 1, -1),
        "link_sign": choice(-1, 1, -1),
    },
    "board": {
        "options": Key("", lambda value: isinstance(value, str), "text, as the maker documents it"),
        "filter": _FILTER,
        "output_range": _number(DAC_LIMIT, 0, DAC_LIMIT),
        "input_range": _number(DAC_LIMIT, 0, DAC_LIMIT),
        "clock": choice(0, *map(int, Clock)),
    },
    "limits": {
        "voltage": _number(DEFAULT_LIMITS.voltage, 0, 24),
        "theta": _number(round(DEFAULT_LIMITS.theta / DEG, 6), _FEW_DEG, 360),
        "alpha": _number(round(DEFAULT_LIMITS.alpha / DEG, 6), _FEW_DEG / 2, 90),
        "rate": _number(DEFAULT_LIMITS.rate, 0, 100),
        "duration": _number(DEFAULT_LIMITS.duration, 0, 3600),
    },
}
_CHANNELS = {"motor": "analog_outputs", "servo_encoder": "encoders", "link_encoder": "encoders"}
_CHANNELS |= {"loopback_output": "analog_outputs", "loopback_input": "analog_inputs"}


@dataclass(frozen=True)
class BenchFile:
    """What a ``bench.toml`` says.

    Attributes
    ----------
    address : of the board, as ``quanser:q2_usb/0``
    name : of the bench, as the course's settings have it; each recording carries it. The file's own unless given
    parts : the servo's and the joint's, as :func:`rotflex.config.srv02` and :func:`rotflex.config.joint` take them
    wiring : channels and signs by name
    board : how the board is set up: options, ranges (V), filter (Hz), clock
    limits : V, deg, rad/s, s
    record : of the commissioning; empty if there was none

    Raises
    ------
    ConfigurationError
        If there is an entry that no such bench has; all are listed.
    """

    address: str
    parts: Mapping[str, Any] = field(default_factory=dict)
    wiring: Mapping[str, Any] = field(default_factory=dict)
    board: Mapping[str, Any] = field(default_factory=dict)
    limits: Mapping[str, Any] = field(default_factory=dict)
    record: Mapping[str, Any] = field(default_factory=dict)
    name: str = ""

    def __post_init__(self) -> None:
        for name, allowed in self.tables().items():
            given = dict(getattr(self, name))
            object.__setattr__(self, name, {key: entry.default for key, entry in allowed.items()} | given)
        if faults := [*self._unfit()] or [*self._contradictions()]:
            raise ConfigurationError("\n  ".join(faults))

    @property
    def kind(self) -> BoardKind | None:
        """The kind of board; None if it is not among those that are known, or no driver for it is installed."""
        driver = drivers.find(self.address) if isinstance(self.address, str) else None
        return None if driver is None else driver.kind(self.address)

    def tables(self) -> dict[str, dict[str, Key]]:
        """Return what the file may say: table → name → entry, with what is different for its kind of board."""
        own = {} if self.kind is None else self.kind.keys
        return {name: {**entries, **own.get(name, {})} for name, entries in TABLES.items()}

    @property
    def loopback(self) -> tuple[int, int] | None:
        """The analog output and input that a cable may join; None where none are named."""
        joined = int(self.wiring["loopback_output"]), int(self.wiring["loopback_input"])
        return None if _NONE in joined else joined

    def identity(self) -> dict[str, Any]:
        """Return what a commissioning is of: whatever of this changes, it is to be done again."""
        return {"address": self.address, **self.parts, **self.wiring, **self.board}

    def with_signs(self, **signs: int) -> BenchFile:
        """Return the same bench, wired otherwise."""
        return replace(self, wiring={**self.wiring, **signs})

    def setup(self) -> Setup:
        """Return parts, limits (rad, V), wiring and commissioning state of the bench, for :func:`rotflex.hil.open`."""
        parts = dict(self.parts)
        arm = joint(parts.pop("arm_position"))
        limits = dict(self.limits) | {name: self.limits[name] * DEG for name in ("theta", "alpha")}
        limits["voltage"] = min(limits["voltage"], self.board["output_range"] * self.parts["cable_gain"])
        opened: list[Connection] = []  # `_prepare` adds the one that is open
        return Setup(
            servo=check_mounted(srv02(**parts)),
            joint=arm,
            limits=Limits(**limits),
            wiring=Wiring(**{name: value for name, value in self.wiring.items() if not name.startswith("loopback")}),
            stiffness=real.stiffness(self.record) or WORKBOOKS_STIFFNESS,
            commissioned=partial(self._why_not, opened),
            prepare=partial(self._prepare, opened),
            clock=int(self.board["clock"]),
            marked=bool(self.record),
        )

    def _why_not(self, opened: list[Connection]) -> str | None:
        """Return why no loop is closed on this bench; None if one may be."""
        serial = "".join(serial_number(one.board) for one in opened if one.is_open)
        return real.why_not(self.record, self.identity(), serial, [verb for one in opened for verb in one.refused])

    def _prepare(self, opened: list[Connection], connection: Connection) -> None:
        """Set up the board of a bench that was just opened.

        One that is known to take ranges and quadrature is always told them, another one what is not as usual.
        """
        board, values, wired = connection.board, self.board, self.wiring
        opened[:] = [connection]
        always = self.kind is not None and self.kind.always_set
        if values["options"]:
            board.set_card_specific_options(values["options"], len(values["options"].encode()))
        encoders = np.array([wired["servo_encoder"], wired["link_encoder"]], dtype=np.uint32)
        if always:
            modes = np.full(2, EncoderQuadratureMode.X4, dtype=np.uint32)
            connection.ask("set_encoder_quadrature_mode", encoders, 2, modes)
        if always or values["output_range"] != DAC_LIMIT:
            _set_range(board.set_analog_output_ranges, wired["motor"], values["output_range"])
        if self.loopback is not None and (always or values["input_range"] != DAC_LIMIT):
            _set_range(board.set_analog_input_ranges, self.loopback[1], values["input_range"])
        if values["filter"]:
            connection.ask("set_encoder_filter_frequency", encoders, 2, np.full(2, float(values["filter"])))

    def _unfit(self) -> Iterator[str]:
        """Yield what no bench has."""
        if not isinstance(self.address, str) or ":" not in self.address or self.address.endswith(".toml"):
            yield _misfit("address", self.address, "that of a board, as in 'quanser:q2_usb/0'")
        for name, allowed in self.tables().items():
            for key, value in getattr(self, name).items():
                if key not in allowed:
                    yield f"There is no {key} in [{name}]; there are {', '.join(allowed)}. Correct or delete the line."
                elif not allowed[key].fits(value):
                    yield _misfit(f"[{name}] {key}", value, allowed[key].allowed, allowed[key].why)

    def _contradictions(self) -> Iterator[str]:
        """Yield what does not go together, or the board does not have, where each entry by itself can be."""
        wired, kind = self.wiring, self.kind
        if wired["servo_encoder"] == wired["link_encoder"]:
            yield (
                f"[wiring] servo_encoder and link_encoder are both {wired['link_encoder']}: "
                "each has a channel of its own."
            )
        if wired["loopback_output"] == wired["motor"]:
            yield f"[wiring] loopback_output is the motor's, {wired['motor']}: choose another output."
        if kind is None:
            return
        for key, channels in _CHANNELS.items():
            many = getattr(kind, channels)
            if many is not None and wired[key] >= many:
                yield _misfit(f"[wiring] {key}", wired[key], f"on a {kind.title} from 0 to {many - 1}")
        for key, ranges in (("output_range", kind.output_ranges), ("input_range", kind.input_ranges)):
            if ranges is not None and self.board[key] not in ranges:
                listed = ", ".join(f"{reach:g}" for reach in ranges)
                yield _misfit(f"[board] {key}", self.board[key], f"on a {kind.title} {listed} V")


def serial_number(board: Board) -> str:
    """Return a board's serial number; empty where it has none."""
    return str(getattr(board, "serial_number", str)())


def _set_range(verb: Callable[..., None], channel: int, reach: float) -> None:
    verb(np.array([channel], dtype=np.uint32), 1, np.array([-float(reach)]), np.array([float(reach)]))


def _misfit(where: str, value: Any, allowed: str, why: str = "") -> str:
    return f"{where} is {value!r}; it must be {allowed}. {why}".rstrip()


def load(path: str | Path) -> BenchFile:
    """Read a ``bench.toml``.

    Raises
    ------
    ConfigurationError
        If it is not there, is no TOML, or has entries that cannot be; the message says where and what to do.
    """
    if not Path(path).exists():
        raise ConfigurationError(f"There is no {path}. `rotflex bench setup` writes one.")
    read = _read(path)
    if "plant" in read:
        raise ConfigurationError(f"{path} is a fitted plant: open it as virtual:{path}.")
    known = ("name", "address", *TABLES, "commissioned")
    faults = [f"there is no {name}; there are {', '.join(known)}." for name in read if name not in known]
    faults += [f"{name} is a table: write [{name}]." for name in known[2:] if not isinstance(read.get(name, {}), dict)]
    name = read.get("name")
    if not (isinstance(name, str) and name.strip() == name != "" and name.isprintable() and len(name) <= LONGEST_NAME):
        faults.append(
            'the bench has no name: write name = "north" above address = …, the name that everybody knows it by, of at '
            f"most {LONGEST_NAME} characters. Each recording carries it."
        )
    if faults:
        raise ConfigurationError(f"{path}: " + "\n  ".join(faults))
    tables = {table: read.get(table, {}) for table in TABLES}
    try:
        return BenchFile(read.get("address", ""), name=read["name"], record=read.get("commissioned", {}), **tables)
    except ConfigurationError as error:
        raise ConfigurationError(f"{path}: {error}") from None


def save(path: str | Path, bench: BenchFile) -> None:
    """Write a ``bench.toml``, whole or not at all. A bench without a name gets that of the file, without its ending.

    Raises
    ------
    OSError
        If it cannot be written.
    """
    lines = ["# A bench, as `rotflex bench setup` found it. What each entry means: docs/real_bench.md."]
    lines.append(f"name = {_toml(bench.name or Path(path).stem)}")
    lines.append(f"address = {_toml(bench.address)}")
    for name in TABLES:
        lines += _table(name, getattr(bench, name))
    if bench.record:
        lines += _table("commissioned", {k: v for k, v in bench.record.items() if not isinstance(v, Mapping)})
        for key, value in bench.record.items():
            if isinstance(value, Mapping):
                lines += _table(f"commissioned.{key}", value)
    files.write(path, "\n".join(lines) + "\n")


# --- a fitted plant ---------------------------------------------------------------------------------------------------

_OF_DRAWN_BENCHES = {"stribeck", "load", "gear"}  # which no fit finds
_NAMES = tuple(entry.name for entry in dataclasses.fields(PlantParameters) if entry.name not in _OF_DRAWN_BENCHES)
_PARTS = ("encoder", "amplifier", "cable_gain", "tachometer")


@dataclass(frozen=True)
class Twin:
    """A fitted plant, the servo that its bench is said to have, and the name of the bench that it stands in for."""

    spec: VirtualPlantSpec
    servo: Servo
    name: str = ""


def servo_parts(servo: Servo) -> dict[str, Any]:
    """Return what :func:`rotflex.config.srv02` takes to make this servo again, plain values."""
    return {name: getattr(servo, name) for name in _PARTS} | {"amplifier": servo.amplifier.name}


def save_twin(path: str | Path, twin: Twin, about: Mapping[str, Any]) -> None:
    """Write a ``twin.toml``.

    Parameters
    ----------
    path : the file
    twin : what is written
    about : plain values that say where it comes from

    Raises
    ------
    OSError
        If it cannot be written.
    """
    spec, servo = twin.spec, twin.servo
    lines = [f"# A plant fitted to recordings: open it as virtual:{Path(path).name}."]
    lines += _table("about", about)
    lines += _table("parts", {**servo_parts(servo), "arm_position": spec.joint.arm_position})
    lines += _table("plant", {name: getattr(spec.parameters, name) for name in _NAMES} | {"delay": spec.timing.delay})
    files.write(path, "\n".join(lines) + "\n")


def load_twin(path: str | Path) -> Twin:
    """Read a ``twin.toml``.

    Raises
    ------
    ConfigurationError
        If it is not there, is no TOML, or lacks what a plant is made of, or has what cannot be.
    """
    read = _read(path)
    plant, parts = read.get("plant"), read.get("parts")
    if not isinstance(plant, dict) or not isinstance(parts, dict) or {*plant} != {*_NAMES, "delay"}:
        raise ConfigurationError(
            f"{path} is no fitted plant: it needs [parts], and [plant] with {', '.join(_NAMES)}, delay. `rotflex "
            "bench fit` writes one."
        )
    try:
        values: dict[str, Any] = {
            name: tuple(plant[name]) if name.endswith("_friction") else float(plant[name]) for name in _NAMES
        }
        arm = joint(parts.get("arm_position", 1))
        servo = srv02(**{name: parts[name] for name in _PARTS if name in parts})
        spec = VirtualPlantSpec(arm, PlantParameters(**values), Timing(delay=float(plant["delay"])))
    except (TypeError, ValueError) as error:
        raise ConfigurationError(f"{path}: {error}") from None
    return Twin(spec, servo, str(read.get("name", "")))


# --- TOML -------------------------------------------------------------------------------------------------------------


def _read(path: str | Path) -> dict[str, Any]:
    try:
        return tomllib.loads(Path(path).read_text(encoding="utf-8-sig"))
    except (OSError, ValueError) as error:
        raise ConfigurationError(f"{path} cannot be read: {error}.") from None


def _table(name: str, values: Mapping[str, Any]) -> list[str]:
    """Return the lines of a table of plain values."""
    return ["", f"[{name}]", *(f"{key} = {_toml(value)}" for key, value in values.items())]


def _toml(value: Any) -> str:
    """Return a plain value as TOML has it: as JSON does, but for one character."""
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
