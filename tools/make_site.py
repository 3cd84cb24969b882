"""Build the site into build/site; the instructors' own into build/site-instructor.

    python tools/make_site.py [--instructor] [--out FOLDER]

Needs the extra ``site`` and no network. A warning of Sphinx is an error, a dead link for one, and so is what the public
site says of the solutions.
"""

from __future__ import annotations

import argparse
import importlib
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from importlib import resources
from pathlib import Path

import nbformat
from nbformat import NotebookNode
from website import chapters, secrets, staging, try_it

BUILD = staging.ROOT / "build"
KEPT = BUILD / "site-notebooks"  #: runs of the notebooks, which take half a minute
MATHJAX = ("sphinx-mathjax-offline", "static/mathjax/tex-svg.js")  #: distribution, file: formulas without a network
#: The site's first page is ``docs/index.md``, as in the repository.
FRONT = '<!DOCTYPE html><title>rotflex</title><meta http-equiv="refresh" content="0; url=docs/index.html">\n'


def stage(folder: Path, run: Mapping[str, NotebookNode], instructors: bool = False) -> None:
    """Put the pages of a site together, for Sphinx.

    Parameters
    ----------
    folder : where; made
    run : the student notebooks as they were run before any answer
    instructors : whether it is the instructors' site, which has the notebooks with solutions, too
    """
    staging.write(folder, instructors)
    still = arm(moving=False)
    (folder / "docs" / "moving_arm.html").write_text(arm(moving=True), encoding="utf-8")
    for name, notebook in run.items():
        chapters.chapter(notebook, Path(name).stem, folder / "notebooks" / name, chapters.AS_IT_BEGINS, still)
    for path in sorted((staging.ROOT / "solutions").glob("*.ipynb")) if instructors else ():
        notebook = nbformat.read(path, as_version=4)
        chapters.chapter(notebook, path.stem, folder / "solutions" / path.name, chapters.WITH_SOLUTIONS, still)


def arm(moving: bool) -> str:
    """HTML of the moving arm: with a box to stop it, or as it begins."""
    svg = (staging.DOCS / "moving_arm.svg").read_text(encoding="utf-8")
    if not moving:
        # Without blank lines, so that Markdown takes it as one piece of HTML.
        return f'<div class="moving-arm stopped">{svg.strip()}</div>'
    return (
        '<div class="moving-arm"><input type="checkbox" id="arm-stopped"> '
        f'<label for="arm-stopped">Stop the arm</label>\n{svg}</div>\n'
    )


def build(out: Path, run: Mapping[str, NotebookNode], instructors: bool = False) -> int:
    """Build a site, and return 0 if it is good. What is wrong is printed on standard error. See :func:`stage`."""
    with tempfile.TemporaryDirectory(prefix="rotflex-site-") as begun:
        folder, made = Path(begun) / "pages", Path(begun) / "site"
        stage(folder, run, instructors)
        tags = ["-t", "instructor"] if instructors else []
        options = ["-W", "--keep-going", "-q", "-E", "-d", str(Path(begun) / "doctrees"), *tags]
        # A process of its own: autodoc changes the signatures of what it documents, for whoever looks at them later.
        sphinx = [sys.executable, "-m", "sphinx", "-b", "html", "-c", str(staging.DOCS), *options]
        status = subprocess.run([*sphinx, str(folder), str(made)], check=False).returncode
        if status:
            return status
        package, file = MATHJAX
        source = resources.files(importlib.import_module(package)).joinpath(file)
        (made / "_static" / "mathjax.js").write_bytes(source.read_bytes())
        (made / ".buildinfo").unlink(missing_ok=True)
        (made / "index.html").write_text(FRONT, encoding="utf-8")
        try_it.write(made / try_it.FOLDER, arm(moving=True))
        if not instructors:
            found = secrets.of_the_course(run.values()).found_in(made)
            for one in found:
                print(one, file=sys.stderr)
            if found:
                return 1
        shutil.rmtree(out, ignore_errors=True)
        shutil.copytree(made, out)
    return 0


def main(arguments: list[str]) -> int:
    """The command."""
    parser = argparse.ArgumentParser(description="Build the site.")
    parser.add_argument("--instructor", action="store_true", help="the instructors' site, which gives answers away")
    parser.add_argument("--out", type=Path, help="folder; whatever is in it is replaced")
    options = parser.parse_args(arguments)
    out = options.out or BUILD / ("site-instructor" if options.instructor else "site")
    status = build(out, chapters.run_before_answers(KEPT), options.instructor)
    print(f"NOT BUILT: {out}" if status else f"{out}: open index.html")
    return status


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
