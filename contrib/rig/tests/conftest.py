"""Set up what these tests need beside the helpers of rotflex's tests."""

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))  # helpers can be imported by their names

from rigs import Rig
from rotflex_rig.web import TOKEN_VARIABLE

from rotflex import files


@pytest.fixture(autouse=True)
def settings(tmp_path, monkeypatch):
    monkeypatch.setenv(files.SETTINGS_VARIABLE, str(tmp_path / "settings"))
    monkeypatch.delenv(TOKEN_VARIABLE, raising=False)


@pytest.fixture
def rig(tmp_path):
    made = Rig(tmp_path / "rig")
    yield made
    for worker in made.workers:
        worker.kill()
        worker.wait()
