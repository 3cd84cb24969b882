"""Whether students' code can be isolated here: asked before anything is run, and shown by ``labcourse doctor``."""

from __future__ import annotations

import os
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

from labcourse import program
from labcourse.errors import IsolationError
from labcourse.grading.isolation import selftest

if TYPE_CHECKING:
    from labcourse.grading.isolation.selftest import Attempt, Layer

_REFUSAL = (
    "[bold]Not graded:[/bold] students' code cannot be run in isolation here. It would run with your own rights: "
    "it could read and change your files (the key and other students' work among them), and use the network.\n"
)
_WAYS = (
    f"\n[bold]{program.name()} doctor[/bold] shows every layer. With [bold]--unsafe-no-isolation[/bold] it is run all "
    "the same, though not by root. Do that only where nothing of value can be reached, as on a machine or an "
    "account kept for it. Every report then says so."
)


@dataclass(frozen=True)
class Examined:
    """What was found: the layers, and, where they are there, what came of trying to break out.

    Attributes
    ----------
    layers : what isolation is made of here
    attempts : what was tried from inside
    """

    layers: tuple[Layer, ...]
    attempts: tuple[Attempt, ...]

    @property
    def good(self) -> bool:
        """Whether all that is needed holds."""
        return all(layer.good for layer in self.layers if layer.needed) and all(
            attempt.contained for attempt in self.attempts if attempt.needed
        )

    def as_data(self) -> dict[str, Any]:
        """The same as plain data."""
        return {
            "good": self.good,
            "layers": [asdict(layer) for layer in self.layers],
            "attempts": [asdict(attempt) for attempt in self.attempts],
        }


def examine() -> Examined:
    """Look at the layers, and try to break out if they are all there."""
    found = tuple(selftest.layers())
    layers_good = all(layer.good for layer in found if layer.needed)
    return Examined(found, tuple(selftest.attempts()) if layers_good else ())


def check() -> None:
    """Raise IsolationError unless students' code can be isolated here; the error names the layer and the remedy."""
    examined = examine()
    for layer in examined.layers:
        if layer.needed and not layer.good:
            raise IsolationError(f"{layer.name}: {layer.state}", layer.name, layer.remedy)
    for attempt in examined.attempts:
        if attempt.needed and not attempt.contained:
            raise IsolationError(
                f"The self-test broke out: {attempt.name}: {attempt.result}",
                attempt.name,
                f"Do not grade here; run `{program.name()} doctor` and report what it shows.",
            )


def check_unisolated() -> None:
    """Raise IsolationError for root: with its rights, a submission could do anything at all."""
    if hasattr(os, "geteuid") and os.geteuid() == 0:
        raise IsolationError(
            "--unsafe-no-isolation is not for root.",
            "privileges",
            "Grade in isolation, or as a user made for it who owns nothing of value.",
        )


def refuse(error: IsolationError) -> None:
    """Print for an instructor why nothing was graded."""
    from rich.console import Console

    console = Console(stderr=True)
    console.print(_REFUSAL)
    console.print(str(error), markup=False, style="red")
    console.print(_WAYS)


def show(examined: Examined) -> None:
    """Print what was found, layer by layer."""
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    console = Console()
    table = Table(title="What isolation is made of", title_justify="left")
    for heading in ("layer", "", "found"):
        table.add_column(heading)
    for layer in examined.layers:
        table.add_row(layer.name, _word(layer.good, layer.needed), Text(layer.state))
    console.print(table)
    for layer in examined.layers:
        if not layer.good and layer.remedy:
            console.print(f"{layer.name}: {layer.remedy}", markup=False, style=None if layer.needed is False else "red")
    if examined.attempts:
        table = Table(title="What was tried from inside", title_justify="left")
        for heading in ("attempt", "", "what came of it"):
            table.add_column(heading)
        for attempt in examined.attempts:
            table.add_row(attempt.name, _word(attempt.contained, attempt.needed), Text(attempt.result))
        console.print(table)
    console.print(
        "Students' code can be run in isolation here."
        if examined.good
        else "Students' code cannot be run in isolation here: nothing is graded."
    )


def _word(good: bool, needed: bool) -> str:
    if good:
        return "[green]good[/green]"
    return "[red]NO[/red]" if needed else "[yellow]not there (it need not be)[/yellow]"
