"""Attacks by the form of what is handed in: notebooks that are not as they were handed out, odd names, own files beside
them, and words and pictures, which are not run, but read, kept, and shown to people. (Odd files and zips:
tests/grading/intake/test_reading.py.)
"""

import base64
import copy
import os
import stat
import struct
import subprocess
import warnings
import zipfile
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from hostile import IN_WORDS, STIFFNESS, Attack
from hostile_answers import MARKUP

Notebooks = dict[str, dict[str, Any]]
Outside = Mapping[str, Any]
_RIGHT = 'lab.answer("2.12", J_l=lab.joint.J_l, K_s=1.3)'
_PLANTED = "open('/tmp/planted', 'w')\nraise SystemExit('planted')\n"


def _retag(notebooks: Notebooks) -> None:
    """Tags and metadata by which executors and graders pass over cells, or change them; and locked cells edited."""
    tags = ["skip-execution", "raises-exception", "parameters", "injected-parameters", "remove-cell"]
    points = {"grade": True, "points": 1000, "locked": False, "solution": True, "task": True, "schema_version": 3}
    for cell in [cell for notebook in notebooks.values() for cell in notebook["cells"]]:
        if not cell["metadata"].get("nbgrader", {}).get("solution"):
            cell["source"] = f"{_PLANTED}\n{cell['source']}\n{_RIGHT}"
        cell["metadata"]["tags"], cell["metadata"]["nbgrader"] = tags, points | {"grade_id": cell["id"]}
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


_IGNORED = "There is no notebook of the course in the submission"
_FULL = {"2.1": 2.0, "2.10": 2.0, "2.11": 2.0, "2.12": 3.0}
_ALL = ("q0-1", "q2-1", "q2-10", "q2-11", "q2-12")

FORMS = {
    # Where the course's cells are, and what they are called, does no harm: with right answers, it is an honest hand-in.
    "retagged": Attack(honestly=_ALL, earns=_FULL, spoil=_retag, runs=False),
    "rearranged": Attack(honestly=_ALL, earns=_FULL, spoil=_rearrange, runs=False),
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


# --- own files, which come along to a run -----------------------------------------------------------------------------

_SHADOWS = "open('/tmp/planted', 'w')\nanswer = start = loads = dumps = read = print\n"
#: Which of them would be imported in place of what bears the name; in capitals, in letters that look the same, packed.
MODULES = (
    *("numpy.py", "NumPy.PY", "numpy/__init__.py", "numpy/__init__.abi3.so", "numpy.cpython-312-x86_64-linux-gnu.so"),
    *("rotflex/__init__.py", "rotflex/course/lab.py", "Labcourse/answers/cell_reports.py", "rotflex.pyc"),
    *("sitecustomize.py", "usercustomize.py", "__main__.py", "ipykernel_launcher.py", "conftest.py", "evil.pth"),
    *("IPython.py", "ipython/__init__.py", "nbformat.py", "papermill/__init__.py", "json.py", "main.py", "watch.py"),
    *("\uff4e\uff55\uff4d\uff50\uff59.py", "num\u200bpy.py", "nump\u0443.py", "labcourse_inside/__init__.py"),
    *(
        "entrypoints.py",
        "nbclient/__init__.py",
        "labcourse-9.dist-info/entry_points.txt",
        "labcourse-9.dist-info/METADATA",
    ),
    *("matplotlibrc", "Matplotlibrc", "style/matplotlibrc", "ipython_config.py", "ipython_kernel_config.json"),
)
_SHADOWED = """
import colorsys, importlib, json, numpy, matplotlib, rotflex.course.lab, IPython, nbformat
here = (os.getcwd(), os.path.expanduser("~"))
modules = [colorsys, json, numpy, matplotlib, rotflex, rotflex.course.lab, IPython, nbformat]
modules += [sys.modules.get(name) for name in ("sitecustomize", "usercustomize", "ipykernel_launcher", "papermill")]
modules += [sys.modules.get(name) for name in ("entrypoints", "nbclient")]
report["shadowed"] = [one.__name__ for one in modules if str(getattr(one, "__file__", "")).startswith(here)]
report["planted"] = os.path.exists("/tmp/planted")
report["settings"] = matplotlib.matplotlib_fname().startswith(here)
"""


def _modules(path: Path, outside: Outside) -> None:
    for name in MODULES:
        (path / name).parent.mkdir(parents=True, exist_ok=True)
        text = "savefig.format: svg\n" if "matplotlibrc" in name else _SHADOWS
        (path / name).write_text("[papermill.engine]\nlabcourse = main:start\n" if "entry_points" in name else text)


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
            packed.writestr(name, _SHADOWS)
        for target in (outside["secrets"][0], "/etc/passwd", ".."):
            link = zipfile.ZipInfo(f"linked{len(target)}.py")
            link.create_system, link.external_attr = 3, (stat.S_IFLNK | 0o777) << 16
            packed.writestr(link, target)


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
}


