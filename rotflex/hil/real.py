"""A bench that can come to harm: what is known of it, its commissioning, and what keeps it from harm.

A laboratory's own wiring and the record of its commissioning come in as a :class:`Setup`. Without a record no loop is
closed: which way a bench is wired is found there, never assumed. The record repeats all that it is of, so that it says
itself what has changed since: another sign, another cable, another board.
"""

from __future__ import annotations

import datetime
import re
from collections.abc import Callable, Collection, Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

from rotflex import files
from rotflex.config import DAC_LIMIT, Joint, Servo, joint, srv02
from rotflex.hil.bench import Bench, Connection, Limits, Mark, Recorder, Safety, Wiring
from rotflex.hil.board import Board, Clock
from rotflex.hil.guard import Allowance, Guard
from rotflex.hil.recorder import recover
from rotflex.units import DEG

VERSION = 1  #: of a record
_STIFFEST = 10.0  # N·m/rad; seven times as stiff as the workbook's
_AGAIN = "No loop is closed on it until it is commissioned again: rotflex bench setup."

#: A servo under 10 V turns at 17 rad/s without a load. No experiment of the course is longer than a minute.
DEFAULT_LIMITS = Limits(rate=25.0, duration=120.0)

#: N·m/rad; for the guard, until it is measured.
WORKBOOKS_STIFFNESS = Allowance().stiffness

#: What a bench may do before it is commissioned, and its watchdog tested: with any sign wrong, whatever drives it.
CAREFUL = Limits(voltage=1.0, theta=40 * DEG, alpha=25 * DEG, rate=8.0, duration=60.0)


def not_commissioned() -> str:
    """Return why no loop is closed on a bench that has no record."""
    return (
        "This bench has not been commissioned as it is wired now, so no loop is closed on it: with one sign "
        "wrong the arm would be half a turn away within 0.3 s. Commission it first, by rotflex bench setup; "
        f"watching it, and driving it with up to {CAREFUL.voltage:g} V by up to {CAREFUL.theta / DEG:.0f} deg, "
        "work without."
    )


def today() -> str:
    """Return the date, for a record."""
    return datetime.datetime.now(datetime.UTC).date().isoformat()


def record(of: Mapping[str, Any], measured: Mapping[str, Any], watchdog: object = None) -> dict[str, Any]:
    """Return a record of today.

    Parameters
    ----------
    of : the board, its parts and its wiring, plain values
    measured : what was found, plain values
    watchdog : the result of its test with the motor
    """
    made = {"version": VERSION, "date": today(), "of": dict(of), "measured": dict(measured)}
    return made if watchdog is None else {**made, "watchdog": watchdog}


def stiffness(record: Mapping[str, Any]) -> float | None:
    """Return the joint's stiffness, N·m/rad, as a record has it; None if it has none."""
    measured = record.get("measured")
    value = measured.get("stiffness") if isinstance(measured, Mapping) else None
    return value if isinstance(value, float) and 0 < value < _STIFFEST else None


def why_not(
    record: Mapping[str, Any], of: Mapping[str, Any], serial: str = "", refused: Collection[str] = ()
) -> str | None:
    """Return why no loop is closed on a bench that has this record; None if one may be.

    Parameters
    ----------
    record : of its commissioning; empty if there is none
    of : the bench as it is wired now
    serial : number of the board that is open; empty where it has none
    refused : verbs that the open board refused
    """
    if not record:
        return not_commissioned()
    before = record.get("of")
    if record.get("version") != VERSION or not isinstance(before, Mapping) or stiffness(record) is None:
        return f"The record of this bench's commissioning cannot be read: {_AGAIN}"
    changed = [
        f"{name} was {before.get(name)!r} and is {of.get(name)!r}"
        for name in {**of, **before}
        if before.get(name) != of.get(name) or type(before.get(name)) is not type(of.get(name))
    ]
    known = record["measured"].get("serial_number", "")
    if known and serial and known != serial:
        changed.append(f"the board's serial number was {known!r} and is {serial!r}")
    date, listed = record.get("date"), "; ".join(changed)
    if changed:
        return f"This bench was commissioned on {date}, and has changed since ({listed}). {_AGAIN}"
    if "@" in str(of.get("address")):  # a simulator harms nobody
        return None
    tested = record.get("watchdog")
    if not isinstance(tested, Mapping):
        why = f"This bench was commissioned on {date}, but its watchdog was not tested with the motor."
    elif tested.get("passed") is not True:
        why = f"The watchdog failed its test with the motor on {tested.get('date')}: {tested.get('found')}"
    elif new := sorted({*refused} - {*tested.get("refused", ())}):
        why = f"The board refuses {', '.join(new)}, which it took when its watchdog was tested on {tested.get('date')}."
    else:
        return None
    return (
        f"{why} Until it passes, no loop is closed on this bench, and the motor gets at most 1 V. The test takes a "
        "minute: rotflex bench setup --watchdog bench.toml."
    )


# --- kinds of boards --------------------------------------------------------------------------------------------------

_RANGES_5_10 = (5.0, DAC_LIMIT)
_RANGES_NI = (0.1, 0.2, 0.5, 1.0, 2.0, 5.0, DAC_LIMIT)


@dataclass(frozen=True)
class Key:
    """An entry of ``bench.toml``.

    Attributes
    ----------
    default : its value unless given
    fits : tells whether a value is allowed
    allowed : the same in words, which follow "it must be"
    why : why it is so, where that is not plain
    """

    default: Any
    fits: Callable[[Any], bool]
    allowed: str
    why: str = ""


