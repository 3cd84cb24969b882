"""Make docs/derivation.html of solutions/90_derivation.ipynb: one file that needs no network and no JavaScript.

    python tools/export_derivation.py [NOTEBOOK [PAGE]]

Formulas become drawings (SVG, by matplotlib's mathtext) that carry their LaTeX as description. Mathtext knows no
matrices: they are laid out here, entry by entry. What neither knows is an error, and the page is not written.
"""

from __future__ import annotations

import copy
import html
import re
import sys
from functools import cache
from pathlib import Path

import nbformat
from matplotlib.font_manager import FontProperties
from matplotlib.mathtext import MathTextParser
from matplotlib.textpath import TextPath
from nbconvert import HTMLExporter
from nbconvert.preprocessors import CoalesceStreamsPreprocessor
from nbformat import NotebookNode
from pygments.formatters import HtmlFormatter

ROOT = Path(__file__).resolve().parents[1]
NOTEBOOK = ROOT / "solutions" / "90_derivation.ipynb"
PAGE = ROOT / "docs" / "derivation.html"

UNITS = 400  #: of a drawing, to an em; well below a dot on a screen
ROOM = 24  #: units
FONT = FontProperties(size=UNITS, math_fontfamily="cm")
LETTERS = {TextPath.MOVETO: "M", TextPath.LINETO: "L", TextPath.CURVE3: "Q", TextPath.CURVE4: "C"}
MATRIX = re.compile(r"\\left\[\\begin\{matrix\}(.*?)\\end\{matrix\}\\right\]", re.DOTALL)
DISPLAYED, INLINE = re.compile(r"\$\$(.+?)\$\$", re.DOTALL), re.compile(r"\$([^$\n]+?)\$")

STYLE = """
body { font: 16px/1.5 "DejaVu Sans", Verdana, sans-serif; max-width: 50rem; margin: 2rem auto; padding: 0 1rem;
       color: #111; background: #fff; }
table { border-collapse: collapse; font-size: 90%; }
th, td { border: 1px solid #bbb; padding: .35rem .6rem; text-align: left; vertical-align: top; }
pre { font-size: 80%; line-height: 1.35; overflow-x: auto; margin: 0; }
.highlight { background: #f5f7f9; border-left: 3px solid #c9d3dd; padding: .4rem .7rem; margin: 1rem 0 .5rem; }
.output pre { padding: .4rem .9rem; }
.formula { display: flex; align-items: center; gap: .4rem; margin: .8rem 0 .8rem 1.6rem; overflow-x: auto; }
.matrix { display: inline-grid; gap: .5rem 1.3rem; padding: .2rem .7rem; position: relative; place-items: center; }
.matrix::before, .matrix::after { content: ""; position: absolute; top: 0; bottom: 0; width: .35rem;
                                  border: 1.5px solid #111; }
.matrix::before { left: 0; border-right: none; }
.matrix::after { right: 0; border-left: none; }
svg { overflow: visible; }
a.anchor-link { display: none; }
"""


@cache
def picture(latex: str) -> str:
    """A formula (without matrices) as ``<svg>``, standing on the line of the text around it.

    Raises
    ------
    ValueError
        If mathtext does not know something in it.
    """
    width, height, depth, _, _ = MathTextParser("path").parse(f"${latex}$", dpi=72, prop=FONT)
    outline = TextPath((0, 0), f"${latex}$", prop=FONT)
    # A little room all around: the boxes that mathtext reckons with are tighter than its glyphs.
    width, height, depth = width + 2 * ROOM, height + 2 * ROOM, depth + ROOM
    style = "; ".join(
        f"{name}: {value / UNITS:.3f}em"
        for name, value in (("width", width), ("height", height), ("vertical-align", -depth))
    )
    return (
        f'<svg role="img" aria-label="{html.escape(latex.strip()).replace("|", "&#124;")}" style="{style}" '
        f'viewBox="{-ROOM} {depth - height:.0f} {width:.0f} {height:.0f}"><path d="{drawn(outline)}"/></svg>'
    )


def drawn(outline: TextPath) -> str:
    """A path in SVG's words; y points down there."""
    words = []
    for points, code in outline.iter_segments(simplify=False):
        down = points.reshape(-1, 2) * [1, -1]
        words.append("Z" if code == TextPath.CLOSEPOLY else LETTERS[code] + " ".join(f"{x:.0f}" for x in down.flat))
    return "".join(words)


def displayed(latex: str) -> str:
    """A formula on a line of its own, matrices and all."""
    latex = latex.replace(r"\displaystyle", "").replace(r"\limits", "").replace(r"\frac", r"\dfrac").strip()
    # The pattern has one group, so that what stands around matrices and their insides take turns.
    parts = [
        matrix(part) if turn % 2 else picture(part.strip()) if part.strip() else ""
        for turn, part in enumerate(MATRIX.split(latex))
    ]
    return f'<div class="formula">{"".join(parts)}</div>'


def matrix(inside: str) -> str:
    """A matrix in brackets: rows end with two backslashes, entries are parted by ampersands."""
    rows = [row.split("&") for row in inside.split(r"\\")]
    cells = "".join(f"<span>{picture(entry.strip())}</span>" for row in rows for entry in row)
    return f'<span class="matrix" style="grid-template-columns: repeat({len(rows[0])}, auto)">{cells}</span>'


def with_drawings(notebook: NotebookNode) -> NotebookNode:
    """A copy of the notebook with drawings for formulas, in its text and in what its cells have shown."""
    notebook = copy.deepcopy(notebook)
    for cell in notebook.cells:
        if cell.cell_type == "markdown":
            text = DISPLAYED.sub(lambda found: displayed(found[1]), cell.source)
            cell.source = INLINE.sub(lambda found: picture(found[1]), text)
        for output in cell.get("outputs", []):
            latex = output.get("data", {}).get("text/latex")
            if latex:
                output.data = {"text/html": displayed(latex.strip("$"))}
    return notebook


def page(notebook: NotebookNode) -> str:
    """The page of a notebook that has been run."""
    title = notebook.cells[0].source.split("\n")[0].lstrip("# ")
    exporter = HTMLExporter(template_name="basic", exclude_input_prompt=True, exclude_output_prompt=True)
    exporter.register_preprocessor(CoalesceStreamsPreprocessor, enabled=True)
    body, _ = exporter.from_notebook_node(with_drawings(notebook))
    return (
        f'<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f'<meta name="viewport" content="width=device-width">\n<title>{html.escape(title)}</title>\n'
        f"<!-- Made by tools/export_derivation.py from solutions/90_derivation.ipynb: edit that. -->\n"
        f"<style>{STYLE}{HtmlFormatter().get_style_defs('.highlight')}\n</style>\n</head>\n<body>\n{body}\n</body>\n</html>\n"
    )


def main(arguments: list[str]) -> None:
    """Export the notebook."""
    notebook, target = (*map(Path, arguments), *(NOTEBOOK, PAGE)[len(arguments) :])
    target.write_text(page(nbformat.read(notebook, as_version=4)), encoding="utf-8", newline="\n")
    print(f"{target.name}: {target.stat().st_size / 1000:.0f} kB")


if __name__ == "__main__":
    main(sys.argv[1:])
