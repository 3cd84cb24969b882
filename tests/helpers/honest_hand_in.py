"""One honest student's hand-in: their notebooks, changed as they did it, and put where an instructor finds them."""

from __future__ import annotations

import copy
import hashlib
import io
import json
import re
import zipfile
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

Notebook = dict[str, Any]
Cell = dict[str, Any]
Files = dict[str, bytes]
Build = Callable[[Path, Mapping[str, Notebook]], None]

_STUB = re.compile(r"^[ \t]*# Your code here\.$", re.MULTILINE)
_CODE = re.compile(r"^[ \t]*### BEGIN SOLUTION\n(.*?)\n[ \t]*### END SOLUTION$", re.MULTILINE | re.DOTALL)
_WORDS = re.compile(r"^<!-- BEGIN SOLUTION -->\n(.*?)\n<!-- END SOLUTION -->$", re.MULTILINE | re.DOTALL)
STUB_OF_WORDS = (
    "*Double-click here, and write in place of this line. Formulas between `$` signs and pasted pictures are welcome.*"
)


@dataclass(frozen=True)
class Way:
    """One way of handing in.

    ``build(folder, solved)`` puts it into a class's folder. ``solved`` maps file names to solved student notebooks.

    ``lost``: the questions that may cost points; where there are none, full marks are due. ``told``: what the student
    must read somewhere in what they are told, as regular expressions (to be searched for in all of it, in any
    capitals). ``change``: what it changes in a student's work, where that is all that it does.
    """

    name: str
    build: Build
    student: str
    lost: frozenset[str] = frozenset()
    told: tuple[str, ...] = ()
    change: Callable[[Work], None] | None = None

    def __str__(self) -> str:
        return self.name


class Ways(list[Way]):
    """Ways, collected by the functions that build them: a function's name is the way's, its docstring what was done."""

    def changed(self, **about: Any) -> Callable[[Callable[[Work], None]], None]:
        """A function that changes a student's work, which is then handed in as a folder named by their ID."""

        def enter(change: Callable[[Work], None]) -> None:
            def put(folder: Path, work: Work) -> None:
                change(work)
                as_folder(folder / work.student, work.contents())

            self._add(change, put, {**about, "change": change})

        return enter

    def packed(self, **about: Any) -> Callable[[Callable[[Path, Work], None]], None]:
        """A function that puts a student's work into the class's folder by itself."""

        def enter(put: Callable[[Path, Work], None]) -> None:
            self._add(put, put, about)

        return enter

    def _add(self, function: Callable[..., None], put: Callable[[Path, Work], None], about: dict[str, Any]) -> None:
        name = function.__name__.replace("_", "-")
        student = about.pop("student", name)
        lost = frozenset(about.pop("lost", ()))

        def build(folder: Path, solved: Mapping[str, Notebook]) -> None:
            put(folder, Work(solved, student))

        self.append(Way(name=name, build=build, student=student, lost=lost, **about))


@dataclass
class Work:
    """A student's folder of solved notebooks, to be changed; what lies beside them is in ``files``, by its path."""

    solved: Mapping[str, Notebook]
    student: str
    files: Files = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.notebooks = {name: copy.deepcopy(notebook) for name, notebook in sorted(self.solved.items())}
        self.set_student(self.student)

    def set_student(self, student: str) -> None:
        """Write an ID into ``course.json``, as ``rotflex lab --student ID`` does."""
        self.files["course.json"] = json.dumps({"student": student}).encode()

    def name(self, number: str) -> str:
        """The name of the notebook that begins so, as ``"02"``."""
        (name,) = (name for name in self.notebooks if name.startswith(number))
        return name

    def place(self, cell: str, number: str = "") -> tuple[list[Cell], int]:
        """The list of cells that a cell is in, and where. Name the notebook where several have a cell of this id."""
        found = [
            (notebook["cells"], index)
            for name, notebook in self.notebooks.items()
            for index, each in enumerate(notebook["cells"])
            if each.get("id") == cell and name.startswith(number)
        ]
        (only,) = found
        return only

    def cell(self, cell: str, number: str = "") -> Cell:
        cells, index = self.place(cell, number)
        return cells[index]

    def write(self, cell: str, text: str, number: str = "") -> None:
        """Put a text in place of all that is in a cell."""
        self.cell(cell, number)["source"] = text.splitlines(keepends=True)

    def replace(self, cell: str, old: str, new: str, number: str = "") -> None:
        """Change a part of a cell, which must be there."""
        text = text_of(self.cell(cell, number))
        assert old in text, f"{cell} has no {old!r}"
        self.write(cell, text.replace(old, new), number)

    def before(self, cell: str, *new: Cell, number: str = "") -> None:
        cells, index = self.place(cell, number)
        cells[index:index] = new

    def after(self, cell: str, *new: Cell, number: str = "") -> None:
        cells, index = self.place(cell, number)
        cells[index + 1 : index + 1] = new

    def delete(self, cell: str, number: str = "") -> Cell:
        cells, index = self.place(cell, number)
        return cells.pop(index)

    def contents(self) -> Files:
        """All files of the folder; notebooks as JupyterLab writes them."""
        return {**{name: written(notebook) for name, notebook in self.notebooks.items()}, **self.files}