def choice(default: Any, *allowed: Any, why: str = "") -> Key:
    """Return an entry that has one of some values."""
    listed = ", ".join(str(entry).lower() if isinstance(entry, bool) else repr(entry) for entry in allowed)
    # True is no 1 here.
    return Key(default, lambda value: (type(value), value) in [(type(entry), entry) for entry in allowed], listed, why)


@dataclass(frozen=True)
class BoardKind:
    """A kind of board; None is not known.

    Attributes
    ----------
    title : as people call it
    encoders, analog_inputs, analog_outputs : how many channels there are
    digital_outputs : as many as are configured for the watchdog; 0 where it is not known to need them
    input_ranges, output_ranges : V, symmetric about zero, that can be chosen
    keys : table → name → entry of ``bench.toml`` that is another each for this kind of board, or that only it has
    always_set : whether ranges and quadrature are set when the board is opened, even if they are the usual ones
    """

    title: str
    encoders: int | None
    analog_inputs: int | None
    analog_outputs: int | None
    input_ranges: tuple[float, ...] | None = None
    output_ranges: tuple[float, ...] | None = None
    digital_outputs: int = 0
    keys: Mapping[str, Mapping[str, Key]] = field(default_factory=dict)
    always_set: bool = True


# Channels of Quanser's own boards: code that the maker's QUARC generated for them, and the mahi-daq library. Ranges at
# the Q8-USB's inputs: its page in the maker's HIL documentation. Which ranges the others have was not found, nor those
# of any output of these. Digital outputs of the Q8-USB: the same page; the maker says that Q8-series boards need them.
# National Instruments' boards: NI's specification of the 6259; for the 6251, and for the outputs' ranges, the comedi
# drivers of its PCIe form. How many encoders Quanser's driver reads there was not found.
#: Kinds of boards by the name that the maker's package has for them.
BOARDS = {
    "q2_usb": BoardKind("Quanser Q2-USB", encoders=2, analog_inputs=2, analog_outputs=2),
    "q8_usb": BoardKind("Quanser Q8-USB", 8, 8, 8, input_ranges=_RANGES_5_10, digital_outputs=8),
    "qpid": BoardKind("Quanser QPID", 8, 8, 8),
    "qpid_e": BoardKind("Quanser QPIDe", 8, 8, 8),
    "ni_usb_6251": BoardKind("NI USB-6251", None, 16, 2, _RANGES_NI, _RANGES_5_10),
    "ni_pcie_6259": BoardKind("NI PCIe-6259", None, 32, 4, _RANGES_NI, _RANGES_5_10),
}


# --- one bench -------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Setup:
    """A real bench.

    Attributes
    ----------
    servo, joint : its parts
    limits, wiring : see :mod:`rotflex.hil.bench`
    stiffness : of its joint, N·m/rad, within 15 %, for the runaway guard; the workbook's unless it was measured
    commissioned : returns why no loop is closed; None if one may be
    prepare : sets up the board of a bench that was opened: options, ranges, quadrature, filters
    clock : of the board, that paces the samples; a negative one is the computer's
    simulated : whether time waits for the program, as it does in the maker's simulator
    guarded : whether the runaway guard watches; not while a commissioning finds out what it would guard by
    marked : whether the place at which theta is zero was marked, as it is by a commissioning
    """

    servo: Servo = field(default_factory=srv02)
    joint: Joint = field(default_factory=joint)
    limits: Limits = DEFAULT_LIMITS
    wiring: Wiring = field(default_factory=Wiring)
    stiffness: float = WORKBOOKS_STIFFNESS
    commissioned: Callable[[], str | None] = not_commissioned
    prepare: Callable[[Connection], None] | None = None
    clock: int = Clock.HARDWARE_CLOCK_0
    simulated: bool = False
    guarded: bool = True
    marked: bool = False

    def allowed(self) -> Limits:
        """Return the limits now: careful ones, unless the bench was commissioned."""
        if not (why := self.commissioned()):
            return self.limits
        bounds = {key: min(getattr(self.limits, key), most) for key, most in asdict(CAREFUL).items() if key != "why"}
        return Limits(**bounds, why=why)


def make_bench(uri: str, connect: Callable[[], Board], setup: Setup) -> Bench:
    """Return the bench at an address.

    Parameters
    ----------
    uri : the address, which is its identity
    connect : opens its board
    setup : what is known of it
    """
    folder = files.settings() / "unfinished"

    def prepared(opened: Connection) -> None:
        """Set up the board. Only now it is known whether it is the one that was commissioned."""
        recover(folder)
        if setup.prepare is not None:
            setup.prepare(opened)
        safety.limits = setup.allowed()

    name = re.sub(r"\W+", "-", f"{uri}-{setup.wiring.servo_encoder}")
    needed = setup.marked and not setup.commissioned()
    mark = None if setup.simulated else Mark(files.settings() / "marks" / f"{name}.json", needed)
    guard = Guard(setup.servo, setup.limits.alpha, Allowance(stiffness=setup.stiffness)) if setup.guarded else None
    safety = Safety(setup.allowed(), guard, setup.commissioned, mark)
    connection = Connection(connect, setup.servo, wiring=setup.wiring, clock=setup.clock, prepare=prepared)
    identity = {"uri": uri, "arm_position": setup.joint.arm_position, "encoder": setup.servo.encoder}
    identity["clock"] = "simulated" if setup.simulated else "wall"
    return Bench(connection, setup.servo, setup.joint, identity, safety, Recorder(folder))
