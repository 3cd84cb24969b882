"""A laboratory's bench as a file, ``bench.toml``: its board and parts, how it is wired, and its commissioning.

``docs/real_bench.md`` has an example with comments. What is left out is as on the bench of the workbook.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from rotflex import files
from rotflex.config import AMPLIFIERS, CABLE_GAINS, DAC_LIMIT, ENCODERS, check_mounted, joint, srv02
from rotflex.errors import ConfigurationError
from rotflex.hil import commissioned, drivers
from rotflex.hil.bench import Bench
from rotflex.hil.board import Board, Clock
from rotflex.hil.kinds import BoardKind, Key, choice
from rotflex.hil.parts import Limits, Wiring
from rotflex.hil.real import LIMITS, WORKBOOKS_STIFFNESS, Setup
from rotflex.units import DEG

_SIGNS = ("motor_sign", "servo_sign", "link_sign")
_CHANNELS = {"motor": "analog_outputs", "servo_encoder": "encoders", "link_encoder": "encoders"}
_CHANNELS |= {"potentiometer": "analog_inputs", "loopback_output": "analog_outputs", "loopback_input": "analog_inputs"}
LONGEST_NAME = 60  #: characters of a bench's name
_NONE = -1  # of a channel that a bench does not have


@dataclass(frozen=True)
class BenchFile:
    """What a ``bench.toml`` says.

    Attributes
    ----------
    address : of the board, as ``quanser:q2_usb/0``
    name : of the bench, as the course's settings have it; each recording carries it. The file's own unless given
    parts : the servo's and the joint's, as :func:`rotflex.config.srv02` and :func:`rotflex.config.joint` take them
    wiring : channels and signs by name
    board : how the board is set up: options, ranges (V), quadrature, filter (Hz), clock
    limits : V, deg, rad/s, s
    record : of the commissioning; empty if there was none
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
            object.__setattr__(self, name, {key: one.default for key, one in allowed.items()} | given)
        _check(self)

    @property
    def kind(self) -> BoardKind | None:
        """The kind of board; None if it is not among those that are known, or no driver for it is installed."""
        driver = drivers.find(self.address) if isinstance(self.address, str) else None
        return None if driver is None else driver.kind(self.address)

    def tables(self) -> dict[str, dict[str, Key]]:
        """Return what the file may say: table → name → entry, with what is different for its kind of board."""
        kind = self.kind
        own = {} if kind is None else kind.keys
        return {name: {**entries, **own.get(name, {})} for name, entries in TABLES.items()}

    @property
    def potentiometer(self) -> int | None:
        """The analog input that the potentiometer is on; None where there is none."""
        channel = int(self.wiring["potentiometer"])
        return None if channel == _NONE else channel

    @property
    def loopback(self) -> tuple[int, int] | None:
        """The analog output and input that a cable may join; None where it is not said."""
        joined = int(self.wiring["loopback_output"]), int(self.wiring["loopback_input"])
        return None if _NONE in joined else joined

    def identity(self) -> dict[str, Any]:
        """What a commissioning is of: whatever of this changes, it is to be done again."""
        return {"address": self.address, **self.parts, **self.wiring, **self.board}

    def setup(self) -> Setup:
        """What is known of the bench, for :func:`rotflex.hil.open`."""
        parts = dict(self.parts)
        arm = joint(parts.pop("arm_position"))
        wired = Wiring(**{name: self.wiring[name] for name in ("motor", "servo_encoder", "link_encoder", *_SIGNS)})
        bound = dict(self.limits) | {name: self.limits[name] * DEG for name in ("theta", "alpha")}
        serial: list[str] = []  # number of the board, once it was opened
        bound["voltage"] = min(bound["voltage"], self.board["output_range"] * self.parts["cable_gain"])
        return Setup(
            servo=check_mounted(srv02(**parts)),
            joint=arm,
            limits=Limits(**bound),
            wiring=wired,
            stiffness=commissioned.stiffness(self.record) or WORKBOOKS_STIFFNESS,
            commissioned=lambda: commissioned.why_not(self.record, self.identity(), "".join(serial)),
            prepare=partial(self._prepare, serial),
            clock=int(self.board["clock"]),
            marked=bool(self.record),
        )

    def with_signs(self, **signs: int) -> BenchFile:
        """The same bench, wired otherwise."""
        return replace(self, wiring={**self.wiring, **signs})

    def _is_to_be_set(self, key: str) -> bool:
        """Whether a board is told this: one that is known to take it always, another if it is not as usual."""
        kind = self.kind
        return (kind is not None and kind.always_set) or bool(self.board[key] != TABLES["board"][key].default)

    def _prepare(self, serial: list[str], bench: Bench) -> None:
        """Set up the board of a bench that was just opened."""
        board, told, wired = bench.board, self.board, self.wiring
        serial[:] = [serial_number(board)]
        if told["options"]:
            board.set_card_specific_options(told["options"], len(told["options"].encode()))
        encoders = np.array([wired["servo_encoder"], wired["link_encoder"]], dtype=np.uint32)
        if self._is_to_be_set("quadrature"):
            bench.ask("set_encoder_quadrature_mode", encoders, 2, np.full(2, told["quadrature"], dtype=np.uint32))
        if self._is_to_be_set("output_range"):
            _set_range(board.set_analog_output_ranges, wired["motor"], told["output_range"])
        for channel in (self.potentiometer, None if self.loopback is None else self.loopback[1]):
            if channel is not None and self._is_to_be_set("input_range"):
                _set_range(board.set_analog_input_ranges, channel, told["input_range"])
        if told["filter"]:
            bench.ask("set_encoder_filter_frequency", encoders, 2, np.full(2, float(told["filter"])))


