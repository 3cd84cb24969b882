"""The bench that an address like ``serial:/dev/ttyACM0?supply=12`` names."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import serial

from rotflex.config import Amplifier, Servo, joint, one_of, srv02
from rotflex.errors import BenchError
from rotflex.hil import drivers, real
from rotflex.hil.bench import Bench
from rotflex.hil.real import BoardKind, Setup, choice
from rotflex_serial.board import SerialBoard
from rotflex_serial.port import open_port

OPTIONS = ("supply", "encoder", "arm_position")
EXAMPLE = "serial:/dev/ttyACM0?supply=12"
SUPPLY = (3.0, 32.0)  #: V that the motor's driver may be fed with


KIND = BoardKind(
    "serial board",
    encoders=2,
    analog_inputs=2,
    analog_outputs=1,
    keys={
        "parts": {"cable_gain": choice(1, 1, why="A motor's driver has no cable with a gain.")},
        "board": {"clock": choice(0, 0, why="The serial bench has one clock, the board's own.")},
    },
    always_set=False,  # its ranges cannot be chosen: the output's is its supply
)


def kind(address: str) -> BoardKind:
    """Return what the board has."""
    return KIND


def software() -> str:
    """Name the library at the port, with its version."""
    return f"pyserial {serial.VERSION}"


def bench(uri: str, setup: Setup | None = None) -> Bench:
    """Return the bench at a serial port.

    Parameters
    ----------
    uri : the address. Its options: supply (V), which must be given; encoder, arm_position, unless a setup has them
    setup : what else is known of the bench. Its servo's voltage ends at the supply.

    Raises
    ------
    BenchError
        If the port or the supply is missing, or the supply is none, or the parts are given twice.
    ConfigurationError
        If there is no such encoder or arm position.
    """
    name, mark, query = uri.partition(":")[2].partition("?")
    options = drivers.options(uri, mark + query, OPTIONS, EXAMPLE)
    if not name:
        raise BenchError(f"The address {uri!r} names no port; it is like {EXAMPLE!r}.")
    supply = _supply(uri, options.get("supply"))
    chosen = _setup(uri, options) if setup is None else setup
    twice = [one for one in OPTIONS if one != "supply" and one in options and setup is not None]
    if twice:
        raise BenchError(
            f"The address {uri!r} says {twice[0]}=, which the bench's own file or setup says as well: leave it out."
        )
    driven = replace(chosen, servo=_driven(chosen.servo, supply))
    return real.make_bench(uri, lambda: SerialBoard(open_port(name), supply), driven)


def _setup(uri: str, options: Mapping[str, str]) -> Setup:
    """The parts that an address names."""
    position = one_of("arm_position", options.get("arm_position", "1"), "123")
    return Setup(servo=srv02(encoder=options.get("encoder", "E")), joint=joint(int(position)))


def _supply(uri: str, value: str | None) -> float:
    try:
        supply = float(value or "")
    except ValueError:
        supply = 0.0
    lowest, highest = SUPPLY
    if not lowest <= supply <= highest:
        raise BenchError(
            f"The address {uri!r} has to say what the motor's driver is fed with, {lowest:g} to {highest:g} V, "
            f"as in {EXAMPLE!r}: the board makes each voltage out of it."
        )
    return supply


def _driven(servo: Servo, supply: float) -> Servo:
    """A servo whose amplifier is a driver with that supply (V), with no cable that has a gain."""
    amplifier = servo.amplifier
    driver = Amplifier("motor driver", min(supply, amplifier.V_max), amplifier.I_max)
    return replace(servo, amplifier=driver, cable_gain=1)
