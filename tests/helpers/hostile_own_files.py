"""Attacks by what lies beside the notebooks: own files, which come along to a run, ``answers.json``, which is taken for
what was recorded at home, and ``course.json``, which says whose it is, and of which release.
"""

import json
import stat
import warnings
import zipfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from hostile import HONEST, QUESTIONS, Attack
from hostile_answers import changed

Outside = Mapping[str, Any]
Lay = Callable[[Path, Outside], None]


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
_FEW = {
    "folders": [],
    "links": [],
    "files": lambda number: number < 210,
    "bytes": lambda number: number < 35_000_000,
}


def _in_the_way(path: Path, outside: Outside) -> None:
    """Folders that bear the names of files which a run writes."""
    for name in ("answers.json", "cell_reports.jsonl", "Cell_Reports.jsonl", "course.json", ".answers.json.tmp"):
        (path / name).mkdir()
        (path / name / "x.txt").write_text("x")


def _thousands(path: Path, outside: Outside) -> None:
    (path / "many").mkdir()
    for number in range(4_500):
        (path / "many" / f"{number}.txt").write_text("x")


def _large(path: Path, outside: Outside) -> None:
    for number in range(6):
        with (path / f"{number}.bin").open("wb") as file:
            file.truncate(9_900_000 if number else 1 << 32)  # sparse


def _linked(path: Path, outside: Outside) -> None:
    for place, target in enumerate([*outside["secrets"], "/dev/zero", "/proc/self/environ", path.name, "."]):
        (path / f"link{place}.txt").symlink_to(target)
    (path / "helpers.py").symlink_to(outside["secrets"][0])


def _zipped(path: Path, outside: Outside) -> None:
    """Paths that lead away, links, the same name twice, and a name that is a file and a folder."""
    names = [
        "../evil.py",
        "/etc/evil.py",
        "C:\\evil.py",
        "C:/evil.py",
        "a/../../evil.py",
        "..\\..\\evil.py",
        "\\\\host\\evil",
    ]
    names += [
        "evil.py",
        "evil.py",
        "evil.py/evil.txt",
        "./evil.py",
        "a//b.txt",
        "\x1b[2J.txt",
        "NUL.txt",
        "a\u202etxt.py",
    ]
    with warnings.catch_warnings(), zipfile.ZipFile(path, "a") as packed:
        warnings.simplefilter("ignore")  # that names are there twice
        for name in names:
            packed.writestr(name, _PLANTED)
        for target in (outside["secrets"][0], "/etc/passwd", ".."):
            link = zipfile.ZipInfo(f"linked{len(target)}.py")
            link.create_system, link.external_attr = 3, (stat.S_IFLNK | 0o777) << 16
            packed.writestr(link, target)


_MARKUP = "</td><script>alert(1)</script>\x1b[2J\x9b31m\u202e[red]=1+1"


def claim(**content: object) -> Lay:
    """A file that says that all was recorded, but for what is said here."""

    def lay(path: Path, outside: Outside) -> None:
        recorded = {"J_l": {"kind": "number", "value": 0.0033}, "K_s": {"kind": "number", "value": 1.3}}
        book = {"format": 2, "student": path.name, "bench": {"uri": "virtual"}, "software": "", "probe_seed": 1}
        book |= {"answers": {"2.12": recorded}, "cells": {"2.12": {"J_l": _MARKUP, "K_s": "q2-12-answer"}}}
        (path / "answers.json").write_text(json.dumps(book | content))

    return lay


def raw_claim(content: bytes) -> Lay:
    """The file's bytes."""

    def lay(path: Path, outside: Outside) -> None:
        (path / "answers.json").write_bytes(content)

    return lay


_ALL_RIGHT = {
    number: {name: {"kind": "number", "value": 1, "points": 9} for name in ("x", "V")} for number in QUESTIONS
}
_MILLION = b'{"format":2,"answers":{' + b",".join(b'"%d":{}' % number for number in range(1_000_000)) + b"}}"
_NOT_COMPARED = "and is not compared"


def says(**content: object) -> Lay:
    """A course.json with this in it."""

    def lay(path: Path, outside: Outside) -> None:
        (path / "course.json").write_text(json.dumps({"student": path.name, **content}))

    return lay


_POLICY = {"which": "preset", "preset": "workbook", "seed": 10**400, "uri": "qube:0"}
#: Another bench in a file of the present form; the answers are no better for it.
OTHER_BENCH = """
book["bench"] = {"uri": "virtual:?preset=workbook&seed=1", "preset": "workbook", "seed": 10**15, "<b>": [chr(27)]}
book["cells"] = {"2.1": {"V": "<script>" + chr(27) + "[2J" + chr(0x202e)}, "2.12": {"K_s": "../../etc/passwd"}}
book["format"] = 2
"""

OWN_FILES = {
    "own-modules": Attack(
        {"q2-11": _SHADOWED},
        lay=_modules,
        finds={"shadowed": [], "planted": False, "settings": False},
        trouble=("Python has a module numpy already", "it would change matplotlib's settings"),
    ),
    "own-files-in-the-way": Attack(
        {"q2-11": _THERE}, lay=_in_the_way, finds=_FEW, trouble=("a run writes a file of that name",)
    ),
    "thousands-of-own-files": Attack(
        {"q2-11": _THERE}, lay=_thousands, finds=_FEW, trouble=("more files of yours do not come along",)
    ),
    "large-own-files": Attack(
        {"q2-11": _THERE}, lay=_large, finds=_FEW, trouble=("more than 30 MB", "more than 10 MB")
    ),
    "own-files-are-links": Attack({"q2-11": _THERE}, lay=_linked, finds=_FEW, trouble=("it is a link",)),
    "own-files-lead-away": Attack(
        {"q2-11": _THERE}, zipped=True, lay=_zipped, finds=_FEW, trouble=("it is a link", "leads outside")
    ),
    "claims-all": Attack(lay=claim(answers=_ALL_RIGHT, points=13)),
    "claims-in-markup": Attack(
        {"q2-12": "J_l = K_s = None"}, lay=claim(), trouble=("Recorded at home and missing here: 2.12 J_l",)
    ),
    "claims-as-another": Attack(lay=claim(student=HONEST[0])),
    "claims-a-million": Attack(lay=raw_claim(_MILLION), trouble=("answers.json is not read",)),
    "claims-in-depth": Attack(lay=raw_claim(b'{"answers":' + b"[" * 400_000), trouble=(_NOT_COMPARED,)),
    "claims-huge-numbers": Attack(lay=raw_claim(b'{"format":' + b"9" * 400_000 + b"}"), trouble=(_NOT_COMPARED,)),
    "says-it-is-another": Attack(lay=says(student=HONEST[0]), trouble=("course.json names the student",)),
    "says-it-is-anothers-too": Attack(
        lay=says(**{"with": [HONEST[0], *HONEST, "'; DROP TABLE--", "\x1b[2J", 7, ["a"]] * 9}),
        trouble=("which nobody has confirmed",),
    ),
    "says-it-is-with-another": Attack(
        lay=says(student=HONEST[0], **{"with": list(HONEST)}), trouble=("course.json names",)
    ),
    "says-another-release": Attack(
        lay=says(release="../../../etc/" + _MARKUP, draw=10**30, bench=_POLICY, title=_MARKUP, term=["x"] * 99),
        trouble=("is not among the releases",),
    ),
    "other-bench-in-format-2": changed(OTHER_BENCH, "The answers say that they come from another bench"),
}
