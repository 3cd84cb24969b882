"""The maker's card in a process of its own: output, watchdog and plant live on when the program that drives it dies.

    python card_process.py serve FOLDER               the card, on the virtual bench; FOLDER/address says where
    python card_process.py bench FOLDER ARGUMENT ...   `rotflex bench ARGUMENT ...` on that card
    python card_process.py setup FOLDER                 of a commissioning, the sweep in which the motor drives first
    python card_process.py thread FOLDER                an experiment in a thread of its own

The card's time passes when samples are waited for, or when a test says so.
"""

import json
import sys
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from multiprocessing.connection import Client, Listener
from pathlib import Path
from typing import Any

import miswired
import numpy as np
import quanser_double
from fault_board import Stopwatch

KEY = b"a card of a test's own"
ADDRESS = "quanser:q2_usb/0"
GAIN = [18.24, -17.15, 1.59, 0.63]


@dataclass(frozen=True)
class Fault:
    """What goes wrong with the card, from a sample on.

    at : sample since the card was asked to be faulty; the arm is in motion then
    verbs : those that fail; all, if there are none
    hangs : s that each of them takes before
    """

    at: int = 300
    verbs: tuple[str, ...] = ()
    hangs: float = 0.0


@dataclass
class Served:
    """The card's state, which outlives the programs that open it."""

    board: Any
    fault: Fault | None = None
    samples: int = 0
    variant: quanser_double.Variant = field(default_factory=quanser_double.Variant)

    def call(self, card: Any, verb: str, arguments: list[Any]) -> Any:
        """Answer a call to the maker's class, or fail as the fault has it."""
        fault = self.fault
        if verb == "task_read_encoder":
            self.samples += arguments[1]
        if fault and self.samples >= fault.at and verb in (fault.verbs or {verb} - {"is_valid", "close"}):
            time.sleep(fault.hangs)
            raise quanser_double.HILError(-1, "It does not answer.")
        if verb == "close":
            card._inner = None
            return None
        card.variant = self.variant
        return getattr(card, verb)(*arguments)

    def control(self, what: str, value: Any) -> Any:
        """Do what a test asks for."""
        if what == "fault":
            self.fault, self.samples = value, 0
        elif what == "let_time_pass":
            self.board.clock.pass_by(1.0)
            self.board._catch_up(self.board.clock.now())
        elif what == "refuse":
            self.variant = quanser_double.Variant(refuses=value)
        return self.board.terminals.commanded[0], self.samples


def serve(folder: Path) -> None:
    """Answer calls for as long as the process lives."""
    from rotflex.hil.student_benches import preset
    from rotflex.hil.virtual import VirtualBoard

    board = VirtualBoard(preset("real_bench").parameters, clock=Stopwatch())
    modules, _opened = quanser_double.package(lambda: board)
    served, lock = Served(board), threading.Lock()

    def attend(line: Any) -> None:
        card = modules["quanser.hardware"].HIL()
        while True:
            try:
                verb, arguments = line.recv()
            except (EOFError, OSError):
                return
            with lock:
                result: Any = None
                error: tuple[int, str] | None = None
                try:
                    if verb.startswith("test:"):
                        result = served.control(verb.removeprefix("test:"), *arguments)
                    else:
                        result = served.call(card, verb, arguments)
                except quanser_double.HILError as trouble:
                    error = trouble.error_code, trouble._words
            line.send((result, error, [one if isinstance(one, np.ndarray) else None for one in arguments]))

    with Listener(("localhost", 0), authkey=KEY) as listener:
        scratch = folder / "address.new"
        scratch.write_text(json.dumps(listener.address))
        scratch.rename(folder / "address")
        while True:
            threading.Thread(target=attend, args=(listener.accept(),), daemon=True).start()


