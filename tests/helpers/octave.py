"""A real Octave, which saves and reads files for tests."""

import shutil
import subprocess
from functools import cache
from pathlib import Path

import pytest

OCTAVE = shutil.which("octave-cli") or shutil.which("octave")


@cache
def why_not() -> str:
    """Why Octave cannot be used here; "" if it can."""
    if OCTAVE is None:
        return "Octave is not installed: apt-get install octave"
    done = subprocess.run([OCTAVE, "--version"], capture_output=True, text=True, check=False)
    return "" if done.returncode == 0 else f"Octave does not start: {done.stderr.strip()[-200:]}"


def octave(program: str, folder: Path) -> str:
    """What a program prints that is run in a folder; the test is skipped where there is no Octave."""
    if why_not():
        pytest.skip(why_not())
    done = subprocess.run(
        [str(OCTAVE), "--no-gui", "--no-window-system", "--norc", "--quiet", "--eval", program],
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout
