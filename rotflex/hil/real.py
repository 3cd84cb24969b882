"""A bench that can come to harm: what is known of it, and what keeps it from harm.

A laboratory's own wiring and the record of its commissioning come in as a :class:`Setup`. Without a record no loop is
closed: which way a bench is wired is found there, never assumed.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import asdict, dataclass, field

from rotflex import files
from rotflex.config import Joint, Servo, joint, srv02
from rotflex.hil import waiting
from rotflex.hil.bench import Bench
from rotflex.hil.board import Board, Clock
from rotflex.hil.guard import Allowance, Guard
from rotflex.hil.mark import Mark
from rotflex.hil.parts import Limits, Safety, Wiring
from rotflex.units import DEG

#: A servo under 10 V turns at 17 rad/s without a load. No experiment of the course is longer than a minute.
LIMITS = Limits(rate=25.0, duration=120.0)

#: N·m/rad; for the guard, until it is measured.
WORKBOOKS_STIFFNESS = Allowance().stiffness

#: What a bench may do before it is commissioned, and its watchdog tested: with any sign wrong, whatever drives it.
CAREFUL = Limits(voltage=1.0, theta=40 * DEG, alpha=25 * DEG, rate=8.0, duration=60.0)


def not_commissioned() -> str:
    """Why no loop is closed on a bench that has no record."""
    return (
        "This bench has not been commissioned as it is wired now, so no loop is closed on it: with one sign "
        "wrong the arm would be half a turn away within 0.3 s. Commission it first, by rotflex bench setup; "
        f"watching it, and driving it with up to {CAREFUL.voltage:g} V by up to {CAREFUL.theta / DEG:.0f} deg, "
        "work without."
    )


def careful(limits: Limits, why: str) -> Limits:
    """The limits of a bench that is not commissioned."""
    bounds = {key: min(getattr(limits, key), value) for key, value in asdict(CAREFUL).items() if key != "why"}
    return Limits(**bounds, why=why)


@dataclass(frozen=True)
class Setup:
    """A real bench.

    Attributes
    ----------
    servo, joint : its parts
    limits, wiring : see :mod:`rotflex.hil.parts`
    stiffness : of its joint, N·m/rad, within 15 %, for the runaway guard; the workbook's unless it was measured
    commissioned : text that is not empty is why no loop is closed
    prepare : sets up the board of a bench that was opened: options, ranges, quadrature, filters
    clock : of the board, that paces the samples; a negative one is the computer's
    simulated : whether time waits for the program, as it does in the maker's simulator
    guarded : whether the runaway guard watches; not while a commissioning finds out what it would guard by
    marked : whether the place at which theta is zero was marked, as it is by a commissioning
    """

    servo: Servo = field(default_factory=srv02)
    joint: Joint = field(default_factory=joint)
    limits: Limits = LIMITS
    wiring: Wiring = field(default_factory=Wiring)
    stiffness: float = WORKBOOKS_STIFFNESS
    commissioned: Callable[[], str] = not_commissioned
    prepare: Callable[[Bench], None] | None = None
    clock: int = Clock.HARDWARE_CLOCK_0
    simulated: bool = False
    guarded: bool = True
    marked: bool = False


def bench(uri: str, connect: Callable[[], Board], setup: Setup) -> Bench:
    """The bench at an address.

    Parameters
    ----------
    uri : the address, which is its identity
    connect : opens its board
    setup : what is known of it
    """

    def connected() -> Board:
        waiting.tell()
        return connect()

    def prepared(opened: Bench) -> None:
        """Set up the board. Only now it is known whether it is the one that was commissioned."""
        if setup.prepare is not None:
            setup.prepare(opened)
        opened.limits = _limits(setup)

    guard = Guard(setup.servo, setup.limits.alpha, Allowance(stiffness=setup.stiffness))
    return Bench(
        connect=connected,
        servo=setup.servo,
        joint=setup.joint,
        identity={
            "uri": uri,
            "arm_position": setup.joint.arm_position,
            "encoder": setup.servo.encoder,
            "clock": "simulated" if setup.simulated else "wall",
        },
        limits=_limits(setup),
        wiring=setup.wiring,
        safety=Safety(
            guard=guard if setup.guarded else None,
            commissioned=setup.commissioned,
            folder=waiting.place(),
            mark=None if setup.simulated else _mark(uri, setup),  # in a simulator no cable twists
        ),
        clock=setup.clock,
        prepare=prepared,
    )


def _limits(setup: Setup) -> Limits:
    why_not = setup.commissioned()
    return careful(setup.limits, why_not) if why_not else setup.limits


def _mark(uri: str, setup: Setup) -> Mark:
    """The mark of the board's servo, beside the user's settings."""
    name = re.sub(r"\W+", "-", f"{uri}-{setup.wiring.servo_encoder}")
    return Mark(files.settings() / "marks" / f"{name}.json", setup.marked and not setup.commissioned())
