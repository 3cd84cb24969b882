"""How a batch is going: on the screen, or as lines of JSON for scripts."""

from __future__ import annotations

import json
import sys
from abc import ABC
from contextlib import AbstractContextManager

from labcourse import program
from labcourse.grading.accounts import points
from labcourse.grading.gradebook import Graded
from labcourse.grading.reports.changes import HANDED_IN_AGAIN, Changes
from labcourse.grading.reports.result import lapse, sums
from labcourse.problems import Reason
from labcourse.safe_text import no_escapes
from labcourse.sentences import sentences

_MOST_ROWS = 60  # of the table at the end, and of students whose marks changed; a screen


class ProgressReport(AbstractContextManager["ProgressReport"], ABC):
    """Counts what is done.

    Parameters
    ----------
    total : number of submissions
    ignored : why files among them are not read
    absent : students who have not handed in anything

    Attributes
    ----------
    trouble : whether anything was ignored, or a run that was reported has problems
    """

    def __init__(self, total: int, ignored: list[Reason], absent: list[str]) -> None:
        self.total, self.ignored, self.absent = total, ignored, absent
        self.trouble = bool(ignored)
        self.counts = {"ran": 0, "known": 0, "failed": 0}

    def add(self, ran: bool, graded: Graded, changed: Changes | None = None) -> None:
        """Report one submission, whether it was run just now, and what changed for a student who had marks before."""
        self.counts["ran" if ran else "known"] += 1
        self.counts["failed"] += bool(graded.run.problems)
        self.trouble |= bool(graded.run.problems)


class JsonLines(ProgressReport):
    """An object a line on the standard output: one for each submission as it is done, one for all in the end."""

    def __enter__(self) -> JsonLines:
        for message in sentences(self.ignored):
            self._print(event="ignored", what=message)
        for student in self.absent:
            self._print(event="absent", student=student)
        return self

    def add(self, ran: bool, graded: Graded, changed: Changes | None = None) -> None:
        """Report one submission, whether it was run just now, and what changed for a student who had marks before."""
        super().add(ran, graded, changed)
        whole = sums(graded.marks)
        self._print(
            event="graded",
            student=graded.run.student,
            ran=ran,
            points=None if whole.is_not_graded else whole.earned or 0.0,
            out_of=whole.out_of,
            awaiting=whole.awaiting,
            not_marked=whole.not_marked,
            problems=sentences(graded.run.problems),
            lapsed=list(map(lapse, graded.lapsed)),
            **({} if changed is None else changed.as_data()),
            stamp=graded.run.isolation,
        )

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        self._print(event="interrupted" if kind else "done", **self.counts, total=self.total)

    @staticmethod
    def _print(**data: object) -> None:
        print(json.dumps(data), flush=True)


class Screen(ProgressReport):
    """A bar with what is done, what failed, and how long it will take; a table in the end."""

    def __init__(self, total: int, ignored: list[Reason], absent: list[str]) -> None:
        from rich.console import Console
        from rich.progress import Progress, TextColumn

        super().__init__(total, ignored, absent)
        # In a pipe or a log, lines are not cut.
        self._console = Console(width=None if sys.stdout.isatty() else 200, markup=False, highlight=False, emoji=False)
        counts = TextColumn("{task.completed} of {task.total}, {task.fields[counts]}")
        self._bar = Progress(*Progress.get_default_columns(), counts, console=self._console)
        self._lines: list[tuple[bool, str, str]] = []  # without problems, student, what is said
        self._lapsed: list[str] = []
        self._isolation = ""
        self._changed: list[Changes] = []
        self._task = self._bar.add_task("Grading", total=total, counts="")

    def __enter__(self) -> Screen:
        self._say(*sentences(self.ignored))
        self._bar.start()
        return self

    def add(self, ran: bool, graded: Graded, changed: Changes | None = None) -> None:
        """Report one submission, whether it was run just now, and what changed for a student who had marks before."""
        super().add(ran, graded, changed)
        run, whole = graded.run, sums(graded.marks)
        earned = f"{points(whole.earned or 0.0)} of {points(whole.out_of)} points"
        marks = "not graded" if whole.is_not_graded else earned
        waits = f", {points(whole.awaiting)} awaiting a person" if whole.awaiting else ""
        line = " ".join([f"{run.student}: {marks}{waits}.", *sentences(run.problems)])
        self._lines.append((not run.problems, run.student, line))  # and not the marks: the class may be large
        self._lapsed += [f"{run.student}, {lapse(given)}" for given in graded.lapsed]
        self._isolation = run.isolation
        if changed is not None and changed.why != HANDED_IN_AGAIN:
            self._changed.append(changed)
        counts = "{ran} run, {known} known, {failed} with trouble".format(**self.counts)
        self._bar.update(self._task, advance=1, counts=counts)

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        self._bar.stop()
        self._marks()
        changed = sorted(self._changed, key=lambda one: one.student)
        self._say(*map(str, changed[:_MOST_ROWS]))
        if more := changed[_MOST_ROWS:]:
            self._say(f"The marks of {len(more)} more changed: {program.name()} history shows them.")
        self._say(*self._lapsed)
        if self.absent:
            self._say(f"Nothing handed in this term: {', '.join(self.absent)}")
        if kind is not None:
            self._say("What is graded is in the gradebook: the same command goes on from here.")

    def _say(self, *lines: str) -> None:
        for line in lines:
            self._console.print(no_escapes(line), soft_wrap=True)

    def _marks(self) -> None:
        """Print points and problems; in a large class those with problems come first, and the rest is in grades.csv."""
        lines = sorted(self._lines, key=lambda line: line[1:])
        if len(lines) > _MOST_ROWS:
            lines.sort(key=lambda line: line[0])
        self._say(*(line for *_order, line in lines[:_MOST_ROWS]))
        if more := lines[_MOST_ROWS:]:
            self._say(f"and {len(more)} more, in grades.csv")
        self._say(*filter(None, [self._isolation]))
