"""Each benchmark runs, in its smallest form."""

import subprocess
import sys

import pytest
from checkout import ROOT

PARTS = {"classes", "contenders", "memory", "plain_python"}  # of others, which run them
SANDBOXED = {"class_of_300", "grading", "honest", "twice_a_week"}
MARKS = dict.fromkeys(SANDBOXED, pytest.mark.isolation) | {"explorers": pytest.mark.browser}
WHOLE = {"check"}  # has no smaller form than the course
PROGRAMS = sorted({path.stem for path in (ROOT / "benchmarks").glob("*.py")} - PARTS)


@pytest.mark.scheduled
@pytest.mark.parametrize("name", [pytest.param(name, marks=MARKS.get(name, ())) for name in PROGRAMS])
def test_a_benchmark_runs_and_prints_figures(name, request):
    if name in SANDBOXED:
        request.getfixturevalue("sandbox")
    command = [sys.executable, ROOT / "benchmarks" / f"{name}.py", *(["--smoke"] if name not in WHOLE else [])]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert any(character.isdigit() for character in done.stdout)
