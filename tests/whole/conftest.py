"""What tests of the whole share."""

import pytest
from end_of_term import everything_is_due
from remembered import remembered


@pytest.fixture(autouse=True, scope="session")
def end_of_term():
    with everything_is_due():
        yield


@pytest.fixture(scope="module")
def runs_made_once():
    """Each first run of a virtual bench is made once, for all tests of a file."""
    with remembered() as kept:
        yield kept
