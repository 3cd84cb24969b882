"""`pytest --nbval solutions`, or some of its notebooks: each finds the answers of those before it, and no others."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
import run_solutions

from rotflex import progress

HERE = Path(__file__).parent
IN_THIS_RUN = pytest.StashKey[set[str]]()  #: notebooks
BEGUN = pytest.StashKey[list[str]]()  #: those that have begun, in order


def notebook_of(item: pytest.Item) -> str | None:
    """The notebook that a cell belongs to; None if it is none of ours."""
    return item.path.stem if item.path.parent == HERE and item.path.suffix == ".ipynb" else None


def pytest_itemcollected(item: pytest.Item) -> None:
    """Notebooks take long."""
    item.add_marker(pytest.mark.slow)


def pytest_collection_finish(session: pytest.Session) -> None:
    """Which notebooks give their answers themselves."""
    session.config.stash[IN_THIS_RUN] = {name for item in session.items if (name := notebook_of(item))}
    session.config.stash[BEGUN] = []


@pytest.hookimpl(tryfirst=True)  # before the notebook's kernel starts
def pytest_runtest_setup(item: pytest.Item) -> None:
    """Before a notebook's first cell: the answers of all before it, nothing older, and nothing of its own.

    Those that are not part of this run are run here for their answers; their outputs are not compared.
    """
    notebook, begun = notebook_of(item), item.config.stash[BEGUN]
    if notebook is None or notebook in begun:
        return
    if not begun:
        os.environ[progress.SWITCH] = "off"  # a bar comes or not, as the machine is slow or quick
        run_solutions.ANSWERS.unlink(missing_ok=True)
    run_solutions.forget_from(notebook)
    needed = [name for name in run_solutions.before(notebook) if name not in item.config.stash[IN_THIS_RUN]]
    for name in needed:
        if not begun or name > begun[-1]:
            run_solutions.executed(HERE / f"{name}.ipynb")
    begun.append(notebook)