def touched(way: Way, solved: Mapping[str, Notebook]) -> set[str]:
    """Return the files, cells, and orders of cells that a way changes in a student's work."""
    before, after = Work(solved, way.student), Work(solved, way.student)
    assert way.change is not None
    way.change(after)
    files = before.files.keys() | after.files.keys()
    found = {name for name in files if before.files.get(name) != after.files.get(name)}
    for name, notebook in before.notebooks.items():
        old = {cell["id"]: cell for cell in notebook["cells"]}
        there = name in after.notebooks and name not in after.files
        new = {cell.get("id"): cell for cell in after.notebooks[name]["cells"]} if there else {}
        found |= {f"{name} {cell}" for cell in old.keys() | new.keys() if old.get(cell) != new.get(cell)}
        if [cell for cell in old if cell in new] != [cell for cell in new if cell in old]:
            found.add(f"{name}, order")
    return found


def together(ways: Iterable[Way]) -> Way:
    """Return the submission of one student who did all of this.

    `ways` are in the order of `packed`: the way that touches most comes first. It is done last, since it may replace a
    whole notebook.
    """
    chosen = list(ways)

    def build(folder: Path, solved: Mapping[str, Notebook]) -> None:
        work = Work(solved, chosen[0].student)
        for way in reversed(chosen):
            assert way.change is not None
            way.change(work)
        as_folder(folder / work.student, work.contents())

    return Way(
        name=" + ".join(way.name for way in chosen),
        build=build,
        student=chosen[0].student,
        lost=frozenset().union(*(way.lost for way in chosen)),
        told=tuple(pattern for way in chosen for pattern in way.told),
    )


def written(notebook: Notebook, **options: Any) -> bytes:
    """A notebook's file."""
    return (json.dumps(notebook, **{"indent": 1, "ensure_ascii": False, **options}) + "\n").encode()


def text_of(cell: Cell) -> str:
    source = cell["source"]
    return source if isinstance(source, str) else "".join(source)


def _added(kind: str, text: str, **more: Any) -> Cell:
    name = hashlib.sha256(f"{kind} {text}".encode()).hexdigest()[:8]  # as JupyterLab's ids look
    return {"cell_type": kind, "id": name, "metadata": {}, "source": text.splitlines(keepends=True), **more}


def code(text: str) -> Cell:
    """A code cell that a student added."""
    return _added("code", text.strip("\n"), execution_count=None, outputs=[])


def markdown(text: str) -> Cell:
    """A text cell that a student added."""
    return _added("markdown", text.strip("\n"))


def is_answer(cell: Cell) -> bool:
    return bool(cell["metadata"].get("nbgrader", {}).get("solution"))


def as_folder(place: Path, files: Mapping[str, bytes]) -> None:
    """Write files below a folder."""
    for name, content in files.items():
        path = place / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)


def zipped(files: Mapping[str, bytes]) -> bytes:
    """A zip of files."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in files.items():
            archive.writestr(name, content)
    return buffer.getvalue()


def released_notebooks(root: Path) -> dict[str, Notebook]:
    """The student notebooks as they are released: file name → notebook."""
    paths = sorted((root / "notebooks").glob("*.ipynb"))
    return {path.name: json.loads(path.read_text(encoding="utf-8")) for path in paths}


def solved_notebooks(root: Path) -> dict[str, Notebook]:
    """The student notebooks with the solutions' answers written into their answer cells, code and words."""
    solved = released_notebooks(root)
    for name, notebook in solved.items():
        source = json.loads((root / "solutions" / name).read_text(encoding="utf-8"))
        solutions = {cell["id"]: text_of(cell) for cell in source["cells"]}
        for cell in filter(is_answer, notebook["cells"]):
            cell["source"] = _solved(cell, solutions[cell["id"]]).splitlines(keepends=True)
    return solved


def _solved(cell: Cell, solution: str) -> str:
    if cell["cell_type"] == "markdown":
        (words,) = _WORDS.findall(solution)
        return text_of(cell).replace(STUB_OF_WORDS, words)
    blocks = iter(_CODE.findall(solution))
    text = _STUB.sub(lambda _: next(blocks), text_of(cell))
    assert next(blocks, None) is None, f"{cell['id']} has fewer stubs than solutions"
    return text
