"""What several versions cost: one whole folder, and eleven that were handed in week by week, graded from nothing.

    python benchmarks/versions.py --repeats 3

In week k the first k notebooks are done as in the solutions, and the others are as they were handed out, so that only
later notebooks change. Processor time is that of the whole command, with all that it starts. Ratios are taken within a
repeat; the median is shown.
"""

from __future__ import annotations

import argparse
import os
import resource
import shutil
import tempfile
from pathlib import Path
from statistics import median

from classes import WHOLE, environment, grade, grade_command, hand_in, small_course

from labcourse.grading import course as courses
from labcourse.grading.release import student_course

WEEK = 7 * 24 * 3600  # s
FIRST = 1_800_000_000  # s since 1970, in 2027


def weekly_folders(source: Path, scratch: Path) -> tuple[Path, Path]:
    """Make the submissions of one student: the whole folder once, and as it grew, week by week."""
    once, weekly = scratch / "once", scratch / "weekly"
    (student,) = hand_in(source, once, 1)
    stubs = student_course.derive_notebooks(courses.load(source))
    for week in range(1, len(stubs) + 1):
        folder = weekly / f"{student} ({week})"
        shutil.copytree(once / student, folder)
        for name in sorted(stubs)[week:]:
            (folder / name).write_text(stubs[name], encoding="utf-8")
        for path in folder.iterdir():
            os.utime(path, (FIRST + week * WEEK,) * 2)
    return once, weekly


def processor_seconds(source: Path, submissions: Path, scratch: Path) -> float:
    """Grade into a new folder, and return the processor time that it took, s."""
    with tempfile.TemporaryDirectory(dir=scratch) as out:
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        grade(grade_command(source, submissions, Path(out) / "out", 1), environment(scratch))
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def main() -> None:
    """Measure, and print each repeat and the median of the ratios."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--smoke", action="store_true", help="once, with a course of two notebooks")
    given = parser.parse_args()
    ratios = []
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        source = small_course(folder / "course") if given.smoke else WHOLE
        once, weekly = weekly_folders(source, folder)
        for _repeat in range(1 if given.smoke else given.repeats):
            one, all_ = (processor_seconds(source, submissions, folder) for submissions in (once, weekly))
            ratios.append(all_ / one)
            print(f"once {one:.1f} s, week by week {all_:.1f} s: {ratios[-1]:.2f} times", flush=True)
    print(f"median: {median(ratios):.2f} times")


if __name__ == "__main__":
    main()
