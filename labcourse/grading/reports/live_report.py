"""How a batch is going: on the screen, or as lines of JSON for scripts."""

from __future__ import annotations

import json
import sys
from types import TracebackType

from labcourse import program
from labcourse.grading.reports.changes import HANDED_IN_AGAIN, Changes
from labcourse.grading.reports.result import Result, lapse, points
from labcourse.safe_text import no_escapes

_MOST_ROWS = 60  # of the table at the end; of students whose marks changed, too; a screen


class ProgressReport:
    """Counts what is done.

    Parameters
    ----------
    total : submissions that there are
    ignored : messages on what lies among them and is none
    absent : students who have not handed in anything

    Attributes
    ----------
    trouble : whether something was not as it should be
    """

    def __init__(self, total: int, ignored: list[str], absent: list[str]) -> None:
        self.total = total
        self.ignored, self.absent = ignored, absent
        self.trouble = bool(ignored)
        self.ran = self.known = self.failed = 0

    def __enter__(self) -> ProgressReport:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: object, trace: TracebackType | None) -> None:
        pass

    def add(self, ran: bool, result: Result, changed: Changes | None = None) -> None:
        """Note one submission, whether it was run just now, and what changed for a student who had marks before."""
        self.ran += ran
        self.known += not ran
        self.failed += bool(result.problems)
        self.trouble |= bool(result.problems)


class JsonLines(ProgressReport):
    """An object a line on the standard output: one for each submission as it is done, one for all in the end."""

    def __enter__(self) -> JsonLines:
        for message in self.ignored:
            self._print({"event": "ignored", "what": message})
        for student in self.absent:
            self._print({"event": "absent", "student": student})
        return self

    def add(self, ran: bool, result: Result, changed: Changes | None = None) -> None:
        """Note one submission, whether it was run just now, and what changed for a student who had marks before."""
        super().add(ran, result, changed)
        self._print(
            {
                "event": "graded",
                "student": result.student,
                "ran": ran,
                "points": None if result.not_graded else result.total,
                "out_of": result.out_of,
                "awaiting": result.awaiting,
                "not_marked": result.not_marked,
                "problems": result.problems,
                "lapsed": list(map(lapse, result.lapsed)),
                **({} if changed is None else {"why": changed.why, "changes": changed.as_data()["changes"]}),
                "stamp": result.stamp,
            }
        )

    def __exit__(self, kind: type[BaseException] | None, error: object, trace: TracebackType | None) -> None:
        counts = {"ran": self.ran, "known": self.known, "failed": self.failed, "total": self.total}
        self._print({"event": "interrupted" if kind else "done", **counts})

    @staticmethod
    def _print(data: dict[str, object]) -> None:
        print(json.dumps(data), flush=True)


class Screen(ProgressReport):
    """A bar that tells what is done, what failed, and how long it will take; a table in the end."""

    def __init__(self, total: int, ignored: list[str], absent: list[str]) -> None:
        from rich.console import Console
        from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn
        from rich.progress import TimeRemainingColumn as TimeLeft

        super().__init__(total, ignored, absent)
        # In a pipe or a log, lines are not cut.
        self._console = Console(width=None if sys.stdout.isatty() else 200)
        self._bar = Progress(
            TextColumn("Grading"),
            BarColumn(),
            MofNCompleteColumn(),
            TextColumn("{task.fields[counts]}"),
            TimeElapsedColumn(),
            TextColumn("left"),
            TimeLeft(),
            console=self._console,
        )
        self._results: list[Result] = []
        self._changed: list[Changes] = []

    def __enter__(self) -> Screen:
        for message in self.ignored:
            self._console.print(no_escapes(message), style="yellow", markup=False)
        self._bar.start()
        self._task = self._bar.add_task("", total=self.total, counts="")
        return self

    def add(self, ran: bool, result: Result, changed: Changes | None = None) -> None:
        """Note one submission, whether it was run just now, and what changed for a student who had marks before."""
        super().add(ran, result, changed)
        self._results.append(result)
        if changed is not None and changed.why != HANDED_IN_AGAIN:
            self._changed.append(changed)
        counts = f"{self.ran} run, {self.known} known, {self.failed} with trouble"
        self._bar.update(self._task, advance=1, counts=counts)

    def __exit__(self, kind: type[BaseException] | None, error: object, trace: TracebackType | None) -> None:
        self._bar.stop()
        if self._results:
            self._table()
        self._marked_again()
        for result in self._results:
            for given in result.lapsed:
                self._say(f"{result.student}, {lapse(given)}")
        if self.absent:
            self._say(f"Nothing handed in: {', '.join(self.absent)}")
        if kind is not None:
            self._console.print("What is graded is in the gradebook: the same command goes on from here.")

    def _say(self, words: str) -> None:
        self._console.print(no_escapes(words), markup=False, highlight=False, soft_wrap=True)

    def _marked_again(self) -> None:
        """What changed for those who did nothing for it."""
        for one in sorted(self._changed, key=lambda one: one.student)[:_MOST_ROWS]:
            self._say(str(one))
        if len(self._changed) > _MOST_ROWS:
            self._say(
                f"The marks of {len(self._changed) - _MOST_ROWS} more changed: {program.name()} history shows them."
            )

    def _table(self) -> None:
        from rich.table import Table
        from rich.text import Text

        results = sorted(self._results, key=lambda result: result.student)
        table = Table(title="Marks")
        table.add_column("student")
        table.add_column("points", justify="right")  # question by question they are in grades.csv
        table.add_column("awaiting", justify="right")
        table.add_column("trouble")
        # In a large class, those with trouble come first, and the rest is in grades.csv.
        shown = results
        if len(results) > _MOST_ROWS:
            shown = sorted(results, key=lambda one: not one.problems)[:_MOST_ROWS]
        for result in shown:
            # Text: what looks like markup in a name or a message is none.
            table.add_row(
                Text(no_escapes(result.student)),
                "not graded" if result.not_graded else f"{points(result.total)} of {points(result.out_of)}",
                points(result.awaiting) if result.awaiting else "",
                Text(no_escapes("\n".join(result.problems))),
            )
        self._console.print(table)
        if len(shown) < len(results):
            self._console.print(f"and {len(results) - len(shown)} more, in grades.csv")
        self._console.print(results[0].stamp, markup=False)
