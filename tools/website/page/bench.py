"""What the page's worker runs: a visitor's own bench and another arm's poles, for a page that sends events."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from labcourse.errors import CourseError
from labcourse.scene.explorer import Explorer
from labcourse.scene.scene import Scene
from labcourse.student_id import normalised
from rotflex import hil
from rotflex.hil.student_benches import DRAW, student_seed
from rotflex.widgets import another_arm
from rotflex.widgets.console import HOLD, WATCH, BenchConsole
from rotflex.widgets.poles import OtherPoles

OFFERED = ("free decay", "sweep", HOLD, WATCH)  #: what a bench runs without a gain or a model of the visitor's
SILENT = "Nothing is heard of the running bench: this device may be busy."


class Visitor:
    """Stand in for a student's session: a bench by an ID, and no answers."""

    address = "virtual"

    def __init__(self, student: str) -> None:
        self._seed = student_seed(normalised(student))

    def bench(self, address: str) -> hil.Bench:
        """Return the bench that a course gives a student of this ID, unless it gives everybody the same."""
        return hil.open(address, seed=self._seed, draw=DRAW)


class Console(BenchConsole):
    """The console of notebook 00; nothing is saved, for what a browser's Python saves nobody finds."""

    def view(self) -> Scene:
        """Servo and arm beside the scope."""
        scene = super().view()
        controls = [[one for one in row if one.name != "save"] for row in scene.controls]
        return replace(scene, controls=controls, live=scene.live and SILENT)


class Poles(OtherPoles):
    """The poles of another arm, without a word on the questions of the course."""

    def view(self) -> Scene:
        """The s-plane beside the response and the arm, verdicts below."""
        scene = super().view()
        return replace(scene, readouts=scene.readouts[:1])


class Page:
    """The explorers of a page.

    Parameters
    ----------
    show : called with an explorer's name, its scene as JSON, and the scene's numbers

    Attributes
    ----------
    pulls : whether the arm can be pulled; else a run is computed as a whole, and then played
    """

    pulls = False

    def __init__(self, show: Callable[[str, str, bytes], object]) -> None:
        self._show = show
        self._explorers: dict[str, Explorer] = {}

    async def open(self, student: str) -> str:
        """Show the bench of an ID, and the poles; return why there is no such bench, or nothing."""
        try:
            console = Console(Visitor(student), experiment=OFFERED[0], offered=OFFERED)
        except CourseError as error:
            return str(error)
        if "bench" in self._explorers:
            before = self._explorers.pop("bench")
            before.tell = None  # it may take a moment to stop
            before.close()
        self.pulls = console.watched
        self._put("bench", console)
        if "poles" not in self._explorers:
            self._put("poles", Poles(*another_arm.model()))
        return ""

    def receive(self, name: str, event: str) -> None:
        """Take an event of the page for an explorer, as JSON."""
        self._explorers[name].hear(json.loads(event))

    def _put(self, name: str, explorer: Explorer) -> None:
        def tell(scene: dict[str, Any], data: bytes) -> None:
            self._show(name, json.dumps(scene), data)

        explorer.tell = tell
        self._explorers[name] = explorer
        tell(explorer.scene, explorer.data)
