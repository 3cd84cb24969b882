"""Make a site of a release: the whole course in a browser, by JupyterLite, for any static server.

The site holds all that it needs: JupyterLab, Pyodide, the students' wheels, and those of the libraries that Pyodide has
not. Nothing is resolved in the browser: its ``pyodide-lock.json`` lists all packages, each with its hash.
"""

from __future__ import annotations

import hashlib
import html
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import urllib.request
import zipfile
from collections.abc import Iterator
from email.parser import Parser
from pathlib import Path
from string import Template
from typing import Any, NamedTuple

from labcourse import files
from labcourse.courses import NOTEBOOKS
from labcourse.errors import GradingError
from labcourse.grading.course import Course
from labcourse.grading.release import releases
from labcourse.grading.release.student_course import WHEELS, release


class Stack(NamedTuple):
    """Versions of JupyterLite, of its kernel and of Pyodide, and the public address of Pyodide's files."""

    jupyterlite: str
    kernel: str
    pyodide: str
    address: str


#: As it is tested.
TESTED = Stack("0.5.1", "0.5.2", "0.27.7", "https://cdn.jsdelivr.net/pyodide/v0.27.7/full/")

PYODIDE = "pyodide"  #: folder of the site
EXTENSION = "labcourse_browser"  #: of JupyterLab, for this site alone
_PAGE = Path(__file__).with_name("lite_page")
_SETTINGS = files.KERNEL.parent / "labconfig" / "default_setting_overrides.json"
_KERNEL = "@jupyterlite/pyodide-kernel-extension"
#: JupyterLab's side of the widgets, for the JupyterLab that is in JupyterLite.
_ANYWIDGET = "anywidget==0.9.18"
_EXTENSIONS = ("jupyterlab_widgets==3.0.13", _ANYWIDGET)
#: Libraries that Pyodide has not, in versions that were tested: all are pure Python.
_WHEELS = (
    *(_ANYWIDGET, "click==8.1.8", "comm==0.2.2", "control==0.10.2", "fastjsonschema==2.21.1"),
    *("ipywidgets==8.1.5", "markdown-it-py==3.0.0", "mdurl==0.1.2", "mpmath==1.3.0", "psygnal==0.11.1"),
    *("rich==13.9.4", "shellingham==1.5.4", "sympy==1.13.3", "tqdm==4.67.1", "typer==0.15.4"),
    "typing-extensions==4.12.2",
)
_CORE = ("pyodide.js", "pyodide.asm.js", "pyodide.asm.wasm", "python_stdlib.zip")
_OF_KERNEL = ("ipython", "micropip", "sqlite3", "ssl")  # JupyterLite's kernel asks for these
#: What a browser cannot have, and a student there does not need.
_NOT_THERE = {"ipykernel", "jupyterlab", "papermill", "widgetsnbextension", "jupyterlab-widgets"}
_REQUIREMENT = re.compile(r"[A-Za-z0-9._-]+")


def make(course: Course, out: Path, pyodide: str = TESTED.address) -> Path:
    """Make the site in a folder that is not there yet, store its release, which grading needs, and return its zip.

    Parameters
    ----------
    course : of which a release is made
    out : the folder
    pyodide : folder or address of Pyodide's files (its distribution called "full")

    Raises
    ------
    GradingError
        If there is such a folder, if pip or Pyodide's files cannot be reached, or if a browser cannot have a package
        that the course requires.
    """
    if out.exists():
        raise GradingError(f"There is {out} already: remove it, or choose another place.")
    out.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix=".labcourse-lite-", dir=out.parent) as scratch:
        place = Path(scratch)
        made = release(course, place / "release")
        wheels = [*(made.folder / WHEELS).iterdir(), *_downloaded(place / "wheels")]
        packages = place / PYODIDE
        names = _put_packages(packages, wheels, pyodide if "://" in pyodide else Path(pyodide).resolve().as_uri())
        site = _jupyterlite(place, made.folder / NOTEBOOKS, names)
        packages.replace(site / PYODIDE)
        page = Template((_PAGE / "index.html").read_text(encoding="utf-8"))
        about = {"title": html.escape(course.title), "first": made.notebooks[0]}
        files.write(site / "index.html", page.substitute(about))
        lab = site / "lab" / "index.html"
        alone = (_PAGE / "alone.html").read_text(encoding="utf-8")
        files.write(lab, lab.read_text(encoding="utf-8").replace("<head>", f"<head>\n{alone}", 1))
        stored = releases.store(course, made.archive, made.id)
        site.replace(out)
    return stored


