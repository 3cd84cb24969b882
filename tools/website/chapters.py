"""The notebooks as chapters: what a student sees who runs one before answering anything.

They are run once for each state of notebooks and package, and kept. Pictures become files, with their descriptions;
an explorer, which needs Python behind it, becomes a drawing of its bench and a sentence that says so.
"""

from __future__ import annotations

import base64
import copy
import hashlib
import os
import re
import shutil
import tempfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import nbformat
from nbformat import NotebookNode

from website.staging import ROOT, is_for_instructors

NOTEBOOKS = ROOT / "notebooks"
VIEW = "application/vnd.jupyter.widget-view+json"
_LINK = re.compile(r"\]\((?P<notebook>\d\d_\w+\.ipynb)?(?:#(?P<heading>[^)\s]+))?\)")
_CELL = "cell-id="
CELL_TIMEOUT = 120  # s; the slowest takes three
#: No bars, which end up as lines of their own; and one thread, for there may be other programs.
QUIET = {"TQDM_DISABLE": "1", "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}

AS_IT_BEGINS = """
:::{{note}}
This is the notebook `{name}` as it is **before anything is answered**, run with the bench of a student called “demo”.
To answer, run experiments and use the explorers, open the notebook itself: see [For students](../docs/student.md).
:::
"""
WITH_SOLUTIONS = """
:::{{warning}}
`{name}` **with its solutions**, as it was run last. It is for instructors: do not pass this page on to students.
:::
"""
EXPLORER = "*Here the notebook has an explorer: {what} It needs Python behind it, so this page shows {shown}.*"


def run_before_answers(kept: Path) -> dict[str, NotebookNode]:
    """The student notebooks with what their cells show, by file name.

    Parameters
    ----------
    kept : folder in which runs are kept, by what they depend on
    """
    folder = kept / _digest()
    if not folder.is_dir():
        shutil.rmtree(kept, ignore_errors=True)
        kept.mkdir(parents=True)
        with tempfile.TemporaryDirectory(dir=kept, prefix="begun-") as begun:
            for name, notebook in _run(Path(begun) / "work"):
                nbformat.write(notebook, Path(begun) / name)
            shutil.rmtree(Path(begun) / "work")
            shutil.copytree(begun, folder)
    return {path.name: nbformat.read(path, as_version=4) for path in sorted(folder.glob("*.ipynb"))}


def _digest() -> str:
    """Of the notebooks, and of all that students' copies have of the package."""
    digest = hashlib.sha256(Path(__file__).read_bytes())
    package = ROOT / "rotflex"
    files = (path for path in package.rglob("*") if path.suffix in (".py", ".js", ".css", ".toml"))
    ours = (path for path in files if not is_for_instructors(path.relative_to(ROOT).as_posix()))
    for path in sorted([*ours, *NOTEBOOKS.glob("*.ipynb")]):
        digest.update(path.relative_to(ROOT).as_posix().encode() + b"\0" + path.read_bytes() + b"\0")
    return digest.hexdigest()[:32]


def _run(folder: Path) -> Iterator[tuple[str, NotebookNode]]:
    """Run all, one after the other, in a folder that looks like a student's."""
    from nbclient import NotebookClient

    shutil.copytree(NOTEBOOKS, folder)
    paths = os.pathsep.join(filter(None, [str(ROOT), os.environ.get("PYTHONPATH", "")]))
    with tempfile.TemporaryDirectory(prefix="site-ipython-") as settings:
        environment = os.environ | {**QUIET, "IPYTHONDIR": settings, "PYTHONPATH": paths}
        environment.pop("LABCOURSE_PICTURES", None)
        for path in sorted(NOTEBOOKS.glob("*.ipynb")):
            notebook = nbformat.read(path, as_version=4)
            client = NotebookClient(
                notebook,
                timeout=CELL_TIMEOUT,
                kernel_name="python3",
                extra_arguments=["--log-level=ERROR"],
                store_widget_state=False,
            )
            yield path.name, client.execute(cwd=str(folder), env=environment)


def chapter(notebook: NotebookNode, name: str, page: Path, note: str, still: str) -> None:
    """Write a notebook that was run as a chapter, with its pictures beside it.

    Parameters
    ----------
    name : of the notebook, without ``.ipynb``
    page : where it is written
    note : goes below the title: :data:`AS_IT_BEGINS` or :data:`WITH_SOLUTIONS`
    still : HTML of a drawing that stands for a bench that would move
    """
    notebook = copy.deepcopy(notebook)
    first = next(cell for cell in notebook.cells if cell.cell_type == "markdown")
    notebook.cells.sort(key=lambda cell: cell is not first)  # a page begins with its title
    title, _newline, rest = first.source.partition("\n")
    first.source = f"{title}\n{note.format(name=name)}\n{rest}"
    shown = 0
    for cell in notebook.cells:
        cell.pop("attachments", None) if "attachment:" not in cell.source else None
        tags = cell.metadata.get("tags", [])
        hidden = cell.metadata.get("jupyter", {}).get("source_hidden") or "parameters" in tags
        cell.metadata = NotebookNode({"tags": ["hide-input"]} if hidden else {})
        if cell.cell_type != "code":
            cell.source = _linked(cell.source)
            continue
        shown += 1
        cell.execution_count = shown
        cell.outputs = [
            _for_a_page(output, f"{name}-{cell.id}-{n}", page, still) for n, output in enumerate(cell.outputs)
        ]
    notebook.metadata.pop("widgets", None)
    page.parent.mkdir(parents=True, exist_ok=True)
    nbformat.write(notebook, page)


def _linked(text: str) -> str:
    """Return a text with links to notebooks and headings as the site names them."""

    def link(found: re.Match[str]) -> str:
        name, heading = found["notebook"], found["heading"] or ""
        if name and heading.startswith(_CELL):
            cells = nbformat.read(NOTEBOOKS / name, as_version=4).cells
            source = next(cell.source for cell in cells if cell.id == heading.removeprefix(_CELL))
            heading = next(line.lstrip("# ") for line in source.split("\n") if line.startswith("### Question"))
        slug = f"#{heading.lower().replace('.', '').replace(' ', '-')}" if heading else ""
        return f"]({f'../notebooks/{name}' if name else ''}{slug})"

    return _LINK.sub(link, text)


def _for_a_page(output: NotebookNode, name: str, page: Path, still: str) -> NotebookNode:
    data, about = output.get("data", {}), output.get("metadata", {})
    if VIEW in data:
        return _instead_of_explorer(data, name, about, page, still)
    if "image/png" in data:
        return _markdown(_picture(data["image/png"], about.get("image/png", {}), name, page))
    if "execution_count" in output:
        output.execution_count = None
    return output


def _instead_of_explorer(
    data: Mapping[str, Any], name: str, about: Mapping[str, Any], page: Path, still: str
) -> NotebookNode:
    if "image/png" in data:
        what, shown = "an interactive picture.", "the picture that it begins with"
        body = _picture(data["image/png"], about.get("image/png", {}), name, page)
    elif "text/html" in data:
        what, shown, body = "a table that can be sorted and copied.", "the plain table", data["text/html"]
    else:
        what, shown, body = (
            "the bench, which is run and watched there.",
            "a drawing of the bench, in another experiment than this one",
            still,
        )
    return _markdown(f"{EXPLORER.format(what=what, shown=shown)}\n\n{body}")


def _picture(png: str, about: Mapping[str, Any], name: str, page: Path) -> str:
    folder = page.parent / "pictures"
    folder.mkdir(parents=True, exist_ok=True)
    (folder / f"{name}.png").write_bytes(base64.b64decode(png))
    alt = re.sub(r"\s+", " ", about.get("alt", "")).replace("[", "(").replace("]", ")").replace("$", "\\$")
    width = f"{{width={int(about['width'])}px}}" if about.get("width") else ""
    return f"![{alt}](pictures/{name}.png){width}"


def _markdown(text: str) -> NotebookNode:
    return nbformat.v4.new_output("display_data", data={"text/markdown": text})
