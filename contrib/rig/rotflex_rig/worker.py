"""The laboratory's computer: it fetches one run after the other, tries it on the bench's twin, then on the bench.

No port of this computer is open: it asks the server. The bench stays open, at 0 V and commissioned as always, as long
as the worker lives.
"""

from __future__ import annotations

import json
import threading
import time
import uuid
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import asdict
from typing import IO, Any

import control
import numpy as np

from rotflex import commissioning, doubts, experiments, files, hil, model, sampled
from rotflex.errors import BenchError, HILError, LimitExceeded, MotorNotStopped, RotflexError, RunStopped
from rotflex.hil.bench import Bench, Measurement
from rotflex.hil.bench_file import servo_parts
from rotflex.hil.controllers import OpenLoop
from rotflex.hil.loop import run
from rotflex.recording import Recording
from rotflex.units import DEG
from rotflex_rig.request import Request, read, recording_to_bytes
from rotflex_rig.web import NoAnswer, ask

_POLL = 1.0  # s, between two questions while there is nothing to do
_SATURATED = 0.3  # s at the voltage limit without a break, which no good controller needs
_NEAR, _AT_MARK = 3 * DEG, 10 * DEG  # from the mark: what is not worth turning back, and where a run may begin
_OUTSIDE = 1 + 1e-6  # of a pole in z: outside the unit circle, but for rounding
_UNSTABLE = (
    "The rig did not run it: with this controller the loop is unstable. On the bench's twin a disturbance grows by "
    "{growth:.1%} from sample to sample. Look at the controller's signs and at the model that it was designed with."
)
_AT_LIMIT = (
    "The rig did not run it: on the bench's twin the voltage stayed at its limit of ±{limit:g} V for {seconds:.1f} s. "
    "Use smaller gains, or a smaller or slower command."
)
_BEYOND = "The rig did not run it: the command reaches {most:.1f} V, and the limit of the bench is ±{limit:g} V."


