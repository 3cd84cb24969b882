"""The boards that the workbook names, as data: what each has, and what it is asked to be when it is opened.

A board that is not among them works as well; its channels and ranges are then not checked before it is opened.
"""

from __future__ import annotations

from dataclasses import dataclass

from rotflex.config import DAC_LIMIT

_RANGE_10 = (DAC_LIMIT,)
_RANGES_5_10 = (5.0, DAC_LIMIT)


@dataclass(frozen=True)
class BoardKind:
    """A kind of board, as its maker documents it.

    Attributes
    ----------
    name : as the maker's package calls it
    title : as people call it
    encoders, analog_inputs, analog_outputs : how many channels there are
    input_ranges, output_ranges : V, symmetric about zero, that can be chosen
    quadrature : how many edges an encoder can count
    """

    name: str
    title: str
    encoders: int
    analog_inputs: int
    analog_outputs: int
    input_ranges: tuple[float, ...] = _RANGE_10
    output_ranges: tuple[float, ...] = _RANGE_10
    quadrature: tuple[int, ...] = (1, 2, 4)


BOARDS = {
    kind.name: kind
    for kind in (
        BoardKind("q2_usb", "Quanser Q2-USB", encoders=2, analog_inputs=2, analog_outputs=2),
        BoardKind("q8_usb", "Quanser Q8-USB", 8, 8, 8, _RANGES_5_10, _RANGES_5_10),
        BoardKind("qpid", "Quanser QPID", 8, 8, 8, _RANGES_5_10, _RANGES_5_10),
        BoardKind("qpid_e", "Quanser QPIDe", 8, 8, 8, _RANGES_5_10, _RANGES_5_10),
        BoardKind("ni_usb_6251", "NI USB-6251", 2, 16, 2, (0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0), _RANGES_5_10),
        BoardKind("ni_pcie_6259", "NI PCIe-6259", 2, 32, 4, (0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0), _RANGES_5_10),
    )
}
