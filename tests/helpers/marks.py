"""Which markers a test bears, by what it uses: nobody has to remember. (`slow` is given by hand, but for folders.)"""

import atexit
import os
import shutil
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from types import ModuleType

import pytest
from checkout import ROOT

#: A fixture → the marker of tests that use it, be it by way of another fixture.
BY_FIXTURE = {"sandbox": "isolation", "server": "postgres", "chromium": "browser", "jupyterlab": "browser"}
#: A helper → the marker of all tests of a module that imports it, or something from it.
BY_HELPER = {"browser": "browser", "hostile_outside": "isolation"}
#: A folder → the marker of all tests in it.
BY_FOLDER = {"tests/whole": "slow"}
#: A program → the marker of tests that may start it; for all others it is as if it did not work.
PROGRAMS = {"bwrap": "isolation", "initdb": "postgres", "chromium": "browser"}


def imported_from(module: ModuleType) -> set[str]:
    """Modules that a module has something of."""
    values = vars(module).values()
    return {value.__name__ if isinstance(value, ModuleType) else getattr(value, "__module__", "") for value in values}


def earned(item: pytest.Item) -> set[str]:
    """The markers that a test has to bear for what it uses."""
    helpers = imported_from(item.module) if isinstance(item, pytest.Function) else set()
    fixtures = set(getattr(item, "fixturenames", ()))
    found = {marker for name, marker in BY_FIXTURE.items() if name in fixtures}
    found |= {marker for name, marker in BY_HELPER.items() if name in helpers}
    return found | {marker for name, marker in BY_FOLDER.items() if item.path.is_relative_to(ROOT / name)}


def withheld(item: pytest.Item) -> list[str]:
    """The programs that a test may not start."""
    return [program for program, marker in PROGRAMS.items() if not item.get_closest_marker(marker)]


@cache
def refusing(program: str) -> Path:
    """A folder with a program of this name that does nothing but say why."""
    folder = Path(tempfile.mkdtemp(prefix="rotflex-refusing-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    script = folder / program
    script.write_text(f"#!/bin/sh\necho '{program}: a test needs the marker {PROGRAMS[program]}' >&2\nexit 97\n")
    script.chmod(0o755)
    return folder


@contextmanager
def without(programs: Sequence[str]) -> Iterator[None]:
    """Within the ``with`` block, nothing that is started here or below finds these programs."""
    before = os.environ["PATH"]
    os.environ["PATH"] = os.pathsep.join([*(str(refusing(program)) for program in programs), before])
    try:
        yield
    finally:
        os.environ["PATH"] = before