# --- words and pictures in text cells ---------------------------------------------------------------------------------

SCRIPTS = f"""
<script>alert(1)</script> <img src=x onerror=alert(1)> <iframe srcdoc="<script>alert(1)</script>"></iframe> {MARKUP}

[a](javascript:alert(1)) [b](data:text/html,<script>alert(1)</script>) <javascript:alert(1)> <https://example.com>
[c]: vbscript:x "onload='alert(1)'"
![d](https://example.com/seen.png "x\\" onerror=alert(1)") ![e](//example.com/f.svg) ![g](file:///etc/passwd) ![h][c]

<svg onload=alert(1)><style>*{{display:none}}</style><base href=//example.com><form action=//example.com><input></form>
<!-- --!> <![CDATA[<script>]]> <?php ?> &lt;script&gt; &#x202e; \u202e \u2066 \x1b[2J \x9b31m [red]x[/red] {{{{ 7*7 }}}}

$\\href{{javascript:alert(1)}}{{x}}$ $\\text{{<script>alert(1)</script>}}$ $$\\def\\a{{\\a\\a}}\\a$$
$\\includegraphics{{/etc/passwd}}$
"""


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def _head(width: int, height: int) -> bytes:
    return _chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 1, 0, 0, 0, 0))


def _png(width: int, height: int, *more: bytes) -> bytes:
    """A picture of zeros: some kilobytes that become so many pixels."""
    packer = zlib.compressobj(9)
    packed = b"".join(packer.compress(bytes(width // 8 + 1)) for _ in range(height)) + packer.flush()
    chunks = [_head(width, height), *more, _chunk(b"IDAT", packed), _chunk(b"IEND", b"")]
    return b"\x89PNG\r\n\x1a\n" + b"".join(chunks)


SVG = b"<svg xmlns='http://www.w3.org/2000/svg' onload='alert(1)'><image href='https://example.com/seen'/></svg>"
PICTURES: dict[str, tuple[str, bytes]] = {
    "bomb.png": ("image/png", _png(9, 9).replace(_head(9, 9), _head(60_000, 60_000))),
    "strip.png": ("image/png", _png(1, 300_000)),
    "text.png": ("image/png", _png(9, 9, _chunk(b"zTXt", b"a\0\0" + zlib.compress(bytes(90 << 20), 9)))),
    "script.png": ("image/png", SVG),
    "\x1b[2J\u202e<script>.png": ("text/html", b"<script>alert(1)</script>"),
    "../../etc/passwd": ("image/png", b""),
}


def _attached(notebooks: Notebooks) -> None:
    """Pasted into the text cell, and shown there."""
    cell = next(cell for cell in notebooks[STIFFNESS]["cells"] if cell["id"] == IN_WORDS)
    cell["source"] += "\n\n" + " ".join(f"![{name}](<attachment:{name}>)" for name in PICTURES)
    cell["attachments"] = {name: {media: base64.b64encode(data).decode()} for name, (media, data) in PICTURES.items()}


WORDS = {
    "words-of-scripts": Attack(words=SCRIPTS),
    "pictures-of-all-sorts": Attack(words="See:", spoil=_attached),
}


def remove(folder: Path) -> None:
    """Delete a folder in which there may be closed ones."""
    subprocess.run(["chmod", "-R", "u+rwX", folder], check=True, timeout=300)
    subprocess.run(["rm", "-rf", folder], check=True, timeout=300)
