"""A grader that is killed again and again, and what its gradebook is worth then.

    python benchmarks/crash.py [--size 40] [--kills 20] [--longest 12]

Grades a class once without disturbance and once killed by SIGKILL at random moments, and compares the gradebooks:
all that is in them, but for times and the secret. Prints whether they are equal.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests" / "helpers"))
import small_class


def main() -> int:
    """0 if the gradebooks are equal."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--size", type=int, default=40)
    parser.add_argument("--kills", type=int, default=20)
    parser.add_argument("--longest", type=float, default=12.0, help="seconds until a kill, at most")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="rotflex-crash-", ignore_cleanup_errors=True) as scratch:
        folder = Path(scratch)
        source = small_class.course(folder / "course")
        small_class.hand_in(source, folder / "submissions", options.size)
        started = time.perf_counter()
        words = small_class.command(source, folder / "submissions", folder / "undisturbed", "--jobs", "2")
        subprocess.run(words, check=False, stdout=subprocess.DEVNULL)
        undisturbed = time.perf_counter() - started
        (folder / "scratch").mkdir()
        words = small_class.command(source, folder / "submissions", folder / "killed", "--jobs", "2")
        started = time.perf_counter()
        small_class.killed_and_resumed(words, options.kills, options.longest, options.seed, folder / "scratch")
        disturbed = time.perf_counter() - started
        equal = small_class.contents(folder / "killed") == small_class.contents(folder / "undisturbed")
    print(
        f"{options.size} submissions: {undisturbed:.0f} s undisturbed; killed {options.kills} times: {disturbed:.0f} s"
    )
    print("the gradebooks are equal" if equal else "THE GRADEBOOKS DIFFER")
    return 0 if equal else 1


if __name__ == "__main__":
    sys.exit(main())