class Line:
    """The way to the card. As a driver's call is, that is made in C, each is made as a whole."""

    def __init__(self, folder: Path) -> None:
        self._line = Client(tuple(json.loads((folder / "address").read_text())), authkey=KEY)

    def call(self, verb: str, *arguments: Any) -> Any:
        from rotflex.hil.halt import uninterrupted

        with uninterrupted():
            self._line.send((verb, list(arguments)))
            result, error, arrays = self._line.recv()
            for ours, theirs in zip(arguments, arrays, strict=True):
                if theirs is not None:
                    ours[:] = theirs
        if error is not None:
            raise quanser_double.HILError(*error)
        return result

    def fault(self, fault: Fault | None) -> None:
        """Have the card fail from a sample on, counted from now; None for a card in order."""
        self.call("test:fault", fault)

    def refuse(self, verbs: frozenset[str]) -> None:
        """Have the card not have some verbs."""
        self.call("test:refuse", verbs)

    def let_time_pass(self) -> None:
        """A second in which no program says a word."""
        self.call("test:let_time_pass", None)

    @property
    def voltage(self) -> float:
        """What is on the motor's output now, V."""
        return float(self.call("test:voltage", None)[0])

    @property
    def samples(self) -> int:
        """How many samples were read since the fault was set."""
        return int(self.call("test:samples", None)[1])


def install(folder: Path) -> None:
    """Have the maker's package be the one on the card of another process, and the card's time be the computer's."""
    from rotflex.hil.connection import Connection

    passed = [0.0, 0.0]  # s, by the samples that were read, and from one to the next

    class HIL:
        def __init__(self, card_type: str, card_identifier: str = "0") -> None:
            self._line = Line(folder)
            self._line.call("open", card_type, card_identifier)

        def __getattr__(self, verb: str) -> Callable[..., Any]:
            def call(*arguments: Any) -> Any:
                if verb == "task_start":
                    passed[1] = 1 / arguments[2]
                if verb == "task_read_encoder":
                    passed[0] += arguments[1] * passed[1]
                return self._line.call(verb, *arguments)

            return call

    def connected(
        self: Connection, *arguments: Any, made: Callable[..., None] = Connection.__init__, **more: Any
    ) -> None:
        made(self, *arguments, **more)
        self.now = lambda: passed[0]  # however busy this computer is

    modules, _opened = quanser_double.package(lambda: None)  # type: ignore[arg-type,return-value]
    modules["quanser.hardware"].HIL = HIL  # type: ignore[attr-defined]
    sys.modules.update(modules)
    Connection.__init__ = connected  # type: ignore[method-assign]


def setup(_arguments: list[str]) -> None:
    """The first sweep of a commissioning, as the command runs it."""
    from rotflex import bench_commands, commissioning, hil
    from rotflex.hil.bench_file import BenchFile

    person = miswired.Person(None, moves=False)  # who says yes to all
    commissioning.STEPS = ((commissioning.driven_slowly, (commissioning.link,)),)
    with bench_commands.errors_as_messages():
        commissioning.commission(
            BenchFile(ADDRESS), lambda bench, chosen: hil.open(bench.address, setup=chosen), person
        )


def bench(arguments: list[str]) -> None:
    """A command of the bench."""
    from rotflex.cli import run

    sys.argv = ["rotflex", "bench", *arguments]
    run()


def thread(_arguments: list[str]) -> None:
    """Run an experiment in a thread, while the main one waits."""
    from rotflex import experiments, hil

    with hil.open("bench.toml") as bench:
        bench.set_zero()
        threading.Thread(target=experiments.tracking, args=(bench, GAIN), daemon=True).start()
        time.sleep(60)


if __name__ == "__main__":
    way, place = sys.argv[1], Path(sys.argv[2])
    if way == "serve":
        serve(place)
    else:
        import typer

        install(place)
        try:
            {"bench": bench, "setup": setup, "thread": thread}[way](sys.argv[3:])
        except typer.Exit as ended:
            sys.exit(ended.exit_code)
