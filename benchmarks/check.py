"""How long a student waits for `rotflex check`: the whole course, with all of its questions answered.

    python benchmarks/check.py [FOLDER]

The course's notebooks with solutions are taken as a student's, in a new folder, or a student's own are in the one that
is named. Besides the wall time of the command it shows that of each notebook, and the processor time of all that was
started.
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


def fill(folder: Path) -> None:
    """Fill a student's folder, with every question answered."""
    for path in sorted((ROOT / "solutions").glob("[0-8]*.ipynb")):
        shutil.copyfile(path, folder / path.name)
    (folder / "course.json").write_text('{"student": "ada"}\n', encoding="utf-8")


def check(folder: Path) -> int:
    """Check it, print how long it took, and return the exit code."""
    command = [sys.executable, "-P", "-m", "rotflex.cli", "check", str(folder)]
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "PYTHONUNBUFFERED": "1"}
    begun = latest = time.perf_counter()
    running = ""
    with subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, text=True) as child:
        assert child.stdout is not None
        said = []
        for line in child.stdout:
            now = time.perf_counter()
            if line.startswith("Running ") or (running and not line.strip()):
                print(f"{running or 'until the first kernel is ready':<34}{now - latest:6.1f} s")
                running, latest = line.rpartition(" ")[2].strip(), now
            else:
                said.append(line)
    wall = time.perf_counter() - begun
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    print(f"{'all':<34}{wall:6.1f} s, {used.ru_utime + used.ru_stime:.1f} s of processor time, of {os.cpu_count()}")
    print(f"exit code {child.returncode}")
    print("".join(said))
    return child.returncode


def main() -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, nargs="?")
    asked = parser.parse_args()
    if asked.folder is not None:
        return check(asked.folder)
    with tempfile.TemporaryDirectory(prefix="rotflex-benchmark-") as scratch:
        fill(Path(scratch))
        return check(Path(scratch))


if __name__ == "__main__":
    sys.exit(main())
