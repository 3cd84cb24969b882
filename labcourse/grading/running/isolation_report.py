"""Check whether students' code can be isolated here: before anything is run, and for ``labcourse doctor``."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

from labcourse import program
from labcourse.errors import IsolationError
from labcourse.grading.isolation import selftest

if TYPE_CHECKING:
    from labcourse.grading.isolation.selftest import Attempt, Layer

_REFUSAL = """\
[bold]Not graded:[/bold] students' code cannot be run in isolation here. It would run with your own rights: \
it could read and change your files (the key and other students' work among them), and use the network.

[red]{error}[/red]

[bold]{program} doctor[/bold] shows every layer. With [bold]--unsafe-no-isolation[/bold] the code is run without \
isolation, though not by root. Do that only where nothing of value can be reached, as on a machine or an account kept \
for it. Every report then says so."""


@dataclass(frozen=True)
class IsolationState:
    """The state of isolation on this machine.

    Attributes
    ----------
    layers : what isolation consists of here
    attempts : attempts to break out; none if a needed layer is missing
    """

    layers: tuple[Layer, ...]
    attempts: tuple[Attempt, ...]

    @property
    def good(self) -> bool:
        """Whether all needed layers are good, and all needed attempts were contained."""
        return not list(self.failures())

    def failures(self) -> Iterator[IsolationError]:
        """Yield an error for each layer that is needed and missing, and for each attempt that broke out."""
        for layer in self.layers:
            if layer.needed and not layer.good:
                yield IsolationError(f"{layer.name}: {layer.state}", layer.name, layer.remedy)
        remedy = f"Do not grade here; run `{program.name()} doctor` and report what it shows."
        for attempt in self.attempts:
            if attempt.needed and not attempt.contained:
                message = f"The self-test broke out: {attempt.name}: {attempt.result}"
                yield IsolationError(message, attempt.name, remedy)

    def as_data(self) -> dict[str, Any]:
        """Return the state as plain data, for JSON."""
        return {"good": self.good, **asdict(self)}


def examine() -> IsolationState:
    """Return the state of the layers, and if all needed ones are good, of attempts to break out, made now."""
    isolation = IsolationState(tuple(selftest.layers()), ())
    return IsolationState(isolation.layers, tuple(selftest.attempts())) if isolation.good else isolation


def check() -> None:
    """Raise IsolationError unless students' code can be isolated here; the error names the layer and the remedy."""
    for error in examine().failures():
        raise error


def print_refusal(error: IsolationError) -> None:
    """Print for an instructor why nothing was graded."""
    from rich.console import Console
    from rich.markup import escape

    Console(stderr=True).print(_REFUSAL.format(error=escape(str(error)), program=program.name()))


def print_state(isolation: IsolationState) -> None:
    """Print the layers, what to do about those that are missing, and the attempts to break out."""
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    def state(good: bool, needed: bool) -> str:
        """Return the text in the column of the table that says whether a layer, or an attempt, is as it should be."""
        return "[green]good[/green]" if good else "[red]NO[/red]" if needed else "[yellow]missing (optional)[/yellow]"

    console = Console()
    table = Table("layer, or attempt to break out", "", "result", title="Isolation", title_justify="left")
    for layer in isolation.layers:
        table.add_row(layer.name, state(layer.good, layer.needed), Text(layer.state))
    table.add_section()
    for attempt in isolation.attempts:
        table.add_row(attempt.name, state(attempt.contained, attempt.needed), Text(attempt.result))
    console.print(table)
    for layer in isolation.layers:
        if not layer.good and layer.remedy:
            console.print(f"{layer.name}: {layer.remedy}", markup=False, style="red" if layer.needed else None)
    console.print(
        "Students' code can be run in isolation here."
        if isolation.good
        else "Students' code cannot be run in isolation here: nothing is graded."
    )
