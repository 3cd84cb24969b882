"""What single slips cost, as a table: points lost automatically, own and besides, and the reason that is told.

    python benchmarks/slips.py [PATTERN] [--smoke]

One line of Markdown for each slip of ``tests/helpers/single_slips.py`` whose name has the pattern.
"""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Sequence
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "tests" / "helpers")]

from single_slip_marks import answers_with, lost_by  # noqa: E402
from single_slips import SLIPS, Slip  # noqa: E402


def line(slip: Slip) -> tuple[float, str]:
    """What a slip costs, and its row."""
    lost = lost_by(answers_with(slip))
    own, told = lost.get(slip.where, (0.0, "nothing: it earned all of its points"))
    total = sum(points for points, _told in lost.values())
    whys = dict.fromkeys(why for at, (_points, why) in slip.besides.items() if at in lost)
    besides = f"{total - own:g}: {'; '.join(whys) or 'not expected'}" if total > own else "0"
    acts = "yes" if re.search(slip.told, told) else "no"
    return total, f"| {slip.name} | {own:g} | {besides} | {told} | {acts} |"


def run(slips: Sequence[Slip]) -> None:
    """Print the table."""
    print(
        "| slip | own points | besides, as a person would | reason told | names what to look at |",
        "|---|---|---|---|---|",
        sep="\n",
    )
    costs = []
    for slip in slips:
        total, row = line(slip)
        costs.append(total)
        print(row, flush=True)
    most, many = max(costs, default=0), sum(points > 4 for points in costs)
    print(f"\n{len(costs)} slips; at most {most:g} points, {many} of them more than 4.")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("pattern", nargs="?", default="")
    parser.add_argument("--smoke", action="store_true", help="the first alone")
    asked = parser.parse_args()
    chosen = [slip for slip in SLIPS if re.search(asked.pattern, slip.name)]
    run(chosen[:1] if asked.smoke else chosen)
