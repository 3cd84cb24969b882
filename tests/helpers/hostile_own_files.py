"""Attacks by what lies beside the notebooks: own files, which come along to a run, ``answers.json``, which is taken for
what was recorded at home, and ``course.json``, which says whose it is, and of which release.
"""

import json
import stat
import warnings
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from hostile import HONEST, QUESTIONS, Attack

Outside = Mapping[str, Any]


_PLANTED = "open('/tmp/planted', 'w')\nanswer = start = loads = dumps = read = print\n"
#: Which of them would be imported in place of what bears the name; in capitals, in letters that look the same, packed.
MODULES = (
    *("numpy.py", "NumPy.PY", "numpy/__init__.py", "numpy/__init__.abi3.so", "numpy.cpython-312-x86_64-linux-gnu.so"),
    *("rotflex/__init__.py", "rotflex/course/lab.py", "Labcourse/answers/cell_reports.py", "rotflex.pyc"),
    *("sitecustomize.py", "usercustomize.py", "__main__.py", "ipykernel_launcher.py", "conftest.py", "evil.pth"),
    *("IPython.py", "ipython/__init__.py", "nbformat.py", "papermill/__init__.py", "json.py", "main.py", "watch.py"),
    *("\uff4e\uff55\uff4d\uff50\uff59.py", "num\u200bpy.py", "nump\u0443.py", "labcourse_inside/__init__.py"),
    *("matplotlibrc", "Matplotlibrc", "style/matplotlibrc", "ipython_config.py", "ipython_kernel_config.json"),
)
_SHADOWED = """
import colorsys, importlib, json, numpy, matplotlib, rotflex.course.lab, IPython, nbformat
here = (os.getcwd(), os.path.expanduser("~"))
modules = [colorsys, json, numpy, matplotlib, rotflex, rotflex.course.lab, IPython, nbformat]
modules += [sys.modules.get(name) for name in ("sitecustomize", "usercustomize", "ipykernel_launcher", "papermill")]
report["shadowed"] = [one.__name__ for one in modules if str(getattr(one, "__file__", "")).startswith(here)]
report["planted"] = os.path.exists("/tmp/planted")
report["settings"] = matplotlib.matplotlib_fname().startswith(here)
"""


def _modules(path: Path, outside: Outside) -> None:
    for name in MODULES:
        (path / name).parent.mkdir(parents=True, exist_ok=True)
        (path / name).write_text("savefig.format: svg\n" if "matplotlibrc" in name else _PLANTED)


_THERE = """
report["folders"] = [name for name in ("answers.json", "cell_reports.jsonl", "course.json") if os.path.isdir(name)]
report["files"] = sum(len(files) for _, _, files in os.walk("."))
report["bytes"] = sum(os.path.getsize(os.path.join(at, one)) for at, _, files in os.walk(".") for one in files)
report["links"] = [one for at, _, files in os.walk(".") for one in files if os.path.islink(os.path.join(at, one))]
"""
_FEW = {"folders": [], "links": [], "files": lambda number: number < 210, "bytes": lambda number: number < 35_000_000}


def _zipped(path: Path, outside: Outside) -> None:
    """Paths that lead away, links, the same name twice, and a name that is a file and a folder."""
    names = ["../evil.py", "/etc/evil.py", "C:\\evil.py", "a/../../evil.py", "..\\..\\evil.py", "\\\\host\\evil"]
    names += ["evil.py", "evil.py", "evil.py/evil.txt", "./evil.py", "a//b.txt", "\x1b[2J.txt", "NUL.txt", "a\u202e.py"]
    with warnings.catch_warnings(), zipfile.ZipFile(path, "a") as packed:
        warnings.simplefilter("ignore")  # that names are there twice
        for name in names:
            packed.writestr(name, _PLANTED)
        for target in (outside["secrets"][0], "/etc/passwd", ".."):
            link = zipfile.ZipInfo(f"linked{len(target)}.py")
            link.create_system, link.external_attr = 3, (stat.S_IFLNK | 0o777) << 16
            packed.writestr(link, target)


_MARKUP = "</td><script>alert(1)</script>\x1b[2J\x9b31m\u202e[red]=1+1"


_ALL_RIGHT = {
    number: {name: {"kind": "number", "value": 1, "points": 9} for name in ("x", "V")} for number in QUESTIONS
}


def _claims(path: Path, outside: Outside) -> None:
    """A file that says that all was recorded, in cells that do harm where their names are shown."""
    book = {"format": 2, "student": path.name, "bench": {"uri": "virtual"}, "software": "", "probe_seed": 1}
    book |= {"answers": _ALL_RIGHT, "cells": {"2.12": {"J_l": _MARKUP, "K_s": "q2-12-answer"}}, "points": 13}
    (path / "answers.json").write_text(json.dumps(book))


def _says_it_is_anothers(path: Path, outside: Outside) -> None:
    partners = [*HONEST, *HONEST, "'; DROP TABLE--", "\x1b[2J", 7, ["a"]] * 9
    (path / "course.json").write_text(json.dumps({"student": path.name, "with": partners}))


OWN_FILES = {
    "own-modules": Attack(
        {"q2-11": _SHADOWED},
        lay=_modules,
        finds={"shadowed": [], "planted": False, "settings": False},
        trouble=("Python has a module numpy already", "it would change matplotlib's settings"),
    ),
    "own-files-lead-away": Attack(
        {"q2-11": _THERE}, zipped=True, lay=_zipped, finds=_FEW, trouble=("it is a link", "leads outside")
    ),
    "claims-all": Attack(lay=_claims),
    "says-it-is-anothers-too": Attack(lay=_says_it_is_anothers, trouble=("which nobody has confirmed",)),
}
