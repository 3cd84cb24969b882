"""What the tests share: fixtures, and the markers that each test bears."""

from __future__ import annotations

import gc
import os
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import browser
import marks
import pytest
from hypothesis import settings as hypothesis_settings

from labcourse import courses, lab_command
from rotflex import files
from rotflex.recording import Recording

#: Courses made for tests have notebooks; it is for the tests to run them.
collect_ignore_glob = ["*.ipynb"]

# How long an example takes says nothing about whether it is right. A landing always tries the same examples.
hypothesis_settings.register_profile("landing", deadline=None, derandomize=True)
hypothesis_settings.register_profile("all", deadline=None, print_blob=True)  # make test-all: --hypothesis-profile=all
hypothesis_settings.load_profile("landing")

# What `rotflex lab` keeps for next time is not to land among the settings of who runs the tests.
for name in [name for name in os.environ if name.startswith(("JUPYTERHUB_", "BINDER_"))]:
    del os.environ[name]  # whoever tests on a hub has no hub in the tests
for name in (lab_command.SETTINGS_VARIABLE, files.SETTINGS_VARIABLE):
    os.environ[name] = tempfile.mkdtemp(prefix="rotflex-settings-")
os.environ["LABCOURSE_PROGRAM"] = "rotflex"  # as messages name it, also where a test calls no command
os.environ[courses.COURSE_VARIABLE] = "rotflex.course"

RECORDINGS = Path(__file__).resolve().parents[2] / "shared" / "reference" / "recordings"


def pytest_itemcollected(item: pytest.Item) -> None:
    """Markers by what a test uses."""
    for marker in sorted(marks.earned(item)):
        item.add_marker(marker)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item: pytest.Item) -> Iterator[None]:
    """A test starts none of the programs for which it bears no marker: so no marker is forgotten."""
    with marks.without(marks.withheld(item)):
        return (yield)


@pytest.fixture(scope="session")
def real_log_path() -> Path:
    """A log of a real bench, which is not part of the project."""
    path = Path(os.environ.get("ROTFLEX_RECORDINGS", RECORDINGS)) / "real_bench_lqr.mat"
    if not path.exists():
        pytest.skip(f"The log of a real bench is not at {path}; set ROTFLEX_RECORDINGS to its folder.")
    return path


@pytest.fixture(scope="session")
def other_mechanism_path() -> Path:
    """A log of a flexible link in the flexible joint's place, which is not part of the project."""
    path = Path(os.environ.get("ROTFLEX_CASES", RECORDINGS.parents[1] / "cases")) / "another_plant_lqr.mat"
    if not path.exists():
        pytest.skip(f"The log of another mechanism is not at {path}; set ROTFLEX_CASES to its folder.")
    return path


@pytest.fixture(scope="session")
def real_log(real_log_path: Path) -> Recording:
    """The log of a real bench as a recording."""
    return Recording.load(real_log_path)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_teardown(item: pytest.Item, nextitem: pytest.Item | None) -> Iterator[None]:
    """End the browser after the last of the files that need it."""
    try:
        return (yield)
    finally:
        if nextitem is None or (nextitem.path != item.path and not nextitem.get_closest_marker("browser")):
            browser.close()


@pytest.fixture(scope="module")
def chromium() -> Any:
    """A browser without a window, where it is to be had."""
    if browser.CHROMIUM is None:
        pytest.skip("there is no chromium here: apt-get install chromium")
    return browser.chromium()


@pytest.fixture(scope="session")
def jupyterlab(tmp_path_factory: pytest.TempPathFactory) -> Iterator[browser.Served]:
    """The one JupyterLab of a run, on a student's folder that was empty to begin with."""
    with browser.served(tmp_path_factory.mktemp("jupyterlab")) as found:
        yield found


@pytest.fixture(scope="session")
def sandbox() -> None:
    """Isolation, where it is to be had."""
    from labcourse.grading.running import isolation_report

    lacking = [layer for layer in isolation_report.examine().layers if layer.needed and not layer.good]
    if lacking:
        pytest.skip(
            f"Students' code cannot be isolated here: {lacking[0].name}: {lacking[0].state}. {lacking[0].remedy}"
        )


@pytest.fixture
def settings(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """The laboratory's settings, and the folder that a test is in, are the test's own."""
    monkeypatch.setenv(files.SETTINGS_VARIABLE, str(tmp_path / "settings"))
    monkeypatch.chdir(tmp_path)
    return tmp_path / "settings"


@pytest.fixture(autouse=True, scope="module")
def little_to_collect() -> Iterator[None]:
    """Keep what was there before a file's tests out of the rubbish that a run on a bench collects before it begins."""
    gc.freeze()
    yield
    gc.unfreeze()


@pytest.fixture(autouse=True, scope="module")
def no_package_of_another_course() -> Iterator[None]:
    """Forget the packages of courses made for tests: each file of tests has copies of its own, of the same names."""
    path = list(sys.path)
    yield
    sys.path[:] = path
    for name in [name for name in sys.modules if name.partition(".")[0] == "springlab"]:
        del sys.modules[name]
