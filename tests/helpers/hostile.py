"""A class of students who mean harm, and two who do not: what all of it has in common.

The attacks are data: those made of code in ``hostile_code.py`` and ``hostile_reach.py``, those by cells of their own in
``hostile_cells.py``, those that forge what comes back in ``hostile_answers.py``, those by what is handed in in
``hostile_files.py``. The course is small, its questions and its key are real. Code is run only where it finds itself in
a sandbox, and is bounded in time and memory even there (:data:`PRELUDE`).

What each deserves was worked out by hand from the points in the catalogue: 2.1: expression 2; 2.10: function 2,
figure 1; 2.11: frequency 2, explanation 1, which waits for a person; 2.12: inertia 1, stiffness 2; 2.17: reason 2, in
a text cell, which waits for a person. There is no figure in this course, so 9 of the 13 points can be had at once.
"""

import json
import os
import secrets
import stat
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import nbformat
from made_courses import copied

from labcourse.answers import words
from labcourse.grading import course as courses
from labcourse.grading.release import student_course
from solutions.true_bench import TrueBench

START, PRELAB, STIFFNESS = "00_start.ipynb", "01_modeling_prelab.ipynb", "02_finding_stiffness.ipynb"
QUESTIONS = ("0.1", "2.1", "2.10", "2.11", "2.12", "2.17")
IN_WORDS = "w2-17"  #: the text cell in which the last one is answered
NAMESPACES = ("pid", "net", "mnt", "ipc")
#: What every secret looks like. The attacks know this much, and not the rest.
CANARY = r"canary-[0-9a-f]{32}"
HONEST = ("0-honest", "zz-honest")

#: Comes before every piece of code. Nothing is done unless all is as it is in a sandbox and nowhere else.
PRELUDE = """
import json, os, signal, sys, threading, time
from json import dumps as _dumps, loads as _loads
OUTSIDE = _loads({outside!r})
END = time.monotonic() + 60

def _seen(pid):
    try:
        return open(f"/proc/{{pid}}/cmdline").read()
    except OSError:
        return ""

if (
    os.path.exists(OUTSIDE["marker"])
    or any(os.readlink(f"/proc/self/ns/{{name}}") == there for name, there in OUTSIDE["namespaces"].items())
    or any(OUTSIDE["witness"] in _seen(pid) for pid in os.listdir("/proc") if pid.isdigit())
):
    raise RuntimeError("not in a sandbox: nothing is done")
"""
#: The only attack on what a sandboxed program may do: tell what it found, in an answer that earns nothing.
REPORT = "\nomega_n = globals().get('omega_n')\nexplanation = _dumps({{'inside': True, **report}})\n"


def new_canary() -> str:
    """A secret."""
    return f"canary-{secrets.token_hex(16)}"


@dataclass(frozen=True)
class Attack:
    """A student who means harm.

    Attributes
    ----------
    tries : answer cell's id → code, run after the prelude. What is put into ``report`` in q2-11 is reported.
    honestly : ids of answer cells that are done as they should be
    earns : question → points deserved; nothing for all others
    exactly : whether as much has to be got, or no more
    finds : name in the report → what it should be, or a function that says whether it is right
    trouble : pieces of what should be said in problems, notes or reasons
    zipped : handed in as a zip
    words : what is written into the text cell
    adds : place in the notebook on the stiffness ("first", "parameters", "setup" or "last": before all cells, after the
        one that is called so, or after all) → code of a cell of their own there, run after the prelude
    spoil : what else happens to the notebooks, by file name, before they are handed in
    lay : what else happens to the folder (or to the zip, if ``zipped``) that is handed in
    runs : whether its q2-11 is run, and so reports
    """

    tries: Mapping[str, str] = field(default_factory=dict)
    honestly: tuple[str, ...] = ("q2-1",)
    earns: Mapping[str, float] = field(default_factory=lambda: {"2.1": 2})
    exactly: bool = True
    finds: Mapping[str, Any] = field(default_factory=dict)
    trouble: tuple[str, ...] = ()
    zipped: bool = False
    words: str = ""
    adds: Mapping[str, str] = field(default_factory=dict)
    spoil: Callable[[dict[str, dict[str, Any]]], None] = field(default=lambda notebooks: None)
    lay: Callable[[Path, Mapping[str, Any]], None] = field(default=lambda path, outside: None)
    runs: bool = True


