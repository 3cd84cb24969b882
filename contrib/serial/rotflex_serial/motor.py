"""The motor's voltage, from the program to the board, and the watchdog that takes it back."""

from __future__ import annotations

from rotflex.errors import HILError
from rotflex_serial import protocol
from rotflex_serial.line import Line
from rotflex_serial.protocol import Flag, Operation, Type

LONGEST_TIMEOUT = 65.0  #: s, of the watchdog: sixteen bits of milliseconds
_ATTEMPTS = 3  # times the last voltage is sent, until it is known to be obeyed


class Motor:
    """The motor at the end of a line.

    Parameters
    ----------
    line : the line to the board, in session
    supply : what the motor's driver is fed with, V
    """

    def __init__(self, line: Line, supply: float) -> None:
        self.supply = supply
        self._line = line
        self._unconfirmed: tuple[int, float] | None = None  # sequence number and voltage
        line.ask(Type.SUPPLY, protocol.SUPPLY.pack(round(supply * 1000)))

    def set(self, voltage: float) -> None:
        """Send a voltage (V), cut to the supply, and do not wait until it is obeyed.

        Raises
        ------
        HILError
            If the watchdog is known to have expired.
        """
        if Flag.EXPIRED in self._line.flags:
            raise self._expired()
        self._send(min(max(voltage, -self.supply), self.supply))

    def settle(self) -> None:
        """Make sure that the board has obeyed the last voltage.

        Raises
        ------
        HILError
            If it does not, though it answers.
        """
        for _attempt in range(_ATTEMPTS):
            if self._unconfirmed is None:
                return
            sequence, voltage = self._unconfirmed
            reply = self._line.ask(Type.READ)
            if reply.accepted == sequence:
                self._unconfirmed = None
                return
            if Flag.EXPIRED in reply.flags:
                self._unconfirmed = None
                raise self._expired()
            self._send(voltage)
        raise HILError("The board answers, but does not obey: its last output was lost on the line again and again.")

    # --- watchdog -------------------------------------------------------------------------------------------------

    def watch(self, timeout: float) -> None:
        """Start the program's watchdog, with a time-out in s.

        Raises
        ------
        HILError
            If the time-out is none.
        """
        if not 0 < timeout <= LONGEST_TIMEOUT:
            raise HILError(
                f"A watchdog needs a positive time-out, at most {LONGEST_TIMEOUT:g} s; it was given {timeout} s."
            )
        self._tell(Operation.WATCH, max(1, int(timeout * 1000 + 1e-6)))

    def unwatch(self) -> None:
        """Stop the program's watchdog, once the last voltage is known to be obeyed."""
        self.settle()
        self._tell(Operation.UNWATCH)

    def clear(self) -> None:
        """Let voltages be set again after the watchdog expired; until then the motor is at 0 V."""
        self._unconfirmed = None
        self._tell(Operation.CLEAR)

    def is_expired(self) -> bool:
        """Whether the watchdog has expired, or the board has heard nothing for too long."""
        return Flag.EXPIRED in self._line.ask(Type.READ).flags

    def _send(self, voltage: float) -> None:
        self._unconfirmed = self._line.post(Type.OUTPUT, protocol.OUTPUT.pack(round(voltage * 1000))), voltage

    def _tell(self, operation: Operation, timeout: int = 0) -> None:
        self._line.ask(Type.WATCHDOG, protocol.WATCHDOG.pack(operation, timeout))

    def _expired(self) -> HILError:
        if Flag.SILENT in self._line.flags:
            return HILError(
                "The board had heard nothing for 50 ms and stopped the motor: its watchdog has expired and "
                "holds the output. Something kept the program from answering each sample; clear the watchdog "
                "before writing again."
            )
        return HILError("The watchdog has expired and holds the output; clear it before writing again.")
