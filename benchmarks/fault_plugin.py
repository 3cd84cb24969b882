"""A plug-in of pytest for ``faults.py``: says which test executes what and how long it takes, or runs chosen tests.

``FAULTS_TIMES`` names a file for what each test took and what became of it; coverage.py, where it measures, is told
which test runs. ``FAULTS_CHOSEN`` names a file with the tests that are wanted, in their order; ``FAULTS_LEFT_OUT`` one
with those that are not.
"""

from __future__ import annotations

import json
import os
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

_times: dict[str, dict[str, Any]] = {}


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_runtest_protocol(item: pytest.Item) -> Iterator[None]:
    """Name the test to whoever measures what is executed."""
    if "FAULTS_TIMES" not in os.environ:
        return (yield)
    from coverage import Coverage

    measuring = Coverage.current()
    if measuring is not None:
        measuring.switch_context(item.nodeid)
    begun = time.perf_counter()
    try:
        return (yield)
    finally:
        _times.setdefault(item.nodeid, {})["seconds"] = time.perf_counter() - begun
        if measuring is not None:
            measuring.switch_context("")


def pytest_runtest_logreport(report: pytest.TestReport) -> None:
    """What became of a test: one that fails anyway notices nothing."""
    if report.outcome != "passed":
        _times.setdefault(report.nodeid, {})["outcome"] = report.outcome


def pytest_sessionfinish() -> None:
    """Write down what was measured."""
    if "FAULTS_TIMES" in os.environ:
        Path(os.environ["FAULTS_TIMES"]).write_text(json.dumps(_times), encoding="utf-8")


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Only the chosen tests, in their order; or all but some."""
    if "FAULTS_LEFT_OUT" in os.environ:
        left_out = set(json.loads(Path(os.environ["FAULTS_LEFT_OUT"]).read_text(encoding="utf-8")))
        config.hook.pytest_deselected(items=[item for item in items if item.nodeid in left_out])
        items[:] = [item for item in items if item.nodeid not in left_out]
    if "FAULTS_CHOSEN" in os.environ:
        chosen = json.loads(Path(os.environ["FAULTS_CHOSEN"]).read_text(encoding="utf-8"))
        ranks = {name: rank for rank, name in enumerate(chosen)}
        left = [item for item in items if item.nodeid not in ranks]
        items[:] = sorted((item for item in items if item.nodeid in ranks), key=lambda item: ranks[item.nodeid])
        config.hook.pytest_deselected(items=left)
