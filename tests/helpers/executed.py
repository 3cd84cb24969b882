"""Executed notebooks, so that those of two engines can be compared: without what differs from one run to the next."""

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import papermill
from papermill.engines import papermill_engines

from labcourse.run.engine import Engine

papermill_engines.register("labcourse", Engine)  # whatever is installed

_DIFFER = {
    r"0x[0-9a-f]{6,}": "ADDRESS",
    r"ipykernel_\d+/\d+": "CELL",
    r"(\b|_)[0-9a-f]{32}\b": "ID",
    r"\b[0-9a-f]{8}(-[0-9a-f]{4}){3}-[0-9a-f]{12}\b": "ID",
    r"\d+%\|.*": "PROGRESS",
    r"Thread-\d+": "THREAD",
}


def executed(notebook: Any, engine: str | None = "labcourse", **options: Any) -> Any:
    """Run a notebook, from a file or node, by an engine of papermill's."""
    return papermill.execute_notebook(notebook, None, engine_name=engine, **{"progress_bar": False, **options})


def outputs(cell: Mapping[str, Any], folder: Path) -> tuple[Any, ...]:
    """Return what a cell has shown: its number, the text of each stream, and the other outputs in order."""
    texts = {"stdout": "", "stderr": ""}
    others = []
    for output in cell["outputs"]:
        if output["output_type"] == "stream":
            texts[output["name"]] += output["text"]
        else:
            others.append(output)
    return tidy((cell["execution_count"], texts, others), folder)


def tidy(value: Any, folder: Path) -> Any:
    """Return plain data without addresses, names that are drawn, and the folder of the run."""
    if isinstance(value, Mapping):
        return {tidy(key, folder): tidy(inner, folder) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return type(value)(tidy(inner, folder) for inner in value)
    if not isinstance(value, str):
        return value
    value = value.replace(str(folder), "FOLDER")
    for pattern, name in _DIFFER.items():
        value = re.sub(pattern, name, value)
    return value
