"""Attacks by the form of what is handed in: notebooks that are not as they were handed out, odd files, odd zips, odd
names. None of their code is code that does harm.
"""

import copy
import json
import os
import pickle
import shutil
import stat
import struct
import subprocess
import warnings
import zipfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from hostile import HONEST, PRELAB, STIFFNESS, Attack

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
    cell["metadata"]["tags"] = [
        "skip-execution",
        "raises-exception",
        "parameters",
        "injected-parameters",
        "remove-cell",
    ]
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


def _double_answers(notebooks: Notebooks) -> None:
    """All are run, as they would be at home: the first is wrong here, the second is right, and counts."""
    cells = notebooks[PRELAB]["cells"]
    place = next(index for index, cell in enumerate(cells) if cell["id"] == "q2-1")
    cells.insert(place, {**cells[place], "source": "V = 1"})


def _other_types(notebooks: Notebooks) -> None:
    for cell, source in zip(notebooks[STIFFNESS]["cells"], (7, None, ["a", 1], {"a": 1}, "\ud800"), strict=False):
        cell["source"] = source
    notebooks[PRELAB]["cells"] += [7, None, [], {"id": ["q2-1"]}, {"id": "q2-1", "cell_type": "raw"}, "cell"]


def _links(path: Path, outside: Outside) -> None:
    """Of its three notebooks, none is a file any more."""
    targets = ["/etc/passwd", outside["secrets"][0], path.name, "nowhere"]
    for target, notebook in zip(targets[1:], sorted(path.glob("*.ipynb")), strict=True):
        notebook.unlink()
        notebook.symlink_to(target)
    (path / "course.json").symlink_to(targets[0])
    (path / "loop").symlink_to(path, target_is_directory=True)
    (path / "neighbour").symlink_to(path.parent / HONEST[0], target_is_directory=True)


def _pipes(path: Path, outside: Outside) -> None:
    for notebook in path.glob("*.ipynb"):
        notebook.unlink()
        os.mkfifo(notebook)
    os.mkfifo(path / "course.json")


def _deep(path: Path, outside: Outside) -> None:
    """Folders in folders, 3000 deep, with a notebook at the bottom."""
    folder = os.open(path, os.O_RDONLY)
    for _ in range(3000):
        os.mkdir("d", dir_fd=folder)
        below = os.open("d", os.O_RDONLY, dir_fd=folder)
        os.close(folder)
        folder = below
    os.close(os.open(STIFFNESS, os.O_CREAT | os.O_WRONLY, dir_fd=folder))
    os.close(folder)


def _many(path: Path, outside: Outside) -> None:
    for number in range(5100):
        (path / str(number)).touch()


def _modules(path: Path, outside: Outside) -> None:
    """What would be imported, unpickled or believed, were the folder worked in."""
    for name in (
        "json",
        "numpy",
        "rotflex/__init__",
        "rotflex/lab",
        "sitecustomize",
        "usercustomize",
        "nbformat",
        "conftest",
    ):
        (path / name).parent.mkdir(exist_ok=True)
        (path / f"{name}.py").write_text(_PLANTED)
    (path / "evil.pth").write_text("import json")
    (path / "answers.pkl").write_bytes(pickle.dumps(os.getcwd))
    right = {"J_l": {"kind": "number", "value": 0.0033}, "K_s": {"kind": "number", "value": 1.3}}
    book = {"format": 2, "student": path.name, "bench": {}, "software": "", "probe_seed": 1, "answers": {"2.12": right}}
    (path / "answers.json").write_text(json.dumps(book))
    (path / "marks.json").write_text(json.dumps({"total": 11, "points": 11}))
    (path / "course.json").write_text(json.dumps({"student": HONEST[0]}))


def _odd_notebooks(path: Path, outside: Outside) -> None:
    notebooks = sorted(path.glob("*.ipynb"))
    notebooks[0].write_bytes(b'{"cells": ' + b"[" * 100_000)
    notebooks[1].write_bytes(b'{"cells": [], "n": ' + b"9" * 100_000 + b"}")
    with notebooks[2].open("wb") as file:
        file.truncate(1 << 30)  # sparse


def _closed(path: Path, outside: Outside) -> None:
    """Folders whose names are no text, and one that cannot be listed."""
    (path / os.fsdecode(b"\xff\xfe\x1b[31m")).mkdir()
    for notebook in path.glob("*.ipynb"):
        shutil.copyfile(notebook, path / os.fsdecode(b"\xff\xfe\x1b[31m") / notebook.name)
    (path / "closed").mkdir(mode=0)  # for root it is as good as open


def _contents(path: Path) -> dict[str, bytes]:
    with zipfile.ZipFile(path) as packed:
        return {entry.filename: packed.read(entry) for entry in packed.infolist()}


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


def _many_entries(path: Path, outside: Outside) -> None:
    """A table of contents with 500 000 entries of one and the same file, and nothing else."""
    entry = struct.pack("<4s4B4HL2L5H2L", b"PK\1\2", 20, 3, 20, 0, 0, 0, 0, 33, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0) + b"a"
    table = entry * 500_000
    path.write_bytes(table + struct.pack("<4s4H2LH", b"PK\5\6", 0, 0, 65535, 65535, len(table), 0, 0))


