"""The console where there are no threads, as in a browser: with a program that can be put aside, and without."""

from __future__ import annotations

import asyncio
import sys
import threading
import time
from contextlib import suppress
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest
from explorer_events import notice, press, readout

from labcourse.scene import explorer
from labcourse.scene.explorer import KernelLoop
from rotflex import experiments
from rotflex.widgets import running
from rotflex.widgets.console import BenchConsole

PULL = {"kind": "grab", "name": "arm", "x": -0.6, "y": 0.6}


class Loop(asyncio.SelectorEventLoop):
    """A loop that goes on while one of its calls is put aside."""

    def _run_once(self):
        with suppress(IndexError):  # what was to be called next has been called meanwhile
            super()._run_once()


def run(scenario):
    """Run a function in such a loop."""
    with asyncio.Runner(loop_factory=Loop) as runner:
        return runner.run(scenario())


def put_aside(work):
    """Stand in for ``run_sync``: the call waits, and the loop goes on."""
    loop = asyncio.get_running_loop()
    task = loop.create_task(work)
    while not task.done():
        loop._run_once()
    return task.result()


@pytest.fixture
def no_threads(monkeypatch):
    """Return a function that says whether programs can be put aside. Nothing starts a thread."""
    monkeypatch.setattr(KernelLoop, "threads", False)
    monkeypatch.setattr(running, "threading", SimpleNamespace(Event=threading.Event))
    monkeypatch.setattr(explorer, "threading", None)
    ffi = ModuleType("pyodide.ffi")
    monkeypatch.setitem(sys.modules, "pyodide", ModuleType("pyodide"))
    monkeypatch.setitem(sys.modules, "pyodide.ffi", ffi)

    def can(wait):
        ffi.can_run_sync, ffi.run_sync = (lambda: wait), put_aside

    return can


def played(console):
    return console.scene["play"] and console.scene["play"]["auto"] and console.scene["play"]["at_once"]


def grabs(console):
    return console.scene["columns"][0]["panels"][0]["grabs"]


def test_a_run_that_can_wait_is_watched_pulled_and_stopped(lab, no_threads):
    no_threads(wait=True)

    async def scenario():
        console = BenchConsole(lab)
        begun, frames, ahead = time.perf_counter(), console.scene["version"], []
        console.receive({**PULL, "begins": True})
        assert console.running, notice(console)
        while np.abs(console._run.samples()[2]).max(initial=0) < 0.1:
            assert not console._run.done, console._run.error
            console.hear(PULL)
            await asyncio.sleep(0.02)
            ahead.append(console._run.samples()[0, -1:].max(initial=0) - (time.perf_counter() - begun))
        assert max(ahead) <= 0 and console.scene["version"] > frames and grabs(console)
        console.hear({"kind": "press", "name": "stop"})
        await asyncio.wait_for(console._task, 60)
        assert readout(console, "State")["rows"][0]["values"] == ["stopped"] and not played(console)
        press(console, "start")
        assert console.running, notice(console)
        console.close()  # while it runs: it ends by itself
        await asyncio.wait_for(console._task, 60)
        assert console._run.done and console._state == "stopped"

    run(scenario)


def test_a_run_that_cannot_wait_is_computed_as_a_whole_and_played_which_is_said(lab, no_threads):
    no_threads(wait=False)

    async def scenario():
        console = BenchConsole(lab, experiment="free decay")
        words = len(readout(console, "State")["rows"])
        assert not console.watched and not grabs(console)
        press(console, "start")
        assert console._state == "finished" and played(console)
        assert len(readout(console, "State")["rows"]) == words + 1  # it is still said that it was not watched
        return console.recording

    recording = run(scenario)
    with lab.bench() as bench:
        expected = experiments.free_decay(bench, progress=False)
    assert (recording["alpha"] == expected["alpha"]).all()


def test_what_is_long_is_done_at_once(lab, no_threads):
    async def scenario():
        console, done = BenchConsole(lab), []
        console.in_background(lambda: "work", done.append)
        assert (done, console.busy) == (["work"], False)

    no_threads(wait=False)
    run(scenario)
