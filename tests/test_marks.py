"""That tests bear the markers of what they use, so that a quick run leaves out what it says."""

from __future__ import annotations

import subprocess

import marks
import pytest
import run_tests
from checkout import ROOT


@pytest.mark.parametrize("program", marks.PROGRAMS)
def test_a_program_does_not_start_in_a_test_without_its_marker(program):
    done = subprocess.run([program, "--version"], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (97, "")
    assert f"needs the marker {marks.PROGRAMS[program]}" in done.stderr


@pytest.mark.isolation
def test_with_its_marker_a_test_is_not_kept_from_a_program(request):
    assert sorted(marks.withheld(request.node)) == ["chromium", "initdb"]


def test_all_tests_of_this_run_bear_what_they_have_to(request):
    for item in request.session.items:
        given = {marker.name for marker in item.iter_markers()}
        assert marks.earned(item) <= given, item.nodeid
        values = getattr(item, "callspec", None)
        assert values is None or "postgres" not in values.params.values() or "postgres" in given, item.nodeid


def test_who_starts_a_browser_imports_the_helper_for_it():
    """Its marker goes by who imports the helper of that name, which knows where chromium is before any test begins."""
    texts = {path.name: path.read_text(encoding="utf-8") for path in (ROOT / "tests").rglob("*.py")}
    starting = {name for name, text in texts.items() if "import sync_playwright" in text} - {"test_marks.py"}
    assert "browser.py" in starting
    assert [name for name in starting - {"browser.py"} if "\nimport browser\n" not in texts[name]] == []


def test_a_quick_run_leaves_out_just_the_projects_own_markers(request):
    own = {"slow", *marks.PROGRAMS.values()}
    assert set(run_tests.LEFT_OUT) == own
    assert own <= {line.partition(":")[0] for line in request.config.getini("markers")}


def test_what_comes_first_is_there(request):
    conftest = next(plugin for plugin in request.config.pluginmanager.get_plugins() if hasattr(plugin, "LONGEST"))
    assert [name for name in conftest.LONGEST if not (ROOT / "tests" / name).is_file()] == ["solutions"]  # notebooks
