"""What the tests share: fixtures, the markers that each test bears, and how tests are spread over several processes."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

import marks
import pytest
from checkout import ROOT
from hypothesis import settings

from rotflex.recording import Recording

# How long an example takes says nothing about whether it is right.
settings.register_profile("rotflex", deadline=None)
settings.load_profile("rotflex")

RECORDINGS = Path(__file__).resolve().parents[2] / "shared" / "reference" / "recordings"

#: What takes longest comes first where several processes share the tests, so that none is left with it in the end.
LONGEST = (
    "whole/test_hostile_class.py",
    "whole/test_whole_class.py",
    "solutions",
    "whole/test_class.py",
    "whole/test_jupyterlab.py",
    "widgets/test_explorers_browser.py",
    "instructor/running/test_inside_equivalence.py",
    "instructor/running/test_runner.py",
    "instructor/test_crash.py",
    "instructor/test_cluster.py",
    "instructor/release/test_released_course.py",
    "instructor/gradebook/test_gradebook.py",
)


def pytest_itemcollected(item: pytest.Item) -> None:
    """Markers by what a test uses; one process for all tests of a file, whose fixtures are made once."""
    for marker in sorted(marks.earned(item)):
        item.add_marker(marker)
    if not item.get_closest_marker("xdist_group"):
        item.add_marker(pytest.mark.xdist_group(item.path.relative_to(ROOT / "tests").as_posix()))


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """The longest first, in a process that shares the tests with others."""
    if hasattr(config, "workerinput"):
        items.sort(key=_place)


def _place(item: pytest.Item) -> int:
    marker = item.get_closest_marker("xdist_group")
    return LONGEST.index(marker.args[0]) if marker and marker.args[0] in LONGEST else len(LONGEST)


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
def real_log(real_log_path: Path) -> Recording:
    """The log of a real bench as a recording."""
    return Recording.load(real_log_path)


@pytest.fixture(scope="session")
def sandbox() -> None:
    """Isolation, where it is to be had."""
    from rotflex.instructor.running import isolation_report as walls

    lacking = [layer for layer in walls.examine().layers if layer.needed and not layer.good]
    if lacking:
        pytest.skip(
            f"Students' code cannot be isolated here: {lacking[0].name}: {lacking[0].found}. {lacking[0].remedy}"
        )
