"""Every end of a program that drives a real bench: what is on the motor then, and that this is what is said of it.

The card is in a process of its own, on the maker's Python interface: it goes on when the program does not.
"""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import card_process
import numpy as np
import pytest
import quanser_double
from card_process import ADDRESS, GAIN, Fault, Line
from checkout import ROOT
from jupyter_client.blocking.client import BlockingKernelClient
from jupyter_client.manager import KernelManager

from rotflex.hil import bench_file, real
from rotflex.hil.bench_file import BenchFile
from rotflex.recording import Recording

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(sys.platform == "win32", reason="Windows ends a program by other means than signals"),
]
HELPER = card_process.__file__
PATIENCE = 90.0  # s; a busy computer takes its time
AT = 3300  #: sample at which something happens: the arm has come to rest before, and has begun to turn again
NOT_STOPPED, ABORTED = 4, 130
RUN = ("bench", "run", "fsf", "--gain", str(GAIN), "--bench", "bench.toml", "--out", "out.mat")
WRITES = ("write_analog",)
NOTHING_STOPS = frozenset({"watchdog_set_analog_expiration_state"})


@dataclass(frozen=True)
class End:
    """How a program ends, and what is to be seen of it.

    fault : of the card
    signals : to the program, 10 ms apart, once so many samples were read
    code : exit code
    left : whether a voltage is left when the program has ended, until the watchdog acts
    said : patterns that are said, in this order
    way : of the helper
    recorded : whether a recording is left
    """

    code: int
    said: tuple[str, ...] = ()
    fault: Fault | None = None
    signals: tuple[int, ...] = ()
    left: bool = False
    way: tuple[str, ...] = RUN
    recorded: bool = True
    refuses: frozenset[str] = field(default_factory=frozenset)


AT_ZERO = r"The motor is at 0 V\."
LEFT = r"The motor may still be at -?\d+\.\d\d V\. Press the emergency stop\. The board's watchdog, where it works"
PULLED, HANGING = Fault(AT), Fault(AT, hangs=0.3)
ENDS = {
    "nothing": End(0, ("samples are in out.mat",)),
    "writes refused": End(NOT_STOPPED, (LEFT, "failed at write_analog"), Fault(AT, WRITES), left=True),
    "reads refused": End(2, ("failed at task_read_encoder", AT_ZERO), Fault(AT, ("task_read_encoder",))),
    "USB pulled": End(NOT_STOPPED, (LEFT,), PULLED, left=True),
    "calls that hang": End(NOT_STOPPED, (LEFT,), HANGING, left=True),
    "calls that hang, and Ctrl-C four times": End(NOT_STOPPED, (LEFT,), HANGING, (signal.SIGINT,) * 4, left=True),
    **{
        f"{verb} refused": End(2, (f"failed at {verb}", AT_ZERO), Fault(AT, (verb,)))
        for verb in ("watchdog_reload", "task_stop", "task_delete", "watchdog_stop")
    },
    "Ctrl-C": End(ABORTED, (AT_ZERO, "recorded until then is in out.mat"), None, (signal.SIGINT,)),
    "Ctrl-C six times": End(ABORTED, (AT_ZERO, "recorded until then is in out.mat"), None, (signal.SIGINT,) * 6),
    "SIGTERM": End(-signal.SIGTERM, (), None, (signal.SIGTERM,)),
    "SIGHUP": End(-signal.SIGHUP, (), None, (signal.SIGHUP,)),
    "SIGTERM, in a thread": End(-signal.SIGTERM, (), None, (signal.SIGTERM,), way=("thread",)),
    "SIGTERM, writes refused": End(NOT_STOPPED, (LEFT,), Fault(AT, WRITES), (signal.SIGTERM,), left=True),
    "SIGKILL": End(-signal.SIGKILL, (), None, (signal.SIGKILL,), left=True),
    "set-up, USB pulled, Ctrl-C four times": End(
        NOT_STOPPED, (LEFT,), HANGING, (signal.SIGINT,) * 4, left=True, way=("setup",), recorded=False
    ),
    "set-up, Ctrl-C": End(2, ("was broken off", AT_ZERO), None, (signal.SIGINT,), way=("setup",), recorded=False),
}


@pytest.fixture(scope="module")
def server(tmp_path_factory) -> Iterator[Path]:
    folder = tmp_path_factory.mktemp("card")
    process = subprocess.Popen([sys.executable, HELPER, "serve", str(folder)], env=environment(folder))
    try:
        until((folder / "address").exists, lambda: process.poll() is None)
        yield folder
    finally:
        process.kill()
        process.wait()


