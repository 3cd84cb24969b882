"""Each benchmark runs, in its smallest form."""

import importlib.util
import math
import subprocess
import sys

import pyodide_files
import pytest
from checkout import ROOT

PARTS = {"classes", "contenders", "memory", "plain_python"}  # of others, which run them
SANDBOXED = {"class_of_300", "grading", "honest", "twice_a_week", "versions"}
MARKS = dict.fromkeys(SANDBOXED, pytest.mark.isolation) | {
    name: pytest.mark.browser for name in ("explorers", "front_door", "starts")
}
WHOLE = {"check"}  # has no smaller form than the course
PROGRAMS = sorted({path.stem for path in (ROOT / "benchmarks").glob("*.py")} - PARTS)


@pytest.mark.scheduled
@pytest.mark.parametrize("name", [pytest.param(name, marks=MARKS.get(name, ())) for name in PROGRAMS])
def test_a_benchmark_runs_and_prints_figures(name, request):
    if name in SANDBOXED:
        request.getfixturevalue("sandbox")
    if name == "front_door":
        pyodide_files.folder()  # or this test is skipped
    command = [sys.executable, ROOT / "benchmarks" / f"{name}.py", *(["--smoke"] if name not in WHOLE else [])]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert any(character.isdigit() for character in done.stdout)


def program(name, monkeypatch):
    """A benchmark as a module."""
    monkeypatch.syspath_prepend(str(ROOT / "benchmarks"))
    spec = importlib.util.spec_from_file_location(f"benchmark_{name}", ROOT / "benchmarks" / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    monkeypatch.setitem(sys.modules, spec.name, module)  # dataclasses look there
    spec.loader.exec_module(module)
    return module


def test_grading_keeps_what_it_has_measured_when_a_run_fails(monkeypatch, capsys):
    grading = program("grading", monkeypatch)
    figures = grading.Figures()
    with figures.noting("2 of 2, papermill loop"):
        raise RuntimeError("a kernel died")
    one, two = (grading.OURS.format(jobs) for jobs in (1, 2))
    figures.seconds = {"papermill loop": [12.0, math.nan], one: [4.0, 5.0], two: [math.nan, math.nan]}
    figures.seconds |= {grading.LOWER_BOUND: [2.0, 2.5], grading.IMPORTS: [1.0, 1.0]}
    assert figures.failures == ["2 of 2, papermill loop: a kernel died"]
    assert figures.ratio("papermill loop", one) == 3 and math.isnan(figures.ratio(one, two))
    grading.show(figures, 1)
    assert "3.00" in capsys.readouterr().out


def test_explorers_keep_what_they_have_measured_when_the_browser_fails(monkeypatch):
    explorers = program("explorers", monkeypatch)

    def late():
        raise AssertionError("JupyterLab ended")

    assert explorers.measured({"interact": lambda: 1, "console": late}) == (
        {"interact": 1},
        ["console: JupyterLab ended"],
    )
