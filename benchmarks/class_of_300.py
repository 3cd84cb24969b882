"""How grading fares as the class grows: time, memory, and what a second run costs.

    python benchmarks/class_of_300.py 60 150 300

Classes of these sizes hand in a small assignment (notebooks 00 and 02), each student with code and a bench of their
own. Each class is graded by `rotflex grade --jobs 2` from nothing, and then once more: nothing may be run again. What
should be flat is shown as a ratio to the smallest class. Memory is proportional set size, looked at in the same run;
the processor time that looking takes is small, and shown.
"""

from __future__ import annotations

import argparse
import os
import shutil
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

from classes import Graded, environment, grade, grade_command, hand_in, small_course
from memory import ITSELF, TOTAL, Peaks

from labcourse.grading import course as courses
from labcourse.grading.release import student_course

INTERVAL = 0.5  # s between two looks at the memory


@dataclass(frozen=True)
class Row:
    """A class: its size, its first run and its second, and the size of its gradebook, bytes."""

    size: int
    first: Graded
    again: Graded
    gradebook: int

    @property
    def peaks(self) -> Peaks:
        """Of the first run's memory."""
        assert self.first.peaks is not None
        return self.first.peaks


def measured(course: Path, scratch: Path, size: int, jobs: int) -> Row:
    """Grade a class twice.

    Raises
    ------
    RuntimeError
        If not everybody was run the first time, or anybody the second time.
    """
    submissions, out = scratch / "submissions", scratch / "out"
    hand_in(course, submissions, size)
    command = grade_command(course, submissions, out, jobs)
    first = grade(command, environment(scratch), INTERVAL)
    again = grade(command, environment(scratch))
    if (first.ran, again.ran, again.known) != (size, 0, size):
        raise RuntimeError(f"Of {size}, {first.ran} were run, then {again.ran}; {again.known} were known.")
    return Row(size, first, again, (out / "gradebook.sqlite").stat().st_size)


def show(rows: list[Row], count: int) -> None:
    """Print the tables.

    Parameters
    ----------
    rows : a class each
    count : notebooks in a submission
    """
    smallest = rows[0]

    def cost(row: Row) -> float:
        return row.first.seconds / (row.size * count)

    def resumed(row: Row) -> float:
        return row.again.seconds / row.size

    print(f"\n{'class':>6}{'wall, s':>10}{'first result, s':>17}{'s a notebook':>14}{'ratio':>7}", end="")
    print(f"{'all, MB':>10}{'ratio':>7}{'grader, MB':>12}{'ratio':>7}")
    for row in rows:
        print(f"{row.size:6}{row.first.seconds:10.1f}{row.first.first:17.1f}", end="")
        print(f"{cost(row):14.3f}{cost(row) / cost(smallest):7.2f}", end="")
        for what in (TOTAL, ITSELF):
            ratio = row.peaks[what] / smallest.peaks[what]
            print(f"{row.peaks.megabytes(what):{10 if what == TOTAL else 12}.0f}{ratio:7.2f}", end="")
        print()
    print(f"\n{'class':>6}{'again, s':>10}{'of the first':>14}{'ms a submission':>17}{'ratio':>7}{'gradebook, MB':>15}")
    for row in rows:
        print(f"{row.size:6}{row.again.seconds:10.1f}{row.again.seconds / row.first.seconds:14.1%}", end="")
        print(f"{resumed(row) * 1e3:17.1f}{resumed(row) / resumed(smallest):7.2f}{row.gradebook / 1e6:15.1f}")
    looked = max(row.first.looking / row.first.seconds for row in rows)
    print(f"\nlooking at the memory took {looked:.1%} of a processor's time at most")


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sizes", type=int, nargs="*", default=[60, 150, 300], metavar="SIZE")
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--smoke", action="store_true", help="classes of one and of two")
    asked = parser.parse_args()
    warming, sizes = (1, [2]) if asked.smoke else (2, sorted(asked.sizes))
    print(f"{asked.jobs} jobs on {os.cpu_count()} processors; load before: {os.getloadavg()[0]:.1f}", flush=True)
    rows = []
    with tempfile.TemporaryDirectory(prefix="rotflex-benchmark-") as scratch:
        course = small_course(Path(scratch) / "course")
        count = len(student_course.derive_notebooks(courses.load(course)))
        for size in (warming, *sizes):  # the first one only to warm up the caches
            folder = Path(scratch) / str(size)
            folder.mkdir()
            rows.append(measured(course, folder, size, asked.jobs))
            shutil.rmtree(folder)
            print(f"{size}: {rows[-1].first.seconds:.1f} s", file=sys.stderr, flush=True)
    show(rows[1:], count)


if __name__ == "__main__":
    main()
