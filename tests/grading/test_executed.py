"""What a student's notebook showed, run again: a page and a notebook with text and pictures, and nothing else."""

import base64
import io
import json
import subprocess

import nbformat
import pytest
import small_class
from command_line import rotflex
from page_text import page_text
from pages_harm import HOSTILE, harm
from PIL import Image

from labcourse.errors import GradingError
from labcourse.grading import course as courses
from labcourse.grading.executed import as_shown, different, write
from labcourse.grading.gradebook import Gradebook
from labcourse.grading.release import student_course
from labcourse.grading.reports.templating import templates
from labcourse.run.inside.outputs import MOST_OF_CELL

SHOWS = """
import os
import matplotlib.pyplot as plt
from IPython.display import HTML, Javascript, display
resolution = 2 * np.pi / 4096
print("printed by ada with seed", os.environ["LABCOURSE_PROBE_SEED"])
plt.plot([1, 2])
plt.show()
display(HTML("<b onclick='x()'>bold</b>"), Javascript("window.ran = 1"))
unknown_name
"""
CHANGES = "import time\nresolution = time.time()\nprint('x' * 3_000_000)"  # another answer at each run
#: Takes the place of the file of outputs, and ends the process.
TAKES = "import os\nos.mkdir('.labcourse-executed-00_start.ipynb')\nprint('gone', flush=True)\nos._exit(3)"


@pytest.fixture(scope="module")
def graded(tmp_path_factory, sandbox):
    """Students that are graded and run again: one answers otherwise each time, and one does not want to be seen."""
    folder = tmp_path_factory.mktemp("executed")
    source = small_class.course(folder / "course")
    ((name, text),) = student_course.derive_notebooks(courses.load(source)).items()
    for student, code in (("ada", SHOWS), ("bob", CHANGES), ("cleo", TAKES)):
        notebook = json.loads(text)
        for cell in notebook["cells"]:
            if cell["id"] == "q0-1":
                cell["source"] = code
        (folder / "in" / student).mkdir(parents=True)
        (folder / "in" / student / name).write_text(json.dumps(notebook), encoding="utf-8")
    words = small_class.command(source, folder / "in", folder / "marks")
    subprocess.run(words, check=False, capture_output=True)
    before = small_class.contents(folder / "marks")
    again = [rotflex("rerun", folder / "marks", one, "--solutions", source) for one in ("ada", "bob", "cleo")]
    assert small_class.contents(folder / "marks") == before  # marks do not come from it
    assert [one.exit_code for one in again] == [0, 0, 0], [one.output for one in again]
    return folder / "marks", source


def executed(graded, student, ending):
    return (graded[0] / student / "executed" / f"00_start{ending}").read_text(encoding="utf-8")


def test_the_page_has_source_text_error_and_picture_and_says_what_it_is(graded):
    page = executed(graded, "ada", ".html")
    text = page_text(page)
    assert "printed by ada with seed 7" in text and "NameError" in text and "plt.plot([1, 2])" in text
    assert "Marks do not come from it." in text and "Its answers are those that were marked." in text
    (picture,) = {part.partition('"')[0] for part in page.split("data:image/png;base64,")[1:2]}
    assert Image.open(io.BytesIO(base64.b64decode(picture))).format == "PNG"
    assert "<script" not in page and "<b onclick" not in page


def test_the_notebook_has_the_same(graded):
    notebook = nbformat.reads(executed(graded, "ada", ".ipynb"), as_version=4)
    nbformat.validate(notebook)
    (cell,) = (one for one in notebook.cells if one.id == "q0-1")
    kinds = [set(output.get("data", {})) or output.output_type for output in cell.outputs]
    assert kinds[0] == "stream" and {"image/png", "text/plain"} in kinds and kinds[-1] == "error"
    assert all(kind <= {"image/png", "text/plain"} for kind in kinds if isinstance(kind, set))


def test_an_answer_that_is_another_one_than_marked_is_named(graded):
    text = page_text(executed(graded, "bob", ".html"))
    assert "Other answers than those that were marked: 0.1 resolution." in text and "[Output cut" in text


def test_without_outputs_the_source_is_there_and_what_went_wrong(graded):
    text = page_text(executed(graded, "cleo", ".html"))
    assert "os._exit(3)" in text and "gone" not in text.replace("print('gone'", "")
    assert "process died" in text and "not an ordinary file" in text and "Nothing came back" in text


def test_a_version_is_named_as_take_lists_it(graded, tmp_path):
    marks, source = graded
    with Gradebook(marks / "gradebook.sqlite") as book:
        again = [*write(book, courses.load(source), "ada", tmp_path, "00_start", 1)]
        with pytest.raises(GradingError, match="has 1"):
            [*write(book, courses.load(source), "ada", tmp_path, "00_start", 2)]
    assert again == [tmp_path / "ada" / "executed" / "00_start.html"]