SPECTRUM = """
import numpy as np
def spectrum(x, dt):
    M = 2 ** int(np.ceil(np.log2(len(x))))
    return np.arange(M // 2) / (M * dt), 2 * np.abs(np.fft.fft(x, M)[: M // 2]) / len(x)
"""
_SOLUTIONS = {
    START: {"0.1": ("q0-1", "resolution = 2 * 3.141592653589793 / 4096", "resolution=resolution")},
    PRELAB: {
        "2.1": ("q2-1", "import sympy\nK_s, alpha = sympy.symbols('K_s alpha')\nV = K_s * alpha**2 / 2", "V=V"),
    },
    STIFFNESS: {
        "2.10": ("q2-10", SPECTRUM.strip(), "spectrum=spectrum"),
        "2.11": ("q2-11", "omega_n, explanation = 20.0, 'It swings.'", "omega_n=omega_n, explanation=explanation"),
        "2.12": ("q2-12", "J_l, K_s = 0.0033, 1.3", "J_l=J_l, K_s=K_s"),
    },
}


def course(folder: Path, canary: str) -> Path:
    """A course with few questions, and the real key to them. A secret is in all that students never get."""
    target = copied(folder, more=f"\nSECRET = {canary!r}\nKEY = {{number: KEY[number] for number in {QUESTIONS!r}}}\n")
    for name, questions in _SOLUTIONS.items():
        nbformat.write(_notebook(questions, canary), target / name)
    return target


def _notebook(questions: Mapping[str, tuple[str, str, str]], canary: str) -> nbformat.NotebookNode:
    parameters = nbformat.v4.new_code_cell('student = ""\nbench = "virtual"', id="parameters")
    parameters.metadata["tags"] = ["parameters"]
    secret = nbformat.v4.new_markdown_cell(f"For instructors: {canary}", id="secret")
    secret.metadata["tags"] = ["instructor"]
    cells = [
        parameters,
        secret,
        _cell("setup", "import rotflex.course.lab\nlab = rotflex.course.lab.start(student, bench)", False),
    ]
    if "2.11" in questions:
        cells.append(_words_cell(canary))
    for number, (cell_id, source, parts) in questions.items():
        solution = f"### BEGIN SOLUTION\n{source}  # {canary}\n### END SOLUTION"
        cells += [_cell(cell_id, solution, True), _cell(f"{cell_id}-answer", f'lab.answer("{number}", {parts})', False)]
    return nbformat.v4.new_notebook(cells=cells)


def _cell(cell_id: str, source: str, answer: bool) -> nbformat.NotebookNode:
    cell = nbformat.v4.new_code_cell(source, id=cell_id)
    cell.metadata["nbgrader"] = _grading(cell_id, answer)
    return cell


def _words_cell(canary: str) -> nbformat.NotebookNode:
    source = f"{words.heading('Your answer: 2.17, reason')}\n\n{words.BEGIN}\nFriction. {canary}\n{words.END}"
    cell = nbformat.v4.new_markdown_cell(source, id=IN_WORDS)
    cell.metadata["nbgrader"] = _grading(IN_WORDS, True)
    cell.metadata[words.KEY] = {"question": "2.17", "part": "reason"}
    return cell


def _grading(cell_id: str, answer: bool) -> dict[str, Any]:
    about = {"grade": answer, "grade_id": cell_id, "locked": not answer, "schema_version": 3, "solution": answer}
    return about | {"task": False} | ({"points": 1} if answer else {})


