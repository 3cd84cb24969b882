"""What tests of the whole share."""

import pytest
from remembered import remembered


@pytest.fixture(scope="module")
def runs_made_once():
    """Each first run of a virtual bench is made once, for all tests of a file."""
    with remembered() as kept:
        yield kept
