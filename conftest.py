"""How tests are shared among several processes (`pytest -n`).

One process has all tests of a file, so that what they share is made once; one has all solution notebooks, since each
needs the answers of those before it. (Groups of pytest-xdist's own are marks, which 3.8 loses with pytest 9.2: its
issue 1386.)
"""

from __future__ import annotations

from typing import Any

import pytest
from xdist.scheduler import LoadScopeScheduling

SOLUTIONS = "solutions"
#: What takes longest begins first, so that no process is left with it in the end.
LONGEST = (
    "tests/whole/test_honest_class.py",
    "tests/whole/test_hostile_class.py",
    "tests/whole/test_right_ways.py",
    "tests/whole/test_whole_class.py",
    SOLUTIONS,
    "tests/whole/test_class.py",
    "tests/whole/test_scored_class.py",
    "tests/whole/test_jupyterlab.py",
    "tests/whole/test_bench_policies.py",
    "tests/courseware/run/test_check.py",
    "tests/site/test_site.py",
    "tests/widgets/test_explorers_browser.py",
    "tests/widgets/test_explorers_at_720.py",
    "tests/workbook/test_spare_design.py",
    "tests/instructor/running/test_inside_equivalence.py",
    "tests/whole/test_single_slips.py",
    "tests/instructor/test_real_class.py",
    "tests/instructor/running/test_runner.py",
    "tests/instructor/test_crash.py",
    "tests/instructor/test_cluster.py",
    "tests/instructor/release/test_released_course.py",
    "tests/instructor/scoring/test_scoring_browser.py",
    "tests/instructor/gradebook/test_gradebook.py",
)


def group(nodeid: str) -> str:
    """What one process has all of: the file of a test, or all notebooks."""
    folder, _, _ = nodeid.partition("/")
    return SOLUTIONS if folder == SOLUTIONS else nodeid.partition("::")[0]


class InGroups(LoadScopeScheduling):
    """Gives a process whole groups."""

    def _split_scope(self, nodeid: str) -> str:
        return group(nodeid)


@pytest.hookimpl(optionalhook=True)  # of pytest-xdist
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> InGroups | None:
    """Files in groups, where no other way to share tests is asked for."""
    return InGroups(config, log) if config.getoption("dist") == "loadfile" else None


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """The longest first, in a process that shares the tests with others."""
    if hasattr(config, "workerinput"):
        ranks = {name: rank for rank, name in enumerate(LONGEST)}
        items.sort(key=lambda item: ranks.get(group(item.nodeid), len(ranks)))
