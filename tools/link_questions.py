"""Put links into the notebooks' texts: each question and each notebook that is named leads there.

    python tools/link_questions.py

What has a link already stays as it is. A question's link leads to its heading, as JupyterLab names it.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Mapping
from pathlib import Path

import nbformat

from labcourse import files
from labcourse.answers.catalogue import Catalogue
from labcourse.grading import course
from labcourse.grading.release import student_notebooks

#: What has no links in it: code, formulas, links, headings, comments, summaries, and the texts of the solution.
_APART = re.compile(
    r"```.*?```|\$\$.*?\$\$|\$[^$\n]+\$|!?\[[^\]]*\]\([^)]*\)|^#.*?$|<summary>.*?</summary>"
    r"|<!-- BEGIN SOLUTION.*?END SOLUTION -->|<!--.*?-->",
    re.DOTALL | re.MULTILINE,
)
_NOTEBOOK = re.compile(r"`(\d\d_\w+)`")
_CODE = re.compile(r"(`[^`]+`)")
_NUMBER = r"\d\.\d+"
_QUESTIONS = re.compile(rf"\b[Qq]uestions?\s+{_NUMBER}(?:(?:,\s|,?\s(?:and|or|to)\s){_NUMBER})*")


def linked(text: str, notebook: str, asked_in: Mapping[str, str]) -> str:
    """Return a text with links to the questions and notebooks that it names.

    Parameters
    ----------
    text : Markdown
    notebook : in which it stands, without the ending
    asked_in : question number → notebook
    """
    parts, end = [], 0
    for apart in _APART.finditer(text):
        parts += [_linked(text[end : apart.start()], notebook, asked_in), apart[0]]
        end = apart.end()
    return "".join([*parts, _linked(text[end:], notebook, asked_in)])


def _linked(text: str, notebook: str, asked_in: Mapping[str, str]) -> str:
    def to_question(match: re.Match[str]) -> str:
        number, there = match[0], asked_in.get(match[0])
        if there is None:
            return number
        return f"[{number}]({'' if there == notebook else f'{there}.ipynb'}#Question-{number})"

    def to_notebook(match: re.Match[str]) -> str:
        is_another = match[1] != notebook and match[1] in asked_in.values()
        return f"[{match[0]}]({match[1]}.ipynb)" if is_another else match[0]

    text = _NOTEBOOK.sub(to_notebook, text)
    pieces = _CODE.split(text)  # every second one is code
    pieces[::2] = [_QUESTIONS.sub(lambda found: re.sub(_NUMBER, to_question, found[0]), piece) for piece in pieces[::2]]
    return "".join(pieces)


def targets(catalogue: Catalogue) -> dict[str, str]:
    """Return in which notebook each question is asked."""
    return {question.number: question.notebook for question in catalogue.everything.values()}


def main() -> int:
    """Write links into the instructor's notebooks."""
    ours = course.find()
    for path in ours.notebooks:
        notebook = student_notebooks.read(path)
        for cell in notebook.cells:
            if cell.cell_type == "markdown":
                cell.source = linked(cell.source, path.stem, targets(ours.catalogue))
        files.write(Path(path), nbformat.writes(notebook).encode())
    return 0


if __name__ == "__main__":
    sys.exit(main())