@pytest.fixture
def card(server) -> Iterator[Line]:
    line = Line(server)
    line.refuse(frozenset())
    for _each in range(10):  # the arm comes to rest
        line.let_time_pass()
    yield line
    line.fault(None)


def environment(folder: Path) -> dict[str, str]:
    path = os.pathsep.join([str(ROOT), str(ROOT / "labcourse"), str(Path(HELPER).parent)])
    return os.environ | {"PYTHONPATH": path, "ROTFLEX_CONFIG_DIR": str(folder / "settings")}


def until(true: Callable[[], object], alive: Callable[[], bool] = lambda: True) -> None:
    """Wait for something."""
    end = time.monotonic() + PATIENCE
    while not true():
        assert time.monotonic() < end and alive()
        time.sleep(0.01)


def commissioned(folder: Path) -> None:
    """Write the file of a bench that was commissioned, with a watchdog that stopped the motor."""
    file = BenchFile(ADDRESS)
    tested = {"passed": True, "date": "2026-11-01", "found": "it stopped", "refused": []}
    record = real.record(file.identity(), {"stiffness": 1.6, "serial_number": "1001"}, watchdog=tested)
    bench_file.save(folder / "bench.toml", BenchFile(ADDRESS, record=record))


def started(server: Path, folder: Path, way: tuple[str, ...]) -> subprocess.Popen[str]:
    (answers := folder / "answers.txt").write_text("y\n")  # the arm stands at its mark
    stops = (signal.SIGHUP, signal.SIGTERM, signal.SIGINT)  # a program that is started with & ignores some
    ignored = {number: signal.signal(number, signal.SIG_DFL) for number in stops}
    try:
        return subprocess.Popen(
            [sys.executable, HELPER, way[0], str(server), *way[1:]],
            cwd=folder,
            env=environment(folder) | {"COLUMNS": "2000"},
            text=True,
            stdin=answers.open(),
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
        )
    finally:
        for number, handler in ignored.items():
            signal.signal(number, handler)


#: At a landing: the ways of ending a program that differ most, and each thing that is said of it.
AT_A_LANDING = {"calls that hang, and Ctrl-C four times", "SIGTERM, writes refused"}
AT_A_LANDING |= {"SIGKILL", "set-up, USB pulled, Ctrl-C four times"}


@pytest.mark.parametrize(
    "end",
    [
        pytest.param(end, id=name, marks=() if name in AT_A_LANDING else pytest.mark.scheduled)
        for name, end in ENDS.items()
    ],
)
def test_what_is_said_is_what_is_on_the_motor(server, card, tmp_path, end):
    commissioned(tmp_path)
    card.fault(end.fault)
    # A signal ends the run long before it would end by itself, however late a busy computer sends it.
    longer = ("--duration", "60") if end.signals and end.way == RUN else ()
    program = started(server, tmp_path, (*end.way, *longer))
    try:
        for number in end.signals:
            until(lambda: card.samples >= AT, lambda: program.poll() is None)
            program.send_signal(number)
            time.sleep(0.01)
        said, _none = program.communicate(timeout=PATIENCE)
    finally:
        program.kill()
        program.wait()
    assert as_a_shell_has_it(program.returncode) == as_a_shell_has_it(end.code), said
    assert (card.voltage != 0.0) is end.left
    found = [match and match.start() for match in (re.search(one, said) for one in end.said)]
    assert None not in found and found == sorted(found), said
    assert ("The motor is at 0 V" in said) <= (not end.left)  # never said where it is not so
    left = card.voltage
    card.fault(None)
    card.let_time_pass()
    assert card.voltage == 0.0
    if end.code == -signal.SIGKILL:  # found when a bench is opened next
        again = started(server, tmp_path, ("bench", "watch", "--duration", "0.1"))
        assert "was killed in a run" in again.communicate(timeout=PATIENCE)[0]
    kept = [*tmp_path.glob("out.mat"), *tmp_path.glob("settings/unfinished/*.mat")]
    assert bool(kept) is end.recorded
    for path in kept if end.code else ():
        assert_true(Recording.load(path), end, left)


def as_a_shell_has_it(code: int) -> int:
    """Return an exit code as ``$?`` has it: a Ctrl-C that comes when all is said ends Python itself, with 130, too."""
    return 128 - code if code < 0 else code


