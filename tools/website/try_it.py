"""Make the page "Try it": a bench in the browser, by rotflex in Pyodide, in a folder for any static server."""

from __future__ import annotations

import shutil
import tempfile
from pathlib import Path
from string import Template
from typing import NamedTuple

from labcourse.grading import course
from labcourse.grading.release.student_course import WHEELS, release
from labcourse.scene import live
from website.staging import ROOT

FOLDER = "try_it"  #: of a site
_FILES = Path(__file__).with_name("page")
_SCENE = Path(live.__file__).parent


class Pyodide(NamedTuple):
    """What computes in the browser: a version, the address of its folder, and how much of it a visitor loads, MB."""

    version: str
    address: str
    megabytes: int


#: As it is tested. A school that hosts it itself writes its own address, from the page's folder on.
TESTED = Pyodide("0.27.7", "https://cdn.jsdelivr.net/pyodide/v0.27.7/full/", 36)


def write(folder: Path, arm: str, pyodide: Pyodide = TESTED) -> None:
    """Put the page into a folder that is not there yet.

    Parameters
    ----------
    folder : where to
    arm : HTML of a recorded swing, which plays until Python is there
    pyodide : which one, and where it lies
    """
    folder.mkdir(parents=True)
    with tempfile.TemporaryDirectory(prefix="rotflex-wheels-") as made:
        # As students get them, without what questions ask for; without their versions, which a server may misread.
        for wheel in (release(course.find(ROOT), Path(made)).folder / WHEELS).iterdir():
            shutil.copyfile(wheel, folder / f"{wheel.name.partition('-')[0]}.whl")
    for name in ("worker.js", "bench.py"):
        shutil.copyfile(_FILES / name, folder / name)
    scene = "\n".join((_SCENE / name).read_text(encoding="utf-8") for name in live._SCRIPTS)
    _write(folder / "page.js", script(scene, (_FILES / "page.js").read_text(encoding="utf-8")))
    styles = [_SCENE / "explorer.css", _FILES / "page.css"]
    _write(folder / "page.css", "\n".join(path.read_text(encoding="utf-8") for path in styles))
    page = Template((_FILES / "index.html").read_text(encoding="utf-8"))
    _write(folder / "index.html", page.substitute(pyodide._asdict(), arm=arm))


def script(explorers: str, page: str) -> str:
    """Make one classic script of the explorers' module and the page's: no server need know what a module is."""
    plain = explorers.replace("export default { render };\n", "").replace("export function", "function")
    return f'"use strict";\nself.explorers = (() => {{\n{plain}\nreturn {{ render }};\n}})();\n{{\n{page}}}\n'


def _write(path: Path, text: str) -> None:
    path.write_text(text, encoding="utf-8", newline="\n")
