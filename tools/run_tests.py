"""Run every check, and fail if one fails: style, types, unit tests, and the solution notebooks against their outputs.

    python tools/run_tests.py [PYTEST OPTIONS ...]

pytest's closing line comes last.
"""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PYTHON = sys.executable


def run(title: str, *command: str) -> bool:
    """Run one check; say so if it fails."""
    print(f"== {title}", flush=True)
    good = subprocess.run([PYTHON, "-m", *command], cwd=ROOT, check=False, env=environment()).returncode == 0
    if not good:
        print(f"FAILED: {title}", flush=True)
    return good


def environment() -> dict[str, str]:
    """No progress bars in outputs that are compared, and none of a user's own settings of IPython."""
    return os.environ | {"ROTFLEX_PROGRESS": "off", "IPYTHONDIR": str(ROOT / ".venv" / "ipython")}


def main(options: list[str]) -> int:
    """All checks, in order; 0 if all are good."""
    # The solution notebooks start from no answers, as a student does.
    (ROOT / "solutions" / "answers.json").unlink(missing_ok=True)
    checks = [
        run("style", "ruff", "check", "."),
        run("format", "ruff", "format", "--check", "."),
        run("types", "mypy"),
        run("tests and solution notebooks", "pytest", "--nbval", "tests", "solutions", *options),
    ]
    return 0 if all(checks) else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