def assert_true(recording: Recording, end: End, left: float) -> None:
    """The last voltage is the one that the card took, and the outcome is as it was."""
    assert len(recording) > 200 and np.abs(recording["vm"]).max() > 0.1
    if end.left:  # a program that was killed may have died between a write and its note of it
        assert recording["vm"][-1] == pytest.approx(left, abs=1.0 if end.code == -signal.SIGKILL else 1e-12)
    if end.code != -signal.SIGKILL:
        outcome = recording.metadata["outcome"]
        assert (outcome["at_zero"], outcome["volts"]) == (not end.left, pytest.approx(left, abs=1e-12))


def test_a_board_that_refuses_what_its_watchdog_was_tested_with_is_not_driven_in_a_loop(server, card, tmp_path):
    commissioned(tmp_path)
    card.fault(None)
    card.refuse(NOTHING_STOPS)
    said, _none = (program := started(server, tmp_path, RUN)).communicate(timeout=PATIENCE)
    assert (program.returncode, card.voltage) == (2, 0.0), said
    assert not (tmp_path / "out.mat").exists()
    assert "watchdog_set_analog_expiration_state" in said and "rotflex bench setup --watchdog" in said


@dataclass(frozen=True)
class Notebook:
    """A kernel that drives the card, and the folder that it is in."""

    kernel: KernelManager
    client: BlockingKernelClient
    folder: Path

    def recordings(self) -> list[Path]:
        """Find what runs left there that did not come to their end."""
        return [*self.folder.glob("settings/unfinished/*.mat")]


@pytest.fixture(scope="module")
def notebook(server, tmp_path_factory) -> Iterator[Notebook]:
    folder, kernel = tmp_path_factory.mktemp("notebook"), KernelManager()
    commissioned(folder)
    kernel.start_kernel(env=environment(folder), cwd=str(folder))
    client = kernel.blocking_client()
    try:
        client.start_channels()
        client.wait_for_ready(timeout=PATIENCE)
        begun = client.execute_interactive(BEGIN % server, timeout=PATIENCE)
        assert begun["content"]["status"] == "ok"
        yield Notebook(kernel, client, folder)
    finally:
        client.stop_channels()
        kernel.shutdown_kernel(now=True)


#: A cell that ends with an error keeps none from being run that was asked for meanwhile.
GOES_ON = {"stop_on_error": False}
BEGIN = """
import card_process, pathlib
from rotflex import experiments, hil
card_process.install(pathlib.Path("%s"))
"""
CELL = f"""
with hil.open("bench.toml") as bench:
    bench.set_zero()
    experiments.tracking(bench, {GAIN}, progress=False)
"""


def test_in_a_notebook_it_is_said_first_too(card, notebook):
    card.fault(Fault(AT, WRITES))
    written: list[dict] = []
    reply = notebook.client.execute_interactive(CELL, timeout=PATIENCE, output_hook=written.append, **GOES_ON)
    assert reply["content"]["ename"] == "MotorNotStopped"
    texts = [one["content"].get("text") or "\n".join(one["content"].get("traceback", ())) for one in written]
    assert all(re.search(LEFT, text) for text in texts if text) and len([*filter(None, texts)]) == 2
    card.let_time_pass()
    assert card.voltage == 0.0


@pytest.mark.parametrize(("number", "why"), [(signal.SIGINT, "KeyboardInterrupt"), (signal.SIGTERM, "SIGTERM")])
def test_a_kernel_that_is_interrupted_or_ended_sets_0_V_itself(card, notebook, number, why):
    for path in notebook.recordings():
        path.unlink()
    card.fault(None)
    notebook.client.execute(CELL, **GOES_ON)
    until(lambda: card.samples >= AT, notebook.kernel.is_alive)
    notebook.kernel.signal_kernel(number)
    until(lambda: card.voltage == 0.0)
    until(notebook.recordings)
    (recording,) = map(Recording.load, notebook.recordings())
    assert why in recording.metadata["ended"] and recording.metadata["outcome"]["at_zero"]
    if number == signal.SIGTERM:
        until(lambda: not notebook.kernel.is_alive())


def test_the_double_is_the_strict_one():
    """A card that did not refuse what the maker does not document would let all pass."""
    with pytest.raises(quanser_double.Undocumented):
        _ = quanser_double.HIL().write_voltage
