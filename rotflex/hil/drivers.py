"""Find a board's driver by the scheme of its address, and what kinds of boards there are.

The driver ``quanser`` is built in; others come in packages of their own.

A package adds a scheme by an entry point of the group ``rotflex.boards``. The entry point's name is the scheme, and its
value is a :class:`Driver`: a module with these three functions is one. In ``pyproject.toml``::

    [project.entry-points."rotflex.boards"]
    serial = "rotflex_serial.address"

``contrib/serial`` is an example.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field
from importlib import import_module
from importlib.metadata import entry_points
from typing import Any, Protocol, cast
from urllib.parse import parse_qsl

from rotflex.config import DAC_LIMIT
from rotflex.errors import BenchError
from rotflex.hil.bench import Bench
from rotflex.hil.real import Setup

GROUP = "rotflex.boards"
_SERIAL = " The board at a serial port is a package of its own: pip install contrib/serial, in a checkout of rotflex."


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
    name : as the maker's package calls it
    title : as people call it
    encoders, analog_inputs, analog_outputs : how many channels there are
    digital_outputs : as many as are configured for the watchdog; 0 where it is not known to need them
    input_ranges, output_ranges : V, symmetric about zero, that can be chosen
    keys : table → name → entry of ``bench.toml`` that is another each for this kind of board, or that only it has
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


class Driver(Protocol):
    """What a package says of its boards. The address is given whole, as ``serial:/dev/ttyACM0?supply=12``."""

    def bench(self, uri: str, setup: Setup | None) -> Bench:
        """Return the bench at an address, not yet open: :func:`rotflex.hil.real.bench` makes it of a board.

        Parameters
        ----------
        uri : the address
        setup : what a ``bench.toml`` or a program says of the bench; None if there is neither

        Raises
        ------
        BenchError
            If the address is not understood; the message says what is.
        """

    def kind(self, address: str) -> BoardKind | None:
        """Return what the board at an address has, and by it what ``bench.toml`` may say; None if that is not known."""

    def software(self) -> str:
        """Return name and version of the library that the driver uses, as ``pyserial 3.5``, for ``doctor --bench``.

        Raises
        ------
        BenchError
            If something is missing; the message says what to install.
        """


def find(address: str) -> Driver | None:
    """Return the driver for an address; None if no package with its scheme is installed.

    Raises
    ------
    BenchError
        If the package that has it cannot be imported.
    """
    scheme = address.partition(":")[0]
    if scheme == "quanser":
        return cast(Driver, import_module("rotflex.hil.quanser"))
    for entry in entry_points(group=GROUP, name=scheme):
        try:
            return cast(Driver, entry.load())
        except Exception as error:  # whatever another package does when it is imported
            package = entry.dist.name if entry.dist else entry.value
            raise BenchError(
                f"The boards at {scheme}: come from the package {package}, which cannot be imported: {error}. Install "
                "it again, or ask whoever gave it to you."
            ) from error
    return None


def unknown(address: str) -> BenchError:
    """Return the error for an address that no driver is for. It lists the schemes that installed packages add."""
    installed = sorted(entry_points(group=GROUP).names)
    more = f" Packages that are installed here add {', '.join(installed)}." if installed else ""
    return BenchError(
        f"There is no bench at {address!r}: an address begins with virtual, as in 'virtual:?seed=7', with replay, as "
        "in 'replay:recording.mat', or with quanser, as in 'quanser:q2_usb/0'; or it is a file, as 'bench.toml'."
        f"{more}{'' if 'serial' in installed else _SERIAL}"
    )


def options(uri: str, query: str, known: Collection[str], example: str) -> dict[str, str]:
    """Return the options of an address.

    Parameters
    ----------
    uri : the address, for the message
    query : what follows the board's name in it: empty, or from the question mark on
    known : names of the options that there are
    example : an address, for the message

    Raises
    ------
    BenchError
        If an option is not known or is given twice.
    """
    pairs = parse_qsl(query.removeprefix("?"), keep_blank_values=True)
    given = dict(pairs)
    if set(given) - set(known) or len(given) != len(pairs) or (query and not query.startswith("?")):
        raise BenchError(
            f"The address {uri!r} is not understood. Options come after a '?', as in {example!r}, each once, "
            f"joined by &: {', '.join(known)}."
        )
    return given