class Worker:
    """The one worker of a bench.

    Parameters
    ----------
    url : of the rig, see :func:`rotflex_rig.web.checked`
    bench : the bench's address or its ``bench.toml``
    twin : address of the virtual bench on which each run is tried first

    Raises
    ------
    BenchError
        If a worker for this rig runs on this computer already.
    """

    def __init__(self, url: str, bench: str, twin: str) -> None:
        self._url, self._bench, self._twin = f"{url}/worker", hil.open(bench), hil.open(twin)
        folder = files.settings()
        folder.mkdir(parents=True, exist_ok=True)
        self._lock: IO[bytes] = (folder / f"rig-worker-{uuid.uuid5(uuid.NAMESPACE_URL, url)}").open("a+b")
        try:
            files.lock(self._lock)
        except OSError:
            raise BenchError("A worker for this rig runs on this computer already. One bench has one worker.") from None
        self._lock.seek(0)
        self._name = self._lock.read().decode() or uuid.uuid4().hex  # the same one when it is started again
        if not self._lock.tell():
            self._lock.write(self._name.encode())
            self._lock.flush()

    def work(self) -> None:
        """Work until it is interrupted; then the motor is at 0 V.

        Raises
        ------
        BenchError
            If the bench cannot be driven, or the server refuses this worker.
        """
        try:
            self._work()
        finally:
            print(self._bench.safety.outcome or "", flush=True)

    def _work(self) -> None:
        with self._bench as bench:
            bench.safety.require_commissioned()
            if bench.safety.mark is not None:
                bench.safety.require_place(bench.place)
            print("The bench is open at 0 V, and the server is asked for runs. Ctrl-C ends it.", flush=True)
            while True:
                given = json.loads(self._asked("POST", "", _described(bench)))
                if given:
                    self._one(bench, given["id"], read(given["body"].encode()))
                else:
                    time.sleep(_POLL)

    def _one(self, bench: Bench, number: int, asked: Request) -> None:
        """Try a run, make it, and send what became of it."""
        moved = False
        try:
            self._try(bench, asked)
            to_the_mark(bench)
            moved = True
            bench.identity["run"] = asked.run
            with self._while_wanted(bench, number):
                made = _recorded(bench, asked)
        except (HILError, Astray) as error:
            print(f"{error} The rig is paused.", flush=True)
            is_last = isinstance(error, MotorNotStopped)  # then the bench is closed at once, which tries 0 V again
            self._asked("PUT", f"/{number}", {"moved": moved, "reason": str(error)}, patient=not is_last)
            if is_last:
                raise
        except (RotflexError, ArithmeticError, ValueError) as error:
            print(f"Run {number} was refused: {error}", flush=True)
            self._asked("PUT", f"/{number}", {"error": type(error).__name__, "reason": str(error)})
        else:
            print(f"Run {number}: {asked.settings['experiment']}, {asked.seconds:.1f} s", flush=True)
            self._asked("PUT", f"/{number}", recording_to_bytes(made))

    @contextmanager
    def _while_wanted(self, bench: Bench, number: int) -> Iterator[None]:
        """Stop what runs meanwhile, at its next sample, once the student has taken the run back."""
        over, unwanted = threading.Event(), threading.Event()

        def look() -> None:
            while not over.wait(_POLL):
                with suppress(NoAnswer, BenchError):
                    if not json.loads(ask(f"{self._url}/{self._name}/{number}")):
                        unwanted.set()

        def hear(_measured: Measurement, _voltage: float) -> None:
            if unwanted.is_set():
                raise RunStopped("Its student took it back.")

        bench.on_sample = hear
        threading.Thread(target=look, daemon=True).start()
        try:
            yield
        finally:
            over.set()
            bench.on_sample = None

    def _try(self, bench: Bench, asked: Request) -> None:
        """Raise LimitExceeded if the bench's twin shows that a run would be unstable, or come to a limit."""
        limit, controller = bench.v_max, asked.controller
        most = float(np.abs(asked.reference).max())
        if isinstance(controller, OpenLoop) and most > limit:
            raise LimitExceeded(_BEYOND.format(most=most, limit=limit))
        self._twin.safety.limits = bench.safety.limits
        with self._twin as twin:
            plant = getattr(getattr(twin.board, "plant", None), "parameters", None)
            if hasattr(controller, "system") and plant is not None:
                sampled_plant = sampled.sample(model.of_plant(plant), asked.sample_time)
                loop = control.feedback(sampled_plant, controller.system(), sign=1)
                if (growth := float(np.abs(loop.poles()).max())) > _OUTSIDE:
                    raise LimitExceeded(_UNSTABLE.format(growth=growth - 1))
            try:
                tried = _run(twin, asked)
            except LimitExceeded as error:
                raise LimitExceeded(f"The rig did not run it. On the bench's twin: {error.args[0]}") from error
        within = np.flatnonzero(np.abs(tried["vm"]) < limit)
        seconds = asked.sample_time * (np.diff([-1, *within, len(tried)]).max() - 1)
        if seconds > _SATURATED and not isinstance(controller, OpenLoop):
            raise LimitExceeded(_AT_LIMIT.format(limit=limit, seconds=seconds))

    def _asked(self, method: str, path: str, body: dict[str, Any] | bytes, patient: bool = True) -> bytes:
        """Return the server's answer, once there is a connection; or nothing, where there is none and nobody waits."""
        content = body if isinstance(body, bytes) else json.dumps(body).encode()
        said = ""
        while True:
            try:
                return ask(f"{self._url}/{self._name}{path}", method, content)
            except NoAnswer as error:
                if str(error) != said:
                    print(f"The server does not answer: {error}. It is asked again and again.", flush=True)
                said = str(error)
            if not patient:
                return b""
            time.sleep(_POLL)


def _run(bench: Bench, asked: Request) -> Recording:
    return run(bench, asked.controller, asked.reference, asked.sample_time, asked.settings, progress=False)


def _recorded(bench: Bench, asked: Request) -> Recording:
    """Make a run, and once more where too many samples came late: nobody else can do something about it."""
    made = _run(bench, asked)
    late = doubts.of_samples(made.metadata, len(made))
    if late is None or not late.refuses:
        return made
    to_the_mark(bench)
    return _run(bench, asked)


class Astray(BenchError):
    """The arm is not where a run can begin, or does not come to rest."""


def to_the_mark(bench: Bench) -> None:
    """Turn the arm back to its mark, if the bench has one, and wait until it is at rest.

    Raises
    ------
    Astray
        If it does not arrive.
    HILError
        If the board refuses something.
    """
    try:
        experiments.rest(bench)
        if bench.safety.mark is not None and abs(bench.place) > _NEAR:
            commissioning.return_to_mark(bench)
            experiments.rest(bench)
    except HILError:
        raise
    except BenchError as error:
        raise Astray(f"The arm was to be turned back to its mark: {error}") from error
    if abs(bench.place) > _AT_MARK:
        raise Astray(f"The arm stands {bench.place / DEG:.0f} deg from its mark, and did not come back by itself.")


def _described(bench: Bench) -> dict[str, Any]:
    """Return what students' computers need to know of the bench, plain data."""
    about = {"servo": servo_parts(bench.servo), "joint": asdict(bench.joint), "voltage": bench.v_max}
    return {**about, "identity": {**bench.identity, "run": 1}}
