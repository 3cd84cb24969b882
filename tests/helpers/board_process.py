"""A board in a process of its own, on a socket: whoever drives it can be killed, and it goes on.

    python board_process.py serve FOLDER     a virtual board; its address is written to FOLDER/address
    python board_process.py drive FOLDER     drives it until somebody ends that, in simulated time
    python board_process.py main FOLDER      the same in time that does not wait
    python board_process.py thread FOLDER    and in a thread of its own

Its time passes when samples are waited for, or when a test says so, so that nothing depends on how busy a computer is.
"""

import json
import sys
import threading
import time
from collections.abc import Callable
from functools import partial
from multiprocessing.connection import Client, Connection, Listener
from pathlib import Path
from typing import Any

import numpy as np

from rotflex.hil.halt import uninterrupted

KEY = b"a board of a test's own"
VOLTS = 1.0  #: the motor is never at 0 V while it is driven
SAMPLES = 200_000


def serve(folder: Path) -> None:
    """Answer calls for as long as the process lives."""
    from fault_board import Stopwatch

    from rotflex.hil.student_benches import preset
    from rotflex.hil.virtual import VirtualBoard

    board = VirtualBoard(preset("real_bench").parameters, clock=Stopwatch())
    lock = threading.Lock()

    def answer(verb: str, arguments: list[Any]) -> Any:
        if verb == "let_time_pass":
            board.clock.pass_by(1.0)  # type: ignore[attr-defined]
            board._catch_up(board.clock.now())
            return None
        if verb == "voltage":
            return board.terminals.commanded[0]
        return getattr(board, verb)(*arguments)

    def attend(line: Connection) -> None:
        while True:
            try:
                verb, arguments = line.recv()
            except (EOFError, OSError):
                return
            with lock:
                try:
                    result, trouble = answer(verb, arguments), None
                except Exception as error:
                    result, trouble = None, error
            line.send((result, trouble, [one if isinstance(one, np.ndarray) else None for one in arguments]))

    with Listener(("localhost", 0), authkey=KEY) as listener:
        scratch = folder / "address.new"
        scratch.write_text(json.dumps(listener.address))
        scratch.rename(folder / "address")
        while True:
            threading.Thread(target=attend, args=(listener.accept(),), daemon=True).start()


class RemoteBoard:
    """The board of another process; ``voltage`` and ``let_time_pass`` are a test's.

    As a driver's call is, that is made in C, a call is made as a whole: else the next would get this one's answer.
    """

    def __init__(self, folder: Path) -> None:
        self._line = Client(tuple(json.loads((folder / "address").read_text())), authkey=KEY)

    def __getattr__(self, verb: str) -> Callable[..., Any]:
        if verb == "confirm_output":  # no verb of the maker's
            raise AttributeError(verb)

        def call(*arguments: Any) -> Any:
            with uninterrupted():
                self._line.send((verb, list(arguments)))
                result, trouble, arrays = self._line.recv()
                for ours, theirs in zip(arguments, arrays, strict=True):
                    if theirs is not None:
                        ours[:] = theirs
            if trouble is not None:
                raise trouble
            return result

        return call


def drive(folder: Path, clock: str = "simulated", in_thread: bool = False) -> None:
    """Drive the motor to and fro, and say so once it moves."""
    from rotflex.config import joint, srv02
    from rotflex.hil.bench import Bench, Connection, Recorder
    from rotflex.hil.controllers import OpenLoop
    from rotflex.hil.loop import run

    def on_sample(measured: Any, _voltage: float) -> None:
        if measured.time == 1.0:
            (folder / "moves").touch()

    connection = Connection(lambda: RemoteBoard(folder), srv02())  # type: ignore[arg-type,return-value]
    identity = {"uri": "remote", "clock": clock}
    bench = Bench(connection, srv02(), joint(1), identity, recorder=Recorder(folder / "unfinished"))
    with bench:
        bench.on_sample = on_sample
        running = partial(run, bench, OpenLoop(), VOLTS * (-1.0) ** (np.arange(SAMPLES) // 50), progress=False)
        if in_thread:
            threading.Thread(target=running, daemon=True).start()
            time.sleep(60)
        running()


if __name__ == "__main__":
    ways = {"main": partial(drive, clock="wall"), "thread": partial(drive, clock="wall", in_thread=True)}
    ({"serve": serve, "drive": drive} | ways)[sys.argv[1]](Path(sys.argv[2]))
