"""Run every check, and fail if one fails: style, types, imports, size, house rules, scripts, tests, solutions.

    python tools/run_tests.py [--quick | --all] [PYTEST OPTIONS ...]

``--quick`` leaves out the tests that take long or need more than Python, and the solution notebooks, and says so.
``--all`` adds the tests that need a package which ``make test-all`` installs for them. Tests are shared among as many
processes as there are processors, up to four; ``-n 0`` runs them in one. pytest's closing line comes last.
"""

from __future__ import annotations

import os
import subprocess
import sys
import sysconfig
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PYTHON = sys.executable
SCRIPTS = Path(sysconfig.get_path("scripts"))

LEFT_OUT = ("slow", "isolation", "browser", "postgres")  #: markers of tests that a quick run does without
SCHEDULED = "scheduled"  #: marker of tests that only --all runs
SHARED = ("-n", "logical", "--maxprocesses", "4")
#: Title → command.
STATIC = {
    "style": (PYTHON, "-m", "ruff", "check", "."),
    "format": (PYTHON, "-m", "ruff", "format", "--check", "."),
    "types": (PYTHON, "-m", "mypy"),
    "imports": (str(SCRIPTS / "lint-imports"), "--no-logo"),
    "size": (PYTHON, "tools/count_lines.py"),
    "house rules": (PYTHON, "tools/lint_house.py"),
    "scripts of the explorers": (PYTHON, "tools/check_scripts.py"),
}
ALL_TESTS = ("--nbval", "tests", "solutions")
USUAL_TESTS = (*ALL_TESTS, "-m", f"not {SCHEDULED}")
QUICK = f"not ({' or '.join((*LEFT_OUT, SCHEDULED))})"
QUICK_TESTS = ("tests", "-q", "-m", QUICK, "--durations=5", "--durations-min=1")


def run(title: str, command: Sequence[str], environment: Mapping[str, str]) -> bool:
    """Run one check; say so if it fails."""
    print(f"== {title}", flush=True)
    good = subprocess.run(command, cwd=ROOT, check=False, env=environment).returncode == 0
    if not good:
        print(f"FAILED: {title}", flush=True)
    return good


def environment(folder: str) -> dict[str, str]:
    """No progress bars in outputs that are compared, and none of a user's own settings of IPython.

    Each process computes in one thread: there are as many processes as processors already.
    """
    threads = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
    return os.environ | {"ROTFLEX_PROGRESS": "off", "IPYTHONDIR": folder, **threads}


def main(options: list[str]) -> int:
    """All checks, in order; 0 if all are good."""
    quick, everything = "--quick" in options, "--all" in options
    options = [option for option in options if option not in ("--quick", "--all")]
    with tempfile.TemporaryDirectory() as folder:
        variables = environment(folder)
        checks = [run(title, command, variables) for title, command in STATIC.items()]
        if quick:
            print(f"== left out: the solution notebooks, and tests that are {', '.join(LEFT_OUT)}; make test runs them")
        tests = QUICK_TESTS if quick else ALL_TESTS if everything else USUAL_TESTS
        title = "quick tests" if quick else "tests and solution notebooks"
        checks.append(run(title, (PYTHON, "-u", "-m", "pytest", *SHARED, *tests, *options), variables))
    return 0 if all(checks) else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