def serial_number(board: Board) -> str:
    """A board's serial number; empty where it does not tell it."""
    return str(getattr(board, "serial_number", str)())


def _set_range(verb: Callable[..., None], channel: int, reach: float) -> None:
    verb(np.array([channel], dtype=np.uint32), 1, np.array([-float(reach)]), np.array([float(reach)]))


# --- what may stand in it --------------------------------------------------------------------------------------------


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


def _number(default: float, lowest: float, highest: float) -> Key:
    said = f"a number above {lowest:g}, at most {highest:g}"
    return Key(default, lambda value: _is_number(value) and lowest < value <= highest, said)


def _channel(default: int, lowest: int = 0) -> Key:
    said = "the number of a channel, from 0 on" if lowest == 0 else "the number of a channel, or -1 for none"
    return Key(default, lambda value: type(value) is int and lowest <= value < 2**31, said)


_FILTER = Key(0, lambda value: _is_number(value) and value >= 0, "a frequency in Hz, or 0 for the board's own")
_FEW_DEG = 5  # deg; with less nothing can be done, and it was meant in radians
_WHY_ENCODER = (
    "The potentiometer has a gap in its track, at which its angle jumps; a loop is closed on the encoder alone. "
    "Name the potentiometer's input as potentiometer=, to have it looked at."
)
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
        "potentiometer": _channel(_NONE, _NONE),
        "loopback_output": _channel(_NONE, _NONE),
        "loopback_input": _channel(_NONE, _NONE),
        "angle": choice("encoder", "encoder", why=_WHY_ENCODER),
        "motor_sign": choice(1, 1, -1),
        "servo_sign": choice(1, 1, -1),
        "link_sign": choice(-1, 1, -1),
    },
    "board": {
        "options": Key("", lambda value: isinstance(value, str), "text, as the maker documents it"),
        "quadrature": choice(4, 4, why="The data sheet's counts per turn are those of all four edges."),
        "filter": _FILTER,
        "output_range": _number(DAC_LIMIT, 0, DAC_LIMIT),
        "input_range": _number(DAC_LIMIT, 0, DAC_LIMIT),
        "clock": choice(0, *(int(one) for one in Clock)),
    },
    "limits": {
        "voltage": _number(LIMITS.voltage, 0, 24),
        "theta": _number(round(LIMITS.theta / DEG, 6), _FEW_DEG, 360),
        "alpha": _number(round(LIMITS.alpha / DEG, 6), _FEW_DEG / 2, 90),
        "rate": _number(LIMITS.rate, 0, 100),
        "duration": _number(LIMITS.duration, 0, 3600),
    },
}


def _check(bench: BenchFile) -> None:
    """Tell all that cannot be, at once."""
    faults = [*_misfits(bench)] or [*_contradictions(bench)]
    if faults:
        raise ConfigurationError("\n  ".join(faults))


def _misfits(bench: BenchFile) -> Iterator[str]:
    """What no bench has."""
    if not isinstance(bench.address, str) or ":" not in bench.address or bench.address.endswith(".toml"):
        yield _misfit("address", bench.address, "that of a board, as in 'quanser:q2_usb/0'")
    for name, allowed in bench.tables().items():
        for key, value in getattr(bench, name).items():
            if key not in allowed:
                known = ", ".join(allowed)
                yield f"There is no {key} in [{name}]; there are {known}."
            elif not allowed[key].fits(value):
                yield _misfit(f"[{name}] {key}", value, allowed[key].allowed, allowed[key].why)


