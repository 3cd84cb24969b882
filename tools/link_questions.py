"""Put links into the notebooks' texts: each question and each notebook that is named leads there.

    python tools/link_questions.py

What has a link already stays as it is. A link to a question of the same notebook leads to its heading. One to another
notebook leads to the cell with the heading: JupyterLab finds no heading in a notebook that it has only just opened.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Mapping

from nbformat import NotebookNode

from labcourse import files
from labcourse.grading import course
from labcourse.grading.release import student_notebooks

#: What has no links in it: code, formulas, links, headings, comments, summaries, and the texts of the solution.
_APART = re.compile(
    r"```.*?```|\$\$.*?\$\$|\$[^$\n]+\$|!?\[[^\]]*\]\([^)]*\)|^#.*?$|<summary>.*?</summary>"
    r"|<!-- BEGIN SOLUTION.*?END SOLUTION -->|<!--.*?-->",
    re.DOTALL | re.MULTILINE,
)
_NOTEBOOK = re.compile(r"`(\d\d_\w+)`")
_HEADING = re.compile(r"^### Question (\d\.\d+)", re.MULTILINE)
_CODE = re.compile(r"(`[^`]+`)")
_NUMBER = r"\d\.\d+"
_QUESTIONS = re.compile(rf"\b[Qq]uestions?\s+{_NUMBER}(?:(?:,\s|,?\s(?:and|or|to)\s){_NUMBER})*")


Places = Mapping[
    str, tuple[str, str]
]  #: question number, or a notebook → notebook, and id of the cell with the heading


def linked(text: str, notebook: str, places: Places) -> str:
    """Return a text with links to the questions and notebooks that it names.

    Parameters
    ----------
    text : Markdown
    notebook : in which it stands, without the ending
    places : of the notebooks, and of the questions that have a heading
    """
    parts, end = [], 0
    for apart in _APART.finditer(text):
        parts += [_linked(text[end : apart.start()], notebook, places), apart[0]]
        end = apart.end()
    return "".join([*parts, _linked(text[end:], notebook, places)])


def _linked(text: str, notebook: str, places: Places) -> str:
    def to_question(match: re.Match[str]) -> str:
        number = match[0]
        if number not in places:
            return number
        there, cell = places[number]
        return f"[{number}]({f'#Question-{number}' if there == notebook else f'{there}.ipynb#cell-id={cell}'})"

    def to_notebook(match: re.Match[str]) -> str:
        is_another = match[1] != notebook and match[1] in places
        return f"[{match[0]}]({match[1]}.ipynb)" if is_another else match[0]

    text = _NOTEBOOK.sub(to_notebook, text)
    pieces = _CODE.split(text)  # every second one is code
    pieces[::2] = [_QUESTIONS.sub(lambda found: re.sub(_NUMBER, to_question, found[0]), piece) for piece in pieces[::2]]
    return "".join(pieces)


def places_of(notebooks: Mapping[str, NotebookNode]) -> Places:
    """Return where each question has its heading, from the course's notebooks (name → notebook)."""
    headings = (
        (match[1], (name, cell.id))
        for name, notebook in notebooks.items()
        for cell in notebook.cells
        for match in _HEADING.finditer(cell.source)
        if cell.cell_type == "markdown"
    )
    return {name: (name, "") for name in notebooks} | dict(headings)


def main() -> int:
    """Write links into the instructor's notebooks."""
    paths = course.find(with_optional=True).notebooks
    notebooks = {path.stem: student_notebooks.read(path) for path in paths}
    places = places_of(notebooks)
    for path in paths:
        for cell in notebooks[path.stem].cells:
            if cell.cell_type == "markdown":
                cell.source = linked(cell.source, path.stem, places)
        files.write(path, student_notebooks.text(notebooks[path.stem]))
    return 0


if __name__ == "__main__":
    sys.exit(main())
