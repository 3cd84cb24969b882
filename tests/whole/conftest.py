"""What tests of the whole share."""

import pytest
from remembered import remembered
from set_clock import END_OF_TERM, set_clock


@pytest.fixture(autouse=True, scope="module")
def end_of_term():
    with pytest.MonkeyPatch.context() as patch:
        set_clock(patch, END_OF_TERM)
        yield


@pytest.fixture(scope="module")
def runs_made_once():
    """Each first run of a virtual bench is made once, for all tests of a file."""
    with remembered() as kept:
        yield kept
