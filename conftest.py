"""How tests are shared among several processes (`pytest -n`), in which order, and the seconds that each file takes.

One process has all tests of a file, so that what they share is made once; one has all solution notebooks, since each
needs the answers of those before it; one has all files that start a browser, so that one browser is enough. (Groups of
pytest-xdist's own are marks, which 3.8 loses with pytest 9.2: its issue 1386.)
"""

from __future__ import annotations

import json
import re
from collections import Counter
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from xdist.scheduler import LoadScopeScheduling

ROOT = Path(__file__).parent
SOLUTIONS = "solutions"
BROWSER = "browser"
#: s, as recorded by ``--record-seconds``: of each test function above LONG, all its cases together, and of what is left
#: of each file. Files that take longest begin first.
DURATIONS = ROOT / "tests" / "durations.json"
LONG = 0.25  #: s: a quick run leaves out test functions that took more
LARGEST = 20  #: files in the list of seconds
_STARTS_A_BROWSER = re.compile(r"^(import|from) (browser|explorer_notebooks|explorer_page)\b|[(, ]chromium[,)]", re.M)
_seconds: Counter[str] = Counter()
pytest.register_assert_rewrite("board_contract")  # tests that are imported from a helper


@cache
def _starts_a_browser(file: str) -> bool:
    path = ROOT / file
    return path.is_file() and bool(_STARTS_A_BROWSER.search(path.read_text(encoding="utf-8")))


def group(nodeid: str) -> str:
    """Return the name of the group that one process runs: the file of a test, all notebooks, or all browser files."""
    file = nodeid.partition("::")[0]
    if file.startswith(f"{SOLUTIONS}/"):
        return SOLUTIONS
    return BROWSER if _starts_a_browser(file) else file


class InGroups(LoadScopeScheduling):
    """Give each process whole groups."""

    def _split_scope(self, nodeid: str) -> str:
        return group(nodeid)


@pytest.hookimpl(optionalhook=True)  # of pytest-xdist
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> InGroups | None:
    """Distribute by groups, unless another way to share tests is asked for."""
    return InGroups(config, log) if config.getoption("dist") == "loadfile" else None


def longest_first(items: list[pytest.Item], durations: dict[str, float]) -> None:
    """Sort tests by the recorded seconds of their groups; files without a record come last, in their order."""
    totals: Counter[str] = Counter()
    for nodeid, seconds in durations.items():
        totals[group(nodeid)] += seconds
    items.sort(key=lambda item: -totals[group(item.nodeid)])


def function(nodeid: str) -> str:
    """Return the node id of the function that a case belongs to."""
    return nodeid.partition("[")[0]


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Leave out long tests in a quick run; begin with the longest in a process that shares the tests with others.

    No cell of a notebook is left out, for those after it need it.
    """
    durations = json.loads(DURATIONS.read_text(encoding="utf-8"))
    if config.getoption("--quick"):
        long = {item for item in items if function(item.nodeid) in durations and group(item.nodeid) != SOLUTIONS}
        config.hook.pytest_deselected(items=list(long))
        items[:] = [item for item in items if item not in long]
    if hasattr(config, "workerinput"):
        longest_first(items, durations)


# --- seconds by file --------------------------------------------------------------------------------------------------


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the options about seconds."""
    options = parser.getgroup("rotflex")
    options.addoption("--seconds-by-file", action="store_true", help=f"list the {LARGEST} files that took longest")
    options.addoption("--quick", action="store_true", help=f"leave out tests recorded as longer than {LONG} s")
    options.addoption("--record-seconds", action="store_true", help=f"write the seconds of a whole run to {DURATIONS}")


def pytest_runtest_logreport(report: pytest.TestReport) -> None:
    """Add up setup, test and teardown, in the process that gets the reports of all."""
    _seconds[function(report.nodeid)] += report.duration


def pytest_terminal_summary(terminalreporter: Any, config: pytest.Config) -> None:
    """List the files that took longest, and record all where it is asked for."""
    by_file, record = Counter[str](), Counter[str]()
    for nodeid, seconds in _seconds.items():
        file = nodeid.partition("::")[0]
        by_file[file] += seconds
        record[nodeid if seconds > LONG else file] += seconds
    if config.getoption("--seconds-by-file"):
        terminalreporter.section(f"seconds by file: {sum(by_file.values()):.0f} in {len(by_file)} files")
        for file, seconds in by_file.most_common(LARGEST):
            terminalreporter.write_line(f"{seconds:7.1f}  {file}")
    if config.getoption("--record-seconds"):
        rounded = {name: round(seconds, 1) for name, seconds in sorted(record.items()) if seconds >= 0.1}
        DURATIONS.write_text(json.dumps(rounded, indent=1) + "\n", encoding="utf-8")
