"""What tests of the hardware's side share."""

from types import SimpleNamespace

import pytest
from fault_board import Stopwatch

from rotflex.hil import halt


@pytest.fixture(autouse=True)
def patience(monkeypatch):
    """Have time pass at once while a board that does not take 0 V is asked again."""
    time = Stopwatch()
    monkeypatch.setattr(halt, "time", SimpleNamespace(monotonic=time.now, sleep=time.pass_by))
