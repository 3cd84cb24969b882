"""Requests and answers on the line to the board, samples that come unasked, and what went wrong on the way."""

from __future__ import annotations

from collections.abc import Callable

from rotflex.errors import HILError
from rotflex_serial import protocol
from rotflex_serial.port import Port
from rotflex_serial.protocol import Booted, Cause, Flag, Foreign, Receiver, Reply, Sample, Status, Type

ALIVE_AFTER = 0.02  #: s without a frame, less than half of the board's 50 ms, until it is told that the program lives
_PATIENCE = 0.25  # s for an answer, which comes within milliseconds, before the request is sent again
_ATTEMPTS = 3  # times a request is sent; each can be obeyed twice
_STARTING = 5.0  # s that a board takes to start when its port is opened, at most; a boot loader takes two


class Line:
    """The line to a board.

    Parameters
    ----------
    port : a line, open

    Attributes
    ----------
    on_sample : called with each sample that comes
    flags : how the board was when it was heard last
    """

    def __init__(self, port: Port) -> None:
        self.port = port
        self.flags = Flag(0)
        self.on_sample: Callable[[Sample], None] | None = None
        self._receiver = Receiver()
        self._sequence = 0
        self._sent = port.now()
        self._reply: Reply | None = None
        self._in_session = False
        self._gone: HILError | None = None
        self._attempts = _ATTEMPTS

    @property
    def damaged(self) -> int:
        """How many frames from the board came damaged."""
        return self._receiver.damaged

    def greet(self) -> Reply:
        """Begin a session, as soon as the board has started: many start anew when their port is opened.

        Raises
        ------
        HILError
            If nothing answers, or not in this version of the protocol.
        """
        end = self.port.now() + _STARTING
        while self.port.now() < end:
            reply = self._attempt(Type.HELLO, b"")
            if reply is not None:
                self._in_session = True
                return _checked(reply)
        raise HILError(
            "Nothing answers at this port. Is it the board's, is its firmware on it (contrib/serial/README.md: make "
            "flash), and does no other program have the port?"
        )

    def post(self, kind: Type, payload: bytes = b"") -> int:
        """Send what is not answered, and return its sequence number."""
        if self._gone is not None:
            raise self._gone
        self._sequence = (self._sequence + 1) % 256
        self.port.write(protocol.request(kind, self._sequence, payload))
        self._sent = self.port.now()
        return self._sequence

    def ask(self, kind: Type, payload: bytes = b"") -> Reply:
        """Send a request, and wait for its answer. It is sent again where none comes: each can be obeyed twice.

        Raises
        ------
        HILError
            If none comes, or the board refuses.
        """
        for _attempt in range(self._attempts):
            reply = self._attempt(kind, payload)
            if reply is not None:
                self._attempts = _ATTEMPTS
                return _checked(reply)
        self._attempts = 1  # what else is asked is not to take as long
        raise HILError(
            "The board does not answer, and is to stop the motor itself after 50 ms. Look at the cable, and whether "
            "the board has power."
        )

    def keep_alive(self) -> None:
        """Tell the board that the program lives, if it has heard nothing for a while."""
        if self.port.now() - self._sent >= ALIVE_AFTER:
            self.post(Type.ALIVE)

    def listen(self, until: float) -> None:
        """Take what has come; if nothing has, wait for it until then (s).

        Raises
        ------
        HILError
            If the line is broken, or the board has started anew.
        """
        if self._gone is not None:
            raise self._gone
        for body in self._receiver.take(self.port.read(until)):
            self._take(body)

    def _attempt(self, kind: Type, payload: bytes) -> Reply | None:
        sequence = self.post(kind, payload)
        self._reply = None
        end = self.port.now() + _PATIENCE
        while self.port.now() < end:
            self.listen(end)
            reply: Reply | None = self._reply
            if reply is not None and (reply.sequence, reply.to) == (sequence, kind):
                return reply
        return None

    def _take(self, body: bytes) -> None:
        heard = protocol.message(body)
        if isinstance(heard, Sample):
            self.flags = heard.flags
            if self.on_sample is not None:
                self.on_sample(heard)
        elif isinstance(heard, Reply):
            self.flags, self._reply = heard.flags, heard
            if heard.status is Status.NO_SESSION and self._in_session:
                self._lose(Cause(0))
        elif isinstance(heard, Booted) and self._in_session:
            self._lose(heard.cause)
        elif isinstance(heard, Foreign):
            raise HILError(
                f"The board speaks version {heard.version} of the protocol, this program version {protocol.VERSION}. "
                "Flash the firmware that belongs to this version of rotflex (contrib/serial/README.md)."
            )

    def _lose(self, cause: Cause) -> None:
        """The board does not know of the session any more, and obeys nothing until the next."""
        self._gone = HILError(
            f"The board has started anew in the middle ({_cause(cause)}), which stops its motor. Open the bench again."
        )
        raise self._gone


def _cause(cause: Cause) -> str:
    for bit, words in (
        (Cause.HANG, "its program hung"),
        (Cause.BROWN_OUT, "its power was too low"),
        (Cause.POWER, "its power was cut"),
        (Cause.RESET, "by its reset button or line"),
    ):
        if bit in cause:
            return words
    return "it does not say why"


def _checked(reply: Reply) -> Reply:
    """A reply, if it is a good one."""
    if reply.status is Status.OK:
        return reply
    raise HILError(f"The board refused request {reply.to} ({reply.status.name}).")
