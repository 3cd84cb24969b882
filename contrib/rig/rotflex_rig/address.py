"""The student's half: the bench at ``rig:https://rig.school.edu``, the driver of this scheme.

The student's notebook calls the experiments as on any bench. Each sends what is to run, waits, and gives the recording
that the laboratory made.
"""

from __future__ import annotations

import getpass
import json
import math
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import replace
from typing import Any

from rotflex import hil
from rotflex.config import Joint, srv02
from rotflex.controller import Controller
from rotflex.errors import BenchError, DesignError, LimitExceeded, RunStopped
from rotflex.hil.bench import Bench
from rotflex.hil.real import BoardKind, Setup
from rotflex.hil.replay import RecordedPlant, RecordedRuns
from rotflex.plant import State
from rotflex.recording import Recording
from rotflex.units import Vector
from rotflex_rig import request
from rotflex_rig.web import NoAnswer, ask, checked, keep_token

_ERRORS = {error.__name__: error for error in (LimitExceeded, DesignError)}
_POLL, _LOOK = 1.0, 0.05  # s, from one question to the next; and between two looks for STOP
_LONGEST_STOP = 10  # questions, until a run that was taken back has stopped on the bench
_PATIENCE = 300.0  # s without a connection, after which the notebook waits no longer
_NOT_STEERED = (
    "Nobody steers a rig's bench sample by sample: read, write and start work on a bench that is in front of you, or "
    "on a virtual one. Here, use experiments.follow with a discrete system as controller."
)


def bench(uri: str, setup: Setup | None) -> Bench:
    """Return the bench of a rig; see :class:`rotflex.hil.drivers.Driver`.

    Raises
    ------
    BenchError
        If the address is none, or the server does not answer.
    """
    if setup is not None:
        raise BenchError("A rig's bench is set up in the laboratory: leave out setup= here.")
    url = checked(uri.removeprefix("rig:"))
    try:
        about = json.loads(ask(f"{url}/bench"))
    except NoAnswer as error:
        raise BenchError(
            f"The rig at {url} does not answer: {error}. Look at your connection, and try again."
        ) from None
    servo = srv02(**about["servo"])
    runs = RigRuns(url, servo.V_max)
    identity = {**about["identity"], "clock": "simulated"}
    opened = hil.recorded_bench(runs, servo, Joint(**about["joint"]), identity)
    opened.safety.limits = replace(opened.safety.limits, voltage=about["voltage"])
    runs.bench = opened
    return opened


def kind(_address: str) -> BoardKind | None:
    """Return None: what board a rig has is the laboratory's business."""
    return None


def software() -> str:
    """Return what the driver uses."""
    return "rotflex-rig"


def login(url: str) -> None:
    """Ask for a token, try it, and keep it in a file that only you can read.

    Raises
    ------
    BenchError
        If the rig does not know the token.
    """
    url = checked(url)
    token = getpass.getpass(f"Your token for {url}: ").strip()
    try:
        ask(f"{url}/me", token=token)
    except NoAnswer as error:
        raise BenchError(f"The rig at {url} does not answer: {error}. Look at the address.") from None
    print(f"Your token is kept in {keep_token(url, token)}. Your notebooks have none of it.")


class RigRuns(RecordedRuns):
    """Runs that are made in the laboratory when they are asked for.

    Parameters
    ----------
    url : of the rig
    v_max : the most that its servo can have, V

    Attributes
    ----------
    bench : on which these runs stand in the plant's place
    """

    bench: Bench

    def __init__(self, url: str, v_max: float) -> None:
        super().__init__([], v_max, 1)
        self._url, self._number = f"{url}/runs", 0

    @property
    def state(self) -> State:
        """As recorded; raises BenchError where no run was chosen."""
        if not self._number:
            raise BenchError(_NOT_STEERED)
        return super().state

    def choose(
        self, settings: Mapping[str, Any], controller: Controller | None, reference: Vector, sample_time: float
    ) -> None:
        """Have an experiment run in the laboratory, and take its recording; see :class:`RecordedRuns`.

        Raises
        ------
        BenchError
            If the rig does not run it, with the reason; if nobody has answered for minutes.
        """
        _ = self.bench.board  # raises where the bench is not open
        run = self.bench.identity.get("run", 1)
        body, self._number = request.packed(settings, controller, reference, sample_time, run), 0
        number = json.loads(self._patiently(lambda: ask(self._url, "POST", body)))["id"]
        try:
            recording = self._waited(f"{self._url}/{number}")
        except (KeyboardInterrupt, RunStopped):
            self._take_back(f"{self._url}/{number}")
            raise
        RecordedPlant.__init__(self, recording, f"the recording of your {settings['experiment']}")
        self._number = number

    def exactly(self, given: Recording) -> Recording:
        """Return the run as it was recorded; the rig learns that it arrived, so that the same call is a new run."""
        with suppress(BenchError, OSError):
            ask(f"{self._url}/{self._number}", "DELETE")
        self._number = 0
        return super().exactly(given)

    def _waited(self, url: str) -> Recording:
        """Wait until a run is done, saying where it stands, and return its recording."""
        shown = ""
        while True:
            said = json.loads(self._patiently(lambda: ask(url)))
            line = _in_words(said)
            if line != shown:
                print(f"\rRig       {line:<{len(shown)}}", end="", flush=True)
                shown = line
            if said["state"] not in ("waiting", "running"):
                print()
                break
            self._pause()
        if said["state"] != "done":
            raise _ERRORS.get(said["error"], BenchError)(said["reason"] or "The run was withdrawn.")
        return request.recording_of_bytes(self._patiently(lambda: ask(f"{url}/recording")))

    @staticmethod
    def _take_back(url: str) -> None:
        """Withdraw a run, and wait until the bench stands, if it was there."""
        with suppress(BenchError, OSError):
            ask(url, "DELETE")
            for _each in range(_LONGEST_STOP):
                if json.loads(ask(url))["state"] != "running":
                    print("\nRig       Your run was taken back.")
                    return
                time.sleep(_POLL)
        print("\nRig       Your run could not be taken back: if it is on the bench, it goes to its end there.")

    def _patiently(self, act: Callable[[], bytes]) -> bytes:
        """Return what the rig answers, once there is a connection."""
        until = time.monotonic() + _PATIENCE
        while True:
            try:
                return act()
            except NoAnswer as error:
                if time.monotonic() > until:
                    raise BenchError(
                        f"The rig has not answered for {_PATIENCE / 60:.0f} minutes: {error}. Your run keeps its "
                        "place: run this cell again, unchanged, and it is found."
                    ) from None
            self._pause()

    def _pause(self) -> None:
        """Wait before the next question; who watches the bench may stop the run meanwhile."""
        for _look in range(round(_POLL / _LOOK)):
            if self.bench.on_sample is not None:
                self.bench.on_sample(self.bench.latest, 0.0)
            time.sleep(_LOOK)


def _in_words(said: Mapping[str, Any]) -> str:
    if said["state"] == "waiting":
        minutes = math.ceil(said["seconds"] / 60)
        line = f"{said['before']} before you, about {minutes} minute{'s' * (minutes != 1)}."
        line = line if said["before"] else "You are next."
        return f"{line} No run is begun now: {said['held']}." if said["held"] else line
    return {"running": "Your run is on the bench.", "done": "Your run is done."}.get(said["state"], "It did not run.")
