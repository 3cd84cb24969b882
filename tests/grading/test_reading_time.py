"""How long a notebook takes: what counts, what is folded away, and texts that state it otherwise."""

import json
import shutil
from dataclasses import replace

import pytest
import reading_time
from checkout import ROOT
from made_courses import OURS
from nbformat.v4 import new_code_cell, new_markdown_cell, new_notebook, new_output

from labcourse.answers.catalogue import Catalogue
from labcourse.answers.parts import Question, figure, number, prose

TEN = "one two three four five six seven eight nine ten"
PICTURE = new_output("display_data", {"image/png": "…"})
DRAWING = new_output("display_data", {"text/html": '<img alt="…" src="…">'})
FOLDED = {"jp-MarkdownHeadingCollapsed": True}


@pytest.mark.parametrize(
    ("cells", "words", "figures"),
    [
        ([new_markdown_cell("A *word*, and $x = 3$ :\n\n| a | b |\n|---|---|")], 7, 0),
        ([new_markdown_cell('<div class="alert"><b>Mind</b> this</div> <!-- not this -->')], 2, 0),
        ([new_code_cell("x", outputs=[PICTURE, DRAWING]), new_markdown_cell("![](attachment:a.png)")], 2, 3),
        ([new_markdown_cell(f"<details><summary>More</summary>\n\n{TEN}\n\n</details>")], 0, 0),
        ([new_code_cell(TEN, metadata={"jupyter": {"source_hidden": True}})], 0, 0),
        ([new_markdown_cell("## More", metadata=FOLDED), new_markdown_cell(f"### Below\n\n{TEN}")], 1, 0),
        ([new_markdown_cell("## More", metadata=FOLDED), new_markdown_cell(f"## Next\n\n{TEN}")], 12, 0),
    ],
)
def test_words_and_figures_count_unless_they_are_folded_away(cells, words, figures):
    time = reading_time.reading_time(new_notebook(cells=cells), "01_made", Catalogue(()))
    assert (time.words, time.figures) == (words, figures)
    assert time.minutes == pytest.approx(words / 120 + figures)


def test_answers_take_their_time_by_their_kind():
    parts = (number("x", "m", None, "", ""), figure("plot", "", ""), prose("why", "", ""))
    questions = [Question("1.1", "1", "01_made", "", (), parts), Question("1.2", "1", "02_other", "", (), parts)]
    carried = tuple(replace(number(name, "m", None, "", ""), shows=("1.1", "x")) for name in "xy")
    catalogue = Catalogue(questions, tables=[Question("Table 1", "1", "03_table", "", (), carried)])
    minutes = [reading_time.reading_time(new_notebook(), name, catalogue).minutes for name in ("01_made", "03_table")]
    assert minutes == [3 + 3 + 8, 3]


def test_this_course_states_what_the_formula_gives_and_another_time_is_reported(tmp_path):
    assert list(reading_time.other_times(OURS)) == []
    shutil.copytree(ROOT / "solutions", tmp_path / "solutions", ignore=shutil.ignore_patterns("__pycache__", "*.json"))
    path = tmp_path / "solutions" / "02_finding_stiffness.ipynb"
    notebook = json.loads(path.read_text(encoding="utf-8"))
    title = next(cell for cell in notebook["cells"] if cell["id"] == "title")
    title["source"] = reading_time._TIME_IN_TITLE.sub("about 5 minutes", "".join(title["source"]))
    path.write_text(json.dumps(notebook), encoding="utf-8")
    (found,) = reading_time.other_times(replace(OURS, folder=path.parent))
    assert found.startswith("02_finding_stiffness.ipynb, cell 'title'") and "this text says 5." in found