def _encrypted(path: Path, outside: Outside) -> None:
    """Said to be encrypted, entry by entry, in the table of contents and before each file."""
    data = bytearray(path.read_bytes())
    for mark, place in ((b"PK\1\2", 8), (b"PK\3\4", 6)):
        at = data.find(mark)
        while at >= 0:
            data[at + place] |= 1
            at = data.find(mark, at + 4)
    path.write_bytes(data)


def _lies(path: Path, outside: Outside) -> None:
    """Sizes and sums in the table of contents that are not the files'."""
    data = bytearray(path.read_bytes())
    at = data.find(b"PK\1\2")
    while at >= 0:
        data[at + 16 : at + 28] = struct.pack("<3L", 0xDEADBEEF, 0xFFFFFFF0, 0xFFFFFFF0)
        at = data.find(b"PK\1\2", at + 4)
    path.write_bytes(data)


def _unusual(path: Path, outside: Outside) -> None:
    contents = _contents(path)
    with zipfile.ZipFile(path, "w", zipfile.ZIP_STORED) as packed:
        for name, content in contents.items():
            packed.writestr(name, content)
    data = bytearray(path.read_bytes())
    for sign, method in ((b"PK\3\4", 8), (b"PK\1\2", 10)):
        at = data.find(sign)
        while at >= 0:
            data[at + method] = 93  # Zstandard
            at = data.find(sign, at + 4)
    path.write_bytes(data)


_TOO_LARGE = f"more than {MAX_FILE} bytes"
_IGNORED = "There is no notebook of the course in the submission"
_FULL = {"2.1": 2.0, "2.10": 2.0, "2.11": 2.0, "2.12": 3.0}
_ALL = ("q0-1", "q2-1", "q2-10", "q2-11", "q2-12")

FORMS = {
    # Where the course's cells are, and what they are called, does no harm: with right answers, it is an honest hand-in.
    "retagged": Attack(honestly=_ALL, earns=_FULL, spoil=_each(_retag), runs=False),
    "rearranged": Attack(honestly=_ALL, earns=_FULL, spoil=_rearrange, runs=False),
    "doubled": Attack(spoil=_double_answers, trouble=("q2-1 is there 2 times",)),
    "other-types": Attack(spoil=_other_types, runs=False),
    "links": Attack(earns={}, lay=_links, runs=False, trouble=(_IGNORED,)),
    "pipes": Attack(earns={}, lay=_pipes, runs=False, trouble=(_IGNORED,)),
    "deep-folders": Attack(lay=_deep),
    "many-files": Attack(earns={}, lay=_many, runs=False, trouble=("more than 5000 files",)),
    "modules": Attack(lay=_modules, trouble=("course.json names the student",)),
    "odd-notebooks": Attack(earns={}, lay=_odd_notebooks, runs=False, trouble=("not JSON", _TOO_LARGE)),
    "closed": Attack(lay=_closed, exactly=False, runs=False),
    "zip-slip": Attack(zipped=True, lay=_slip),
    "zip-bomb": Attack(zipped=True, earns={}, lay=_bomb, runs=False, trouble=(_TOO_LARGE,)),
    "zip-of-entries": Attack(zipped=True, earns={}, lay=_many_entries, runs=False, trouble=("table of contents",)),
    "zip-encrypted": Attack(zipped=True, earns={}, lay=_encrypted, runs=False, trouble=("it is encrypted",)),
    "zip-that-lies": Attack(zipped=True, earns={}, lay=_lies, runs=False, trouble=("cannot be read",)),
    "zip-unusual": Attack(zipped=True, earns={}, lay=_unusual, runs=False, trouble=("unusual way",)),
}


def _empty(path: Path, outside: Outside) -> None:
    for notebook in path.glob("*.ipynb"):
        notebook.unlink()


_NAMES = ("=1+1", "@SUM(A1)", "+1", "-rf", "[red]x[bold]", "{{7+7}}", "'; DROP TABLE--")
#: Names that are an ID, and are taken for one. One of them has work to hand in, too.
NAMES = {"&lt;img src=x onerror=alert(1)&gt;": Attack()} | {
    name: Attack(earns={}, lay=_empty, runs=False, trouble=(_IGNORED,)) for name in _NAMES
}
#: Names that are none: these are told, and nothing is made of them.
REFUSED = (
    "gradebook.sqlite",
    "grades.csv",
    "<img src=x onerror=alert(1)>",
    "C:\\evil",
    "NUL.evil",
    "evil.",
    "\x1b[31mred",
    "\u202eevil",
    "two\nlines",
    os.fsdecode(b"\xff\xfe"),
    "x" * 81,
)


def remove(folder: Path) -> None:
    """Delete a folder that may be thousands of folders deep, and closed."""
    subprocess.run(["chmod", "-R", "u+rwX", folder], check=True, timeout=300)
    subprocess.run(["rm", "-rf", folder], check=True, timeout=300)
