"""How long a student waits for a check of the whole course, with the warm process and in kernels.

    python benchmarks/check.py [FOLDER]

The course's notebooks with solutions are taken as a student's, in a new folder, or a student's own are in the one that
is named. Each way runs in turn, as the command ``rotflex check`` does. Besides the wall times it shows the processor
times and, of both, the ratio of the kernels to the warm process, which depends less on how busy the computer is.
"""

from __future__ import annotations

import argparse
import os
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
_PROGRAM = """
import sys
from labcourse.run import execute, warm
from rotflex import cli
warm.CAN_FORK = warm.CAN_FORK and {warm}
sys.argv[1:] = ["check", {folder!r}]
cli.run()
"""


def fill(folder: Path) -> None:
    """Fill a student's folder, with every question answered."""
    for path in sorted((ROOT / "solutions").glob("[0-9]*.ipynb")):
        shutil.copyfile(path, folder / path.name)
    (folder / "course.json").write_text('{"student": "ada"}\n', encoding="utf-8")


def check(folder: Path, warm: bool) -> tuple[float, float]:
    """Check a folder; return wall and processor time, s."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "LABCOURSE_RUNNING": ""}
    before, begun = _used(), time.perf_counter()
    program = _PROGRAM.format(warm=warm, folder=str(folder))
    command = [sys.executable, "-P", "-c", program]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    times = time.perf_counter() - begun, _used() - before
    if done.returncode != 0:
        print(f"exit code {done.returncode}\n{done.stdout}{done.stderr}")
    return times


def _used() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, nargs="?")
    asked = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="rotflex-benchmark-") as scratch:
        folder = asked.folder or Path(scratch)
        if asked.folder is None:
            fill(folder)
        print(f"{os.cpu_count()} processors; load before: {os.getloadavg()[0]:.1f}", flush=True)
        warm, kernels = (check(folder, is_warm) for is_warm in (True, False))
    print(f"{'':24}{'wall, s':>10}{'processor, s':>14}")
    for name, (wall, used) in {"warm process": warm, "kernels": kernels}.items():
        print(f"{name:24}{wall:10.1f}{used:14.1f}")
    print(f"{'kernels to warm process':24}{kernels[0] / warm[0]:10.2f}{kernels[1] / warm[1]:14.2f}")


if __name__ == "__main__":
    main()
