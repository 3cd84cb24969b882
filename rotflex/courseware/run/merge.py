"""The master's notebooks with a student's answers in them."""

from __future__ import annotations

import copy
from collections.abc import Mapping
from typing import Any

from rotflex.courseware.run import skippable_cells


def merged(
    pristine: Mapping[str, dict[str, Any]], sources: Mapping[str, Mapping[str, str]], every_cell: bool = False
) -> dict[str, dict[str, Any]]:
    """The course's notebooks with a submission's answer cells, going on to the next cell whatever happens in one.

    Text is left out, and cells that only show something (:mod:`~rotflex.courseware.run.skippable_cells`).

    Parameters
    ----------
    pristine : file name → notebook as released
    sources : file name → answer cell's id → source; where one is missing, the stub stays
    every_cell : leave nothing out
    """
    found = {}
    for name, notebook in pristine.items():
        found[name] = copy.deepcopy(dict(notebook))
        cells = found[name]["cells"]
        for cell in cells:
            if cell["cell_type"] == "code":
                cell["source"] = sources.get(name, {}).get(cell["id"], cell["source"])
                cell["metadata"]["tags"] = [*cell["metadata"].get("tags", []), "raises-exception"]
        idle = set() if every_cell else skippable_cells.skippable(cells)
        found[name]["cells"] = [cell for cell in cells if cell["cell_type"] == "code" and cell["id"] not in idle]
    return found
