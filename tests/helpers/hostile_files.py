"""Attacks by the form of what is handed in: notebooks that are not as they were handed out, odd files, odd zips, odd
names. None of their code is code that does harm.
"""

import copy
import os
import stat
import subprocess
import warnings
import zipfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from hostile import HONEST, STIFFNESS, Attack

from labcourse.answers.notebooks import MAX_FILE

Notebooks = dict[str, dict[str, Any]]
Outside = Mapping[str, Any]
_RIGHT = 'lab.answer("2.12", J_l=lab.joint.J_l, K_s=1.3)'
_PLANTED = "open('/tmp/planted', 'w')\nraise SystemExit('planted')\n"


def _each(change: Callable[[dict[str, Any]], None]) -> Callable[[Notebooks], None]:
    def spoil(notebooks: Notebooks) -> None:
        for notebook in notebooks.values():
            for cell in notebook["cells"]:
                change(cell)

    return spoil


def _retag(cell: dict[str, Any]) -> None:
    """Tags and metadata by which executors and graders pass over cells, or change them; and locked cells edited."""
    if not cell["metadata"].get("nbgrader", {}).get("solution"):
        cell["source"] = f"{_PLANTED}\n{cell['source']}\n{_RIGHT}"
    tags = ["skip-execution", "raises-exception", "parameters", "injected-parameters", "remove-cell"]
    cell["metadata"]["tags"] = tags
    points = {"grade": True, "points": 1000, "locked": False, "solution": True, "task": True, "schema_version": 3}
    cell["metadata"]["nbgrader"] = points | {"grade_id": cell["id"]}
    cell["metadata"]["papermill"] = {"status": "completed", "exception": False, "duration": 0}
    cell["execution_count"], cell["outputs"] = 1, [{"output_type": "stream", "name": "stdout", "text": "11 of 11"}]


def _rearrange(notebooks: Notebooks) -> None:
    """Locked cells removed, doubled, in another order, under other cells' ids; and metadata of the whole."""
    for notebook in notebooks.values():
        cells = notebook["cells"]
        doubled = [copy.deepcopy(cell) for cell in cells if cell["id"] == "setup" or cell["id"].endswith("-answer")]
        for cell in doubled:
            cell["source"] = _PLANTED + _RIGHT
        answers = [cell for cell in cells if cell["metadata"].get("nbgrader", {}).get("solution")]
        notebook["cells"] = [*doubled, *reversed(answers)]
        notebook["metadata"] = {"kernelspec": {"name": "evil", "display_name": "<b>", "language": "bash"}}
        notebook["nbformat"], notebook["nbformat_minor"] = 99, -1


def _links(path: Path, outside: Outside) -> None:
    """Of its three notebooks, none is a file any more."""
    targets = ["/etc/passwd", outside["secrets"][0], path.name, "nowhere"]
    for target, notebook in zip(targets[1:], sorted(path.glob("*.ipynb")), strict=True):
        notebook.unlink()
        notebook.symlink_to(target)
    (path / "course.json").symlink_to(targets[0])
    (path / "loop").symlink_to(path, target_is_directory=True)
    (path / "neighbour").symlink_to(path.parent / HONEST[0], target_is_directory=True)


def _odd_notebooks(path: Path, outside: Outside) -> None:
    notebooks = sorted(path.glob("*.ipynb"))
    notebooks[0].write_bytes(b'{"cells": ' + b"[" * 100_000)
    notebooks[1].write_bytes(b'{"cells": [], "n": ' + b"9" * 100_000 + b"}")
    with notebooks[2].open("wb") as file:
        file.truncate(1 << 30)  # sparse


def _slip(path: Path, outside: Outside) -> None:
    evil = b"slipped " + outside["token"].encode()
    link = zipfile.ZipInfo("linked")
    link.create_system, link.external_attr = 3, (stat.S_IFLNK | 0o777) << 16
    with warnings.catch_warnings(), zipfile.ZipFile(path, "a") as packed:
        warnings.simplefilter("ignore")  # that names are there twice
        packed.writestr(link, outside["marker"])
        for target in outside["targets"]:
            packed.writestr(f"{target}/hostile-{outside['token']}", evil)
            packed.writestr(f"{'../' * 12}{target.lstrip('/')}/hostile-{outside['token']}", evil)
        for name in ("linked/evil", "..\\..\\evil", "C:\\evil", "/etc/hostile", ".", "..", "a/../../b", STIFFNESS):
            packed.writestr(name, evil)


def _bomb(path: Path, outside: Outside) -> None:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as packed:
        packed.writestr(STIFFNESS, bytes(200 << 20))


_TOO_LARGE = f"more than {MAX_FILE} bytes"
_IGNORED = "There is no notebook of the course in the submission"
_FULL = {"2.1": 2.0, "2.10": 2.0, "2.11": 2.0, "2.12": 3.0}
_ALL = ("q0-1", "q2-1", "q2-10", "q2-11", "q2-12")

FORMS = {
    # Where the course's cells are, and what they are called, does no harm: with right answers, it is an honest hand-in.
    "retagged": Attack(honestly=_ALL, earns=_FULL, spoil=_each(_retag), runs=False),
    "rearranged": Attack(honestly=_ALL, earns=_FULL, spoil=_rearrange, runs=False),
    "links": Attack(earns={}, lay=_links, runs=False, trouble=(_IGNORED,)),
    "odd-notebooks": Attack(earns={}, lay=_odd_notebooks, runs=False, trouble=("not JSON", _TOO_LARGE)),
    "zip-slip": Attack(zipped=True, lay=_slip),
    "zip-bomb": Attack(zipped=True, earns={}, lay=_bomb, runs=False, trouble=(_TOO_LARGE,)),
}


def _empty(path: Path, outside: Outside) -> None:
    for notebook in path.glob("*.ipynb"):
        notebook.unlink()


#: Names that are none: these are told, and nothing is made of them.
REFUSED = ("gradebook.sqlite", "<img src=x onerror=alert(1)>", "\x1b[31mred", "\u202eevil", os.fsdecode(b"\xff\xfe"))
_NAMES = ("=1+1", "@SUM(A1)", "+1", "-rf", "[red]x[bold]", "{{7+7}}", "'; DROP TABLE--")
#: Names that are an ID, and are taken for one. One of them has work to hand in, too.
NAMES = {"&lt;img src=x onerror=alert(1)&gt;": Attack()} | {
    name: Attack(earns={}, lay=_empty, runs=False, trouble=(_IGNORED,)) for name in _NAMES
}


def remove(folder: Path) -> None:
    """Delete a folder in which there may be closed ones."""
    subprocess.run(["chmod", "-R", "u+rwX", folder], check=True, timeout=300)
    subprocess.run(["rm", "-rf", folder], check=True, timeout=300)
