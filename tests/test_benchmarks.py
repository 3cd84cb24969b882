"""Each benchmark runs, in its smallest form."""

from __future__ import annotations

import subprocess
import sys

import pytest
from checkout import ROOT

PARTS = {"classes", "contenders", "memory", "plain_python"}  # of others, which run them
MARKS = {
    "class_of_300": pytest.mark.usefixtures("sandbox"),
    "explorers": pytest.mark.browser,
    "grading": pytest.mark.usefixtures("sandbox"),
    "honest": pytest.mark.usefixtures("sandbox"),
}
WHOLE = {"check"}  # has no smaller form than the course
PROGRAMS = sorted({path.stem for path in (ROOT / "benchmarks").glob("*.py")} - PARTS)


@pytest.mark.scheduled
@pytest.mark.parametrize("name", [pytest.param(name, marks=MARKS.get(name, ())) for name in PROGRAMS])
def test_a_benchmark_runs_and_prints_figures(name):
    command = [sys.executable, ROOT / "benchmarks" / f"{name}.py", *(["--smoke"] if name not in WHOLE else [])]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert any(character.isdigit() for character in done.stdout)
