"""The bench that an address like ``serial:/dev/ttyACM0?supply=12`` names."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from rotflex.config import Amplifier, Servo, joint, srv02
from rotflex.courseware.messages import _
from rotflex.errors import BenchError
from rotflex.hil.bench import Bench
from rotflex.hil.serial.board import SerialBoard
from rotflex.hil.serial.port import open_port

OPTIONS = ("supply", "encoder", "arm_position")
EXAMPLE = "serial:/dev/ttyACM0?supply=12"
SUPPLY = (3.0, 32.0)  #: V that the motor's driver may be fed with


def bench(uri: str, name: str, options: Mapping[str, str], servo: Servo | None = None) -> Bench:
    """The bench at a serial port.

    Parameters
    ----------
    uri : the address, as it was given
    name : the port
    options : supply (V), which has to be told; encoder, arm_position
    servo : nominal servo; the data sheet's with the address's encoder unless given. Its voltage ends at the supply.

    Raises
    ------
    BenchError
        If the port or the supply is missing, or the supply is none.
    ConfigurationError
        If there is no such encoder or arm position.
    """
    if not name:
        raise BenchError(
            _("The address {uri!r} names no port; it is like {example!r}.").format(uri=uri, example=EXAMPLE)
        )
    supply = _supply(uri, options.get("supply"))
    parts = _driven(servo or srv02(encoder=options.get("encoder", "E")), supply)
    position = options.get("arm_position", "1")
    arm = joint(int(position) if position.isdecimal() else 0)
    return Bench(
        connect=lambda: SerialBoard(open_port(name), supply),
        servo=parts,
        joint=arm,
        identity={
            "uri": uri,
            "board": "serial",
            "supply": supply,
            "arm_position": arm.arm_position,
            "encoder": parts.encoder,
        },
    )


def _supply(uri: str, value: str | None) -> float:
    try:
        supply = float(value or "")
    except ValueError:
        supply = 0.0
    lowest, highest = SUPPLY
    if not lowest <= supply <= highest:
        raise BenchError(
            _(
                "The address {uri!r} has to say what the motor's driver is fed with, {lowest:g} to {highest:g} V, as "
                "in {example!r}: the board makes each voltage out of it."
            ).format(uri=uri, lowest=lowest, highest=highest, example=EXAMPLE)
        )
    return supply


def _driven(servo: Servo, supply: float) -> Servo:
    """A servo whose amplifier is a driver with that supply (V), with no cable that has a gain."""
    amplifier = servo.amplifier
    driver = Amplifier("motor driver", min(supply, amplifier.V_max), amplifier.I_max)
    return replace(servo, amplifier=driver, cable_gain=1)