def test_of_who_handed_in_nothing_nothing_is_run(graded, tmp_path):
    with Gradebook(graded[0] / "gradebook.sqlite") as book, pytest.raises(GradingError, match="Nothing of 'eve'"):
        [*write(book, courses.load(graded[1]), "eve", tmp_path)]


def test_other_values_and_missing_ones_are_different():
    before = {"answers": {"1.1": {"a": {"value": 1.0}, "b": {"value": 2.0}}, "1.2": {"c": {"value": 3.0}}}}
    now = {"answers": {"1.1": {"a": {"value": 1.0}, "b": {"value": 2.5}}, "1.3": {"d": {"value": 3.0}}}}
    assert different(before, now) == [("1.1", "b"), ("1.2", "c"), ("1.3", "d")]


# --- outputs that nobody sends who means well -------------------------------------------------------------------------


def png(width, height):
    made = io.BytesIO()
    Image.new("1", (width, height)).save(made, "PNG")
    return made.getvalue()


def coded(data):
    return base64.b64encode(data).decode()


def shows(data, kind="display_data", **more):
    return {"output_type": kind, "data": data, "metadata": {}, **more}


BROKEN, HUGE, SVG = coded(png(9, 9)[:-30]), coded(png(30_000, 30_000)), coded(b"<svg onload='x()'/>")
OUTPUTS = [
    *(shows({"text/html": text, "text/plain": text, "image/svg+xml": text, "text/markdown": text}) for text in HOSTILE),
    *(shows({"application/javascript": "window.ran = 1", "text/latex": text}) for text in HOSTILE),
    *({"output_type": "stream", "name": text, "text": f"\x1b[31m{text}\x1b]0;x\x07"} for text in HOSTILE),
    {"output_type": "error", "ename": HOSTILE[0], "evalue": HOSTILE[1], "traceback": HOSTILE},
    *(shows({"image/png": one, "text/plain": "a plot"}) for one in (BROKEN, HUGE, SVG, "%%%", 7, None, ["a"], {})),
    shows({"image/png": coded(png(9, 9)), "image/jpeg": coded(b"\xff\xd8\xff")}, kind="execute_result"),
    *({"output_type": kind} for kind in ("stream", "error", "display_data", "raw", None, 3)),
    *(None, 3, [], "x", {}),
    *(shows(data) for data in (None, 3, "text/plain", {"text/plain": ["a", 3]})),
]


def page_of(outputs):
    cells = [{"id": "q1", "source": HOSTILE[0]}, {"id": "q2", "source": ""}]
    node = as_shown(cells, json.dumps({"cells": [{"id": "q1", "outputs": outputs}]}).encode())
    nbformat.validate(node)
    about = {"student": HOSTILE[0], "notebook": HOSTILE[1], "said": HOSTILE}
    return node, templates().get_template("executed.html").render(cells=node.cells, **about)


def test_nothing_of_hostile_outputs_is_left_but_plain_text_and_pictures_made_anew():
    node, page = page_of(OUTPUTS)
    kinds = {media for output in node.cells[0].outputs for media in output.get("data", {})}
    assert kinds == {"text/plain", "image/png"}
    pictures = [one.data["image/png"] for one in node.cells[0].outputs if "image/png" in one.get("data", {})]
    assert len(pictures) == 1 and Image.open(io.BytesIO(base64.b64decode(pictures[0]))).size == (9, 9)
    own = ["style", "img", ("img", "src", "data:image/png;base64,")]
    assert harm(page.replace(pictures[0], "")) == own
    assert "\x1b" not in page and "\u202e" not in page
    written = json.dumps(node, ensure_ascii=False)  # which writes controls as codes
    assert r"\u001b" not in written and "\u202e" not in written


@pytest.mark.parametrize("executed", [b"", b"{", b"[]", b'{"cells": 3}', b'{"cells": [{"id": []}, 3]}', b"[" * 9999])
def test_what_is_no_notebook_leaves_the_source(executed):
    (cell,) = as_shown([{"id": "q1", "source": "x = 1"}], executed).cells
    assert (cell.source, cell.outputs) == ("x = 1", [])


def test_what_is_beyond_the_limits_is_cut_and_that_is_said():
    line = {"output_type": "stream", "name": "stdout", "text": "\u202e" * (MOST_OF_CELL // 20)}
    (cell, _other), page = (found := page_of([line] * 30))[0].cells, found[1]
    assert len(json.dumps(cell.outputs)) < 1.01 * MOST_OF_CELL and "Output cut" in cell.outputs[-1].text
    assert len(page) < 1.1 * MOST_OF_CELL
