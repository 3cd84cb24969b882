"""The honest class as a whole: graded in isolation, and each hand-in that is a folder checked as its student would.

    python benchmarks/honest.py [NAME ...] [--smoke]

Prints what is not as it should be: marks, what is told, and where a check at home differs from grading. In the end, how
many there were, and how long a check took.
"""

from __future__ import annotations

import argparse
import os
import statistics
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "tests" / "helpers")]

from honest_checks import Seen, at_home, students_installation, when_graded  # noqa: E402
from honest_class import RIGHT, WAYS, solved_notebooks  # noqa: E402
from honest_hand_in import Way  # noqa: E402
from honest_marks import Graded, grade  # noqa: E402

from labcourse.grading.gradebook import Gradebook  # noqa: E402

CELL_TIMEOUT = 20  # s
AT_A_TIME = os.cpu_count() or 1


def judged(way: Way, graded: Graded) -> list[str]:
    """What is not as it should be of a way's marks."""
    marks, found = graded.of(way.student), []
    lost = set(marks.lost) - way.lost
    if lost or (way in RIGHT and (marks.problems or not marks.marks)):
        found.append(f"{way.student}: lost {sorted(lost)}, told {marks.problems}")
    return [*found, *(f"not told: {pattern}" for pattern in graded.not_told(way))]


def compared(way: Way, home: Seen, there: Seen) -> list[str]:
    """Where a check and grading differ."""
    found = []
    if home.recorded != there.recorded:
        found.append(
            f"recorded at home only {sorted(home.recorded - there.recorded)}, "
            f"there only {sorted(there.recorded - home.recorded)}"
        )
    if home.stops != there.stops:
        found.append(f"said at home only {sorted(home.stops - there.stops)}, there {sorted(there.stops - home.stops)}")
    return found


def run(ways: list[Way], place: Path) -> None:
    """Grade, check, compare, print."""
    graded = grade(ways, solved_notebooks(ROOT), place, "--jobs", "2", "--cell-timeout", str(CELL_TIMEOUT))
    home = students_installation(place / "course")
    folders = [way for way in ways if any((place / "in" / way.student).glob("*.ipynb"))]

    def look(way: Way) -> Seen:
        return at_home(place / "in" / way.student, way.student, home, CELL_TIMEOUT)

    wrong = [f"{way.name}: {line}" for way in ways for line in judged(way, graded)]
    differ, seconds = [], []
    with Gradebook(place / "book.sqlite") as book, ThreadPoolExecutor(AT_A_TIME) as pool:
        for way, seen in zip(folders, pool.map(look, folders), strict=True):
            seconds.append(seen.seconds)
            differ += [f"{way.name}: {line}" for line in compared(way, seen, when_graded(book, way.student))]
    print(
        f"{len(ways)} graded, {len({one.partition(':')[0] for one in wrong})} not as they should be", *wrong, sep="\n  "
    )
    print(f"{len(folders)} checked, {len({one.partition(':')[0] for one in differ})} differ", *differ, sep="\n  ")
    print(f"a check, {AT_A_TIME} at a time: median {statistics.median(seconds):.1f} s, longest {max(seconds):.1f} s")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*")
    parser.add_argument("--smoke", action="store_true", help="one way alone, handed in as a folder")
    asked = parser.parse_args()
    chosen = [way for way in WAYS if not asked.names or way.name in asked.names]
    if asked.smoke:
        chosen = [way for way in chosen if way in RIGHT][:1]
    with tempfile.TemporaryDirectory(prefix="rotflex-benchmark-") as scratch:
        run(chosen, Path(scratch).resolve())