def _contradictions(bench: BenchFile) -> Iterator[str]:
    """What does not go together, where each entry by itself can be."""
    wired = bench.wiring
    if wired["servo_encoder"] == wired["link_encoder"]:
        yield (
            f"[wiring] servo_encoder and link_encoder are both {wired['link_encoder']}: each has a channel of its own."
        )
    if wired["loopback_output"] == wired["motor"]:
        yield f"[wiring] loopback_output is the motor's, {wired['motor']}: choose another output."
    if bench.kind is not None:
        yield from _beyond(bench, bench.kind)


def _beyond(bench: BenchFile, kind: BoardKind) -> Iterator[str]:
    """What the board does not have, so far as that is known of it."""
    for key, channels in _CHANNELS.items():
        many = getattr(kind, channels)
        if many is not None and bench.wiring[key] >= many:
            said = f"on a {kind.title} from 0 to {many - 1}"
            yield _misfit(f"[wiring] {key}", bench.wiring[key], said)
    for key, ranges in (("output_range", kind.output_ranges), ("input_range", kind.input_ranges)):
        if ranges is not None and bench.board[key] not in ranges:
            listed = ", ".join(f"{one:g}" for one in ranges)
            said = f"on a {kind.title} {listed} V"
            yield _misfit(f"[board] {key}", bench.board[key], said)


def _misfit(where: str, value: Any, said: str, why: str = "") -> str:
    told = "{where} is {value!r}; it must be {said}. {why}"
    return told.format(where=where, value=value, said=said, why=why).rstrip()


# --- the file --------------------------------------------------------------------------------------------------------


def load(path: str | Path) -> BenchFile:
    """Read a ``bench.toml``.

    Raises
    ------
    ConfigurationError
        If it is not there, is no TOML, or says what cannot be; the message says where and what to do.
    """
    try:
        told = tomllib.loads(Path(path).read_text(encoding="utf-8-sig"))
    except FileNotFoundError:
        raise ConfigurationError(f"There is no {path}. `rotflex bench setup` writes one.") from None
    except (OSError, ValueError) as error:
        raise ConfigurationError(f"{path} cannot be read: {error}.") from None
    if "plant" in told:
        raise ConfigurationError(f"{path} is a fitted plant: open it as virtual:{path}.")
    known = ("name", "address", *TABLES, "commissioned")
    faults = [f"there is no {name}; there are {', '.join(known)}." for name in told if name not in known]
    faults += [f"{name} is a table: write [{name}]." for name in known[2:] if not isinstance(told.get(name, {}), dict)]
    if not _is_name(told.get("name")):
        faults.append(
            'the bench has no name: write name = "north" above address = …, the name that everybody knows it by, of at '
            f"most {LONGEST_NAME} characters. Each recording carries it."
        )
    if faults:
        raise ConfigurationError("{path}: {error}".format(path=path, error="\n  ".join(faults)))
    try:
        return BenchFile(
            told.get("address", ""),
            name=told["name"],
            **{name: told.get(name, {}) for name in TABLES},
            record=told.get("commissioned", {}),
        )
    except ConfigurationError as error:
        raise ConfigurationError(f"{path}: {error}") from None


def _is_name(value: object) -> bool:
    return (
        isinstance(value, str) and value.strip() == value != "" and value.isprintable() and len(value) <= LONGEST_NAME
    )


def save(path: str | Path, bench: BenchFile) -> None:
    """Write a ``bench.toml``, whole or not at all. A bench without a name gets that of the file, without its ending.

    Raises
    ------
    OSError
        If it cannot be written.
    """
    lines = ["# A bench, as `rotflex bench setup` found it. What each entry means: docs/real_bench.md."]
    lines.append(f"name = {toml_value(bench.name or Path(path).stem)}")
    lines.append(f"address = {toml_value(bench.address)}")
    for name in TABLES:
        lines += toml_table(name, getattr(bench, name))
    if bench.record:
        record = dict(bench.record)
        nested = {key: record.pop(key) for key in list(record) if isinstance(record[key], Mapping)}
        lines += toml_table("commissioned", record)
        for key, value in nested.items():
            lines += toml_table(f"commissioned.{key}", value)
    files.write(path, "\n".join(lines) + "\n")


def toml_table(name: str, values: Mapping[str, Any]) -> list[str]:
    """The lines of a table of plain values."""
    return ["", f"[{name}]", *(f"{key} = {toml_value(value)}" for key, value in values.items())]


def toml_value(value: Any) -> str:
    """A plain value as TOML has it."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        escaped = value.replace("\\", "\\\\").replace('"', '\\"')
        return '"' + "".join(one if one >= " " and one != "\x7f" else f"\\u{ord(one):04x}" for one in escaped) + '"'
    if isinstance(value, list | tuple):
        return "[" + ", ".join(toml_value(one) for one in value) + "]"
    return repr(int(value)) if isinstance(value, int) else repr(float(value))