def _jupyterlite(place: Path, notebooks: Path, packages: list[str]) -> Path:
    """Let JupyterLite build its site with the notebooks in it, and a kernel that begins with these packages."""
    tools = place / "tools"
    pins = (f"jupyterlite-core=={TESTED.jupyterlite}", f"jupyterlite-pyodide-kernel=={TESTED.kernel}")
    _pip("install", "--target", str(tools), *pins)
    _pip("install", "--no-deps", "--target", str(place / "extensions"), *_EXTENSIONS)
    source, site = place / "source", place / "site"
    shutil.copytree(notebooks, source / "files" / NOTEBOOKS)
    shutil.copyfile(_SETTINGS, source / "overrides.json")
    kernel = {
        "pyodideUrl": f"./{PYODIDE}/pyodide.js",
        "disablePyPIFallback": True,
        "loadPyodideOptions": {"lockFileURL": f"{PYODIDE}/pyodide-lock.json", "packages": packages},
    }
    settings = {"litePluginSettings": {f"{_KERNEL}:kernel": kernel}}
    content = {"jupyter-lite-schema-version": 0, "jupyter-config-data": settings}
    files.write(source / "jupyter-lite.json", json.dumps(content))
    ours, theirs = (place / folder / "share/jupyter/labextensions" for folder in ("extensions", "tools"))
    extensions = [ours / "@jupyter-widgets/jupyterlab-manager", ours / "anywidget", theirs / _KERNEL, _PAGE / EXTENSION]
    build = {
        "apps": ["lab"],
        "contents": ["files"],
        "output_dir": str(site),
        "federated_extensions": [str(folder) for folder in extensions],
        "ignore_sys_prefix": ["federated_extensions"],
    }
    files.write(source / "jupyter_lite_config.json", json.dumps({"LiteBuildConfig": build}))
    command = [sys.executable, "-m", "jupyterlite_core", "build"]
    _run(command, cwd=source, env={**os.environ, "PYTHONPATH": str(tools)})
    return site


def _downloaded(folder: Path) -> Iterator[Path]:
    """Have pip download the libraries' wheels, as the browser's Python takes them."""
    options = ("--no-deps", "--only-binary=:all:", "--platform=any", "--python-version=3.12")
    _pip("download", *options, "--dest", str(folder), *_WHEELS)
    yield from sorted(folder.iterdir())


def _pip(command: str, *arguments: str) -> None:
    _run([sys.executable, "-m", "pip", command, "--quiet", "--disable-pip-version-check", *arguments])


def _run(command: list[str], **options: Any) -> None:
    done = subprocess.run(command, capture_output=True, text=True, check=False, **options)
    if done.returncode:
        what = " ".join(command[2:4])
        raise GradingError(f"{what} failed: {(done.stderr or done.stdout).strip()[-600:]}")


def _read(place: str, name: str, sha256: str = "") -> bytes:
    """Return a file of Pyodide's. Raises GradingError if it is not there, or not the one with the hash."""
    address = f"{place.rstrip('/')}/{name}"
    try:
        with urllib.request.urlopen(address, timeout=60) as answer:
            data: bytes = answer.read()
    except OSError as error:
        raise GradingError(f"Pyodide's {name} cannot be read: {address}: {getattr(error, 'reason', error)}.") from None
    if sha256 and hashlib.sha256(data).hexdigest() != sha256:
        raise GradingError(f"{address} is not the file that Pyodide's list of packages names.")
    return data


def _put_packages(folder: Path, wheels: list[Path], source: str) -> list[str]:
    """Put Pyodide and all packages into a folder, with a list of them; return the names of the wheels' packages."""
    lock = json.loads(_read(source, "pyodide-lock.json"))
    if lock["info"]["version"] != TESTED.pyodide:
        raise GradingError(f"That is Pyodide {lock['info']['version']}; the tested one is {TESTED.pyodide}.")
    theirs, ours = lock["packages"], dict(map(_entry, wheels))
    wanted, left = {}, [*_OF_KERNEL, *ours]
    while left:
        name = left.pop()
        if name in wanted:
            continue
        if name not in ours and name not in theirs:
            raise GradingError(f"A browser cannot have {name}, which the course requires: Pyodide has no such package.")
        wanted[name] = ours.get(name) or theirs[name]
        left += map(_canonical, wanted[name]["depends"])
    folder.mkdir()
    for name in _CORE:
        (folder / name).write_bytes(_read(source, name))
    for entry in (theirs[name] for name in wanted.keys() - ours.keys()):
        (folder / entry["file_name"]).write_bytes(_read(source, entry["file_name"], entry["sha256"]))
    for wheel in wheels:
        shutil.copyfile(wheel, folder / _file_name(wheel))
    listed = {**lock, "packages": dict(sorted(wanted.items()))}
    files.write(folder / "pyodide-lock.json", json.dumps(listed, indent=1))
    return sorted(ours)


def _file_name(wheel: Path) -> str:
    """Return a wheel's name without the local part of its version, which servers may misread."""
    return re.sub(r"\+[^-]*", "", wheel.name)


def _canonical(name: str) -> str:
    return re.sub(r"[-_.]+", "-", name).lower()


def _entry(wheel: Path) -> tuple[str, dict[str, Any]]:
    """Return a wheel's name and its entry in Pyodide's list of packages."""
    with zipfile.ZipFile(wheel) as packed:
        [metadata] = [name for name in packed.namelist() if name.endswith(".dist-info/METADATA")]
        about = Parser().parsestr(packed.read(metadata).decode())
        modules = {name.partition("/")[0].removesuffix(".py") for name in packed.namelist() if name.endswith(".py")}
    required = (text for text in about.get_all("Requires-Dist", ()) if ";" not in text)
    depends = {_canonical(match[0]) for text in required if (match := _REQUIREMENT.match(text))}
    name = _canonical(about["Name"])
    return name, {
        "name": name,
        "version": about["Version"].partition("+")[0],
        "file_name": _file_name(wheel),
        "install_dir": "site",
        "sha256": hashlib.sha256(wheel.read_bytes()).hexdigest(),
        "package_type": "package",
        "imports": sorted(modules),
        "depends": sorted(depends - _NOT_THERE),
        "unvendored_tests": False,
    }
