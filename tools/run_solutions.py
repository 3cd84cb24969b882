"""Run the solution notebooks and store their outputs, which CI compares with (nbval).

    python tools/run_solutions.py [NOTEBOOK ...]

All of solutions/ by default, in order. Each finds the answers of those before it, as a student would have them, and
no others: run one alone only after the ones before it. (solutions/conftest.py sees to the same for tests.) Say
`rotflex make-notebooks` afterwards, so that the student notebooks follow.
"""

from __future__ import annotations

import json
import os
import sys
import time
from pathlib import Path

import nbformat
from nbclient import NotebookClient
from nbformat import NotebookNode

from labcourse import files
from labcourse.run import RUNNING
from labcourse.session import ANSWERS_FILE
from rotflex import progress
from rotflex.course.questions import CATALOGUE

SOLUTIONS = Path(__file__).resolve().parents[1] / "solutions"
ANSWERS = SOLUTIONS / ANSWERS_FILE


def forget_from(notebook: str) -> None:
    """Take the answers of a notebook, and of those after it, out of answers.json."""
    if ANSWERS.exists():
        content = json.loads(ANSWERS.read_text(encoding="utf-8"))
        kept = {n: parts for n, parts in content["answers"].items() if CATALOGUE.everything[n].notebook < notebook}
        ANSWERS.write_text(json.dumps(content | {"answers": kept}), encoding="utf-8")


def before(notebook: str) -> list[str]:
    """The notebooks whose answers one may ask for, in order; none for one that has no questions itself."""
    with_questions = sorted({question.notebook for question in CATALOGUE.everything.values()})
    return with_questions[: with_questions.index(notebook)] if notebook in with_questions else []


def executed(path: Path) -> NotebookNode:
    """A notebook with its outputs, run in its folder.

    Raises
    ------
    nbclient.exceptions.CellExecutionError
        If a cell fails.
    """
    notebook = nbformat.read(path, as_version=4)
    NotebookClient(
        notebook,
        timeout=120,
        kernel_name="python3",
        record_timing=False,
        coalesce_streams=True,
        resources={"metadata": {"path": str(path.parent)}},
    ).execute()
    return notebook


def store(path: Path, notebook: NotebookNode) -> None:
    """Write a notebook without what differs from one machine to the next."""
    notebook.metadata = {
        "kernelspec": {"display_name": "Python 3 (ipykernel)", "language": "python", "name": "python3"},
        "language_info": {"name": "python"},
    }
    for cell in notebook.cells:
        cell.metadata.pop("execution", None)
        for output in cell.get("outputs", []):  # a widget has a random name; what stands for it on paper stays
            for part in ("data", "metadata"):
                output.get(part, {}).pop("application/vnd.jupyter.widget-view+json", None)
    files.write(path, lambda scratch: nbformat.write(notebook, scratch))


def main(names: list[str]) -> None:
    """Run the named notebooks, or all."""
    os.environ[progress.SWITCH] = "off"  # a bar comes or not, as the machine is slow or quick
    os.environ[RUNNING] = "1"  # as in the tests: what is drawn anew for a person is always the same here
    paths = [Path(name) for name in names] or sorted(SOLUTIONS.glob("*.ipynb"))
    for path in paths:
        started = time.perf_counter()
        forget_from(path.stem)
        store(path, executed(path))
        print(f"{path.name}: {time.perf_counter() - started:.1f} s, {path.stat().st_size / 1000:.0f} kB")


if __name__ == "__main__":
    main(sys.argv[1:])
