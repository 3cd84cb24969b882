"""The line to the board: bytes in, bytes out, and the time that passes meanwhile."""

from __future__ import annotations

import time
from typing import Protocol

import serial
from serial.tools import list_ports

from rotflex.errors import BenchError, HILError

BAUD_RATE = 500_000
_PATIENCE = 1.0  # s for the computer to take what is written; a frame takes less than a millisecond


class Port(Protocol):
    """A line, and the clock that its waiting is measured by."""

    def now(self) -> float:
        """Time, s."""

    def write(self, content: bytes) -> None:
        """Send bytes.

        Raises
        ------
        HILError
            If the line is broken.
        """

    def read(self, until: float) -> bytes:
        """What has come, as soon as anything has; nothing, if nothing comes until then (s).

        Raises
        ------
        HILError
            If the line is broken.
        """

    def close(self) -> None:
        """Close it."""


class SerialPort:
    """A serial port of this computer, by pyserial.

    Parameters
    ----------
    name : as the system has it, /dev/ttyACM0 or COM3; or an address that pyserial knows

    Raises
    ------
    BenchError
        If the port cannot be opened.
    """

    def __init__(self, name: str) -> None:
        self.name = name
        try:
            self._line = serial.serial_for_url(name, BAUD_RATE, timeout=0, write_timeout=_PATIENCE, exclusive=True)
        except (OSError, ValueError) as error:
            raise BenchError(f"The serial port {name!r} cannot be opened: {error}. {_ports()}") from None

    def now(self) -> float:
        """The computer's own time, s."""
        return time.perf_counter()

    def write(self, content: bytes) -> None:
        """Send bytes."""
        try:
            self._line.write(content)
        except OSError as error:
            raise self._broken(error) from None

    def read(self, until: float) -> bytes:
        """What has come, as soon as anything has."""
        try:
            waiting = self._line.in_waiting
            if waiting:
                return bytes(self._line.read(waiting))
            self._line.timeout = max(until - self.now(), 0.0)
            return bytes(self._line.read(1))
        except (OSError, TypeError) as error:  # TypeError: pyserial's, of a port that was closed while it was read
            raise self._broken(error) from None

    def close(self) -> None:
        """Close it."""
        self._line.close()

    def _broken(self, error: Exception) -> HILError:
        return HILError(
            f"The line to the board at {self.name} is broken: {error}. The board is to stop the motor itself after 50 "
            "ms. Look at the cable, and open the bench again."
        )


def _ports() -> str:
    """The ports that there are, in words."""
    found = ", ".join(sorted(str(port.device) for port in list_ports.comports()))
    if found:
        return f"There are: {found}."
    return "This computer has none: is the board plugged in?"


def open_port(name: str) -> Port:
    """The port of that name.

    Raises
    ------
    BenchError
        As :class:`SerialPort` says.
    """
    return SerialPort(name)
