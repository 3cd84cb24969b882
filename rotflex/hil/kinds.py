"""Kinds of boards, as data: what each has, so far as it was found written down; those that the workbook names.

A number that was not found is None, and nothing is checked by it: then only the maker's package says what the board
does not have. The same holds for a board that is not among these at all.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from rotflex.config import DAC_LIMIT

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
    listed = ", ".join(str(one).lower() if isinstance(one, bool) else repr(one) for one in allowed)
    return Key(default, lambda value: any(value == one and type(value) is type(one) for one in allowed), listed, why)


@dataclass(frozen=True)
class BoardKind:
    """A kind of board; None is not known.

    Attributes
    ----------
    name : as the maker's package calls it
    title : as people call it
    encoders, analog_inputs, analog_outputs : how many channels there are
    digital_outputs : as many as are configured for the watchdog; 0 where it is not known to need them
    input_ranges, output_ranges : V, symmetric about zero, that can be chosen
    keys : table → name → entry of ``bench.toml`` that is another one for this kind of board, or that only it has
    always_set : whether ranges and quadrature are set when the board is opened, even if they are the usual ones
    """

    name: str
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
BOARDS = {
    kind.name: kind
    for kind in (
        BoardKind("q2_usb", "Quanser Q2-USB", encoders=2, analog_inputs=2, analog_outputs=2),
        BoardKind("q8_usb", "Quanser Q8-USB", 8, 8, 8, input_ranges=_RANGES_5_10, digital_outputs=8),
        BoardKind("qpid", "Quanser QPID", 8, 8, 8),
        BoardKind("qpid_e", "Quanser QPIDe", 8, 8, 8),
        BoardKind("ni_usb_6251", "NI USB-6251", None, 16, 2, _RANGES_NI, _RANGES_5_10),
        BoardKind("ni_pcie_6259", "NI PCIe-6259", None, 32, 4, _RANGES_NI, _RANGES_5_10),
    )
}