def honest(student: str, canary: str = "") -> dict[str, str]:
    """All answer cells, done as they should be."""
    bench = TrueBench(student)
    sources = {cell: source for questions in _SOLUTIONS.values() for cell, source, _ in questions.values()}
    sources["q2-11"] = f"omega_n = {bench.omega_n:.4g}\nexplanation = 'The link holds the servo still. {canary}'"
    sources["q2-12"] = f"J_l = {bench.J_l!r}\nK_s = {bench.K_s:.4g}"
    sources[IN_WORDS] = f"The *friction* of the joint, $b$, is not in the model.\n\n1. {canary or 'nothing'}\n2. more"
    return sources


def written(student: str, attack: Attack, outside: Mapping[str, Any]) -> dict[str, str]:
    """The answer cells of one who means harm."""
    proper = honest(student)
    sources = {cell: proper[cell] for cell in attack.honestly}
    for cell, code in {"q2-11": "", **attack.tries}.items():
        if cell in sources and cell not in attack.tries:
            continue
        prelude = prelude_for(outside)
        if cell == "q2-11":
            sources[cell] = f"{prelude}\nreport = {{}}\n{code}\n{REPORT.format()}"
        else:
            sources[cell] = f"{prelude}\n{code}\n"
    if attack.words:
        sources[IN_WORDS] = attack.words
    return sources


def prelude_for(outside: Mapping[str, Any]) -> str:
    """What comes before every piece of code."""
    return PRELUDE.format(outside=json.dumps(dict(outside)))


def add_cells(notebooks: dict[str, dict[str, Any]], adds: Mapping[str, str], outside: Mapping[str, Any]) -> None:
    """Put cells of their own into the notebook on the stiffness."""
    cells = notebooks[STIFFNESS]["cells"]
    for where, code in adds.items():
        after = {"first": 0, "last": len(cells)}.get(where)
        if after is None:
            after = 1 + next(place for place, cell in enumerate(cells) if cell["id"] == where)
        cell = {"id": f"own-{where}", "cell_type": "code", "metadata": {}, "outputs": [], "execution_count": None}
        cells.insert(after, {**cell, "source": f"{prelude_for(outside)}\n{code}\n"})


def filled_in(source: Path, writes: Mapping[str, str]) -> dict[str, dict[str, Any]]:
    """The student notebooks with these sources in their answer cells."""
    filled: dict[str, dict[str, Any]] = {
        name: json.loads(text) for name, text in student_course.derive_notebooks(courses.load(source)).items()
    }
    for notebook in filled.values():
        for cell in notebook["cells"]:
            if cell["id"] in writes:
                cell["source"] = writes[cell["id"]]
    return filled


def save(folder: Path, files: Mapping[str, str]) -> None:
    """Write files into a folder that is made for them."""
    folder.mkdir(parents=True)
    for name, text in files.items():
        (folder / name).write_text(text, encoding="utf-8")


def namespaces() -> dict[str, str]:
    """Which namespaces we are in."""
    return {name: os.readlink(f"/proc/self/ns/{name}") for name in NAMESPACES}


def state(folders: Iterable[Path]) -> dict[str, tuple[int, int, int, int, bytes]]:
    """All that is in some folders, ten folders deep: path → what there is to know about it, and its content."""
    found = {}
    waiting = [(folder, 0) for folder in folders]
    while waiting:
        path, depth = waiting.pop()
        about = path.lstat()
        small = stat.S_ISREG(about.st_mode) and about.st_size < 10**7
        content = path.read_bytes() if small else b""
        found[str(path)] = (about.st_mode, about.st_uid, about.st_size, about.st_mtime_ns, content)
        if stat.S_ISDIR(about.st_mode) and depth < 10 and os.access(path, os.R_OK | os.X_OK):
            waiting += [(below, depth + 1) for below in path.iterdir()]
    return found
