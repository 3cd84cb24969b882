"""Run every check, and fail if one fails: style, types, imports, size, house rules, scripts, tests, solutions.

    python tools/run_tests.py [--quick | --all | --versions] [PYTEST OPTIONS ...]

``--quick`` leaves out the tests that take long or need more than Python, and the solution notebooks, and says so.
``--all`` adds the tests marked ``scheduled`` and those of ``contrib``, which must be installed, and draws other random
examples each time. ``--versions`` is for other versions of the libraries: it runs the quick tests and the solution
notebooks (outputs may differ), no static check.
Tests are shared among as many processes as there are processors, up to four; ``-n 0`` runs them in one.
``--record-seconds`` writes ``tests/durations.json``, by which tests are put in order; give it to a whole run on a
quiet machine.

Static checks run beside the tests. What they say is printed after the tests; pytest's closing line comes last.
"""

from __future__ import annotations

import os
import subprocess
import sys
import sysconfig
import tempfile
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

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
CONTRIB = {"types of contrib": (PYTHON, "-m", "mypy", "contrib/serial/rotflex_serial", "contrib/rig/rotflex_rig")}
ALL_TESTS = ("--nbval", "tests", "solutions", "contrib/serial/tests", "contrib/rig/tests", "--hypothesis-profile=all")
USUAL_TESTS = ("--nbval", "tests", "solutions", "-m", f"not {SCHEDULED}")
QUICK = f"not ({' or '.join((*LEFT_OUT, SCHEDULED))})"
QUICK_TESTS = ("tests", "-q", "--quick", "-m", QUICK)
VERSIONS_TESTS = (*QUICK_TESTS, "--nbval-lax", "solutions")


class StaticChecks:
    """Checks that run in processes of their own while pytest, whose plugin this is, runs the tests."""

    def __init__(self, commands: Mapping[str, Sequence[str]]) -> None:
        self.failed: list[str] = []
        pool = ThreadPoolExecutor(len(STATIC))
        self._running = {title: pool.submit(self._run, command) for title, command in commands.items()}

    @staticmethod
    def _run(command: Sequence[str]) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            command, cwd=ROOT, text=True, check=False, stdout=subprocess.PIPE, stderr=subprocess.STDOUT
        )

    def report(self) -> None:
        """Wait for the checks, and print in order what each said; do nothing the second time."""
        running, self._running = self._running, {}
        for title, future in running.items():
            done = future.result()
            print(f"== {title}\n{done.stdout}".rstrip(), flush=True)
            if done.returncode:
                self.failed.append(title)
                print(f"FAILED: {title}", flush=True)

    def pytest_terminal_summary(self) -> None:
        """Report before pytest's closing line."""
        print()
        self.report()


def set_environment(folder: str) -> None:
    """Set what all checks and tests inherit.

    No progress bars in outputs that are compared, and none of a user's own settings of IPython. Each process computes
    in one thread: there are as many processes as processors already. Compiled modules are kept, even where Python is
    told not to: else each of some thousand processes compiles all of its modules anew.
    """
    threads = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
    os.environ.update({"TQDM_DISABLE": "1", "IPYTHONDIR": folder, **threads})
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
    sys.dont_write_bytecode = False


def main(options: list[str]) -> int:
    """Run all checks; 0 if all are good."""
    quick, everything, versions = (option in options for option in ("--quick", "--all", "--versions"))
    options = [option for option in options if option not in ("--quick", "--all", "--versions")]
    os.chdir(ROOT)
    with tempfile.TemporaryDirectory() as folder:
        set_environment(folder)
        if quick:
            print(
                f"== left out: the solution notebooks, tests that are {', '.join(LEFT_OUT)}, and those that took long "
                "when seconds were last recorded; make test runs them"
            )
        if not everything:
            print("== left out: contrib, which make test-all installs and tests")
        tests = QUICK_TESTS if quick else ALL_TESTS if everything else VERSIONS_TESTS if versions else USUAL_TESTS
        static = StaticChecks({} if versions else STATIC | CONTRIB if everything else STATIC)
        code = pytest.main([*SHARED, *tests, "--seconds-by-file", *options], plugins=[static])
        static.report()
    return 1 if code or static.failed else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
