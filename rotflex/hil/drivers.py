"""Find a board's driver by the scheme of its address, and what kinds of boards there are.

The driver ``quanser`` is built in; others come in packages of their own.

A package adds a scheme by an entry point of the group ``rotflex.boards``. The entry point's name is the scheme, and its
value is a :class:`Driver`: a module with these three functions is one. In ``pyproject.toml``::

    [project.entry-points."rotflex.boards"]
    serial = "rotflex_serial.address"

``contrib/serial`` is an example.
"""

from __future__ import annotations

from collections.abc import Collection
from importlib.metadata import entry_points
from typing import Protocol, cast
from urllib.parse import parse_qsl

from rotflex.errors import BenchError
from rotflex.hil import quanser
from rotflex.hil.bench import Bench
from rotflex.hil.real import BoardKind, Setup

GROUP = "rotflex.boards"
_SERIAL = " The board at a serial port is a package of its own: pip install contrib/serial, in a checkout of rotflex."


class Driver(Protocol):
    """What a package says of its boards. The address is given whole, as ``serial:/dev/ttyACM0?supply=12``."""

    def bench(self, uri: str, setup: Setup | None) -> Bench:
        """Return the bench at an address, not yet open: :func:`rotflex.hil.real.make_bench` makes it of a board.

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
        return quanser
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
