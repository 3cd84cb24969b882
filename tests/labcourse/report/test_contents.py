"""What a report contains: answers, texts and captions of the saved notebook; and what is said of it."""

import base64
import json
import re
from datetime import datetime

import matplotlib.pyplot as plt
import numpy as np
import pytest
from checkout import ROOT
from report_texts import png

from labcourse.answers import notebooks, parts
from labcourse.answers.catalogue import Catalogue
from labcourse.answers.parts import Question, ReportItem
from labcourse.errors import AnswerError
from labcourse.report import contents, making, recorded_figures, values, writing
from labcourse.report.contents import Exhibit, Heading, Text
from labcourse.run import RUNNING
from labcourse.session import Session
from rotflex.course.questions import CATALOGUE as OURS

REPORT = "First report"
NOON = datetime(2026, 11, 23, 12)
_K = parts.number("K", "N/m", None, "A-1", "The stiffness.")
_W = parts.matrix("W_c", (2, 2), "A-1", "W.", usual=parts.Usual(unit="V"))
_SPEED = (parts.figure("figure", "A-1", "The speed over time."), _W)
_ROWS = (_K, parts.poles("poles", 3, "A-1", "The poles."), parts.matrix("A", (1, 2), "A-1", "The matrix."))
_ROWS += (parts.number("t_s", "s", None, "A-1", "The settling time."),)
CATALOGUE = Catalogue(
    [
        Question("1.2", "1", "02_measuring", "The speed", (), _SPEED),
        Question("1.3", "1", "02_measuring", "Stiffness", (), (_K,)),
    ],
    tables=[Question("Table 3", "1", "04_results", "Results of the measurement", (), _ROWS)],
    report_items=[
        ReportItem(REPORT, "I.1", "Procedure: measuring", "What.", ("A-1",), (("1.2", ""),), "procedure"),
        ReportItem(REPORT, "II.1", "Results: the speed", "", ("A-1",), (("1.2", ""),)),
        ReportItem(REPORT, "II.2", "Results: Table 3", "", ("A-1",), (("Table 3", ""),)),
        ReportItem(REPORT, "III.1", "Analysis: why", "Why.", ("A-1",), (("1.3", ""),), "analysis"),
        ReportItem(REPORT, "F.1", "Appearance", "", ("A-1",), judged="appearance"),
    ],
    reports={REPORT: ("5", "04_results", "Report on the first laboratory")},
)
FRONT = """<div><b>✎ Your text: captions</b></div>

* **Authors:** Ada Lovelace, Charles Babbage,
  C. Third
* **Figure 1.2:** The speed $v$
  after the step.
* **Table 3:**
* **Figure 7:** Of nothing.
* **[1]** A. Author, *A title*.
* **[2]**
"""


PROCEDURE = "We measured.\n\n$$ a = b \\tag{law} $$\n\n![Mine](attachment:m.png)"


def save(folder, front=FRONT, procedure=PROCEDURE):
    picture = {"m.png": {"image/png": base64.b64encode(png()).decode()}}
    cells = [
        {"id": "front", "metadata": {"labcourse": {"front": REPORT}}, "source": front},
        {"id": "procedure", "metadata": about("procedure"), "source": procedure, "attachments": picture},
        {"id": "analysis", "metadata": about("analysis"), "source": "By (law).\n\n$$ c = d $$"},
    ]
    notebook = {"metadata": {}, "nbformat": 4, "nbformat_minor": 5}
    notebook["cells"] = [{"cell_type": "markdown", **cell} for cell in cells if cell["source"]]
    (folder / "04_results.ipynb").write_text(json.dumps(notebook), encoding="utf-8")


def about(part):
    return {"labcourse": {"question": REPORT, "part": part}, "nbgrader": {"grade_id": part, "solution": True}}


@pytest.fixture
def lab(tmp_path, monkeypatch):
    monkeypatch.delenv(RUNNING, raising=False)
    monkeypatch.setattr("labcourse.session.by_program", lambda: False)
    monkeypatch.setattr(making, "by_program", lambda: False)
    course = {"student": "ada", "title": "Mechanics", "term": "2026", "page_limit": 2}
    (tmp_path / "course.json").write_text(json.dumps(course), encoding="utf-8")
    save(tmp_path)
    return Session("ada", tmp_path, CATALOGUE, {}, 1)


def speed(points=5000):
    figure, ax = plt.subplots()
    t = np.linspace(0, 10, points)
    ax.plot(t, np.sin(40 * t), label="measured")
    ax.set(xlabel="time (s)", ylabel=r"speed $\omega$ (rad/s)")
    plt.close(figure)
    return figure


def read(lab, tmp_path):
    return contents.read(lab, tmp_path, REPORT, NOON)


def recorded(found, label):
    return next(piece for piece in found.pieces if isinstance(piece, Exhibit) and piece.label == label)


def texts(found):
    return [piece.markdown for piece in found.pieces if isinstance(piece, Text)]


def test_texts_captions_and_sources_are_those_of_the_saved_notebook(lab, tmp_path, monkeypatch):
    monkeypatch.setattr(notebooks, "MAX_PICTURES", 10)  # of grading; a report has them all
    found = read(lab, tmp_path)
    headings = [
        "I Procedure",
        "I.1 Measuring",
        "II Results",
        "II.1 The speed",
        "II.2 Table 3: Results of the measurement",
    ]
    headings += ["III Analysis", "III.1 Why", "References"]  # without what is judged
    assert [piece.text for piece in found.pieces if isinstance(piece, Heading)] == headings
    first = next(piece for piece in found.pieces if isinstance(piece, Text))
    assert first.markdown.startswith("We measured.")
    assert first.pictures["attachment:m.png"].startswith(b"\x89PNG")
    names = ["Mechanics", "2026", "Ada Lovelace, Charles Babbage, C. Third", "ada", "2026-11-23"]
    assert list(found.cover.values())[1:] == names
    assert recorded(found, "Figure 1.2").caption == "The speed $v$\nafter the step."
    assert recorded(found, "Table 3").caption == "Results of the measurement"  # the course's
    assert [(piece.source, piece.markdown) for piece in found.pieces[-1:]] == [("1", "A. Author, *A title*.")]
    assert [problem for problem in found.problems if "called Figure 7" in problem]
    for front in ("Nothing.", None):  # changed, or gone
        save(tmp_path, front=front)
        assert read(lab, tmp_path).cover["authors"] == ""
    assert "is missing: lab.restore() gives it back" in read(lab, tmp_path).problems[0]
    save(tmp_path)
    path = tmp_path / "04_results.ipynb"
    path.write_text(path.read_text(encoding="utf-8").replace(f'"front": "{REPORT}"', '"front": "Another"'))
    assert read(lab, tmp_path).cover["authors"] == ""


def test_the_last_of_two_entries_counts_but_not_an_empty_one(lab, tmp_path):
    save(tmp_path, FRONT + "* **Authors:** Ada\n* **Figure 1.2:**\n\nNo caption.\n* **Date:** Monday")
    found = read(lab, tmp_path)
    assert (found.cover["authors"], found.cover["date"]) == ("Ada", "Monday")
    assert recorded(found, "Figure 1.2").caption == "The speed $v$\nafter the step."


def test_what_is_not_written_or_recorded_says_so_in_its_place(lab, tmp_path):
    found = read(lab, tmp_path)
    figure, table = recorded(found, "Figure 1.2"), recorded(found, "Table 3")
    assert (figure.svg, figure.alt) == ("", "This figure is not recorded yet.")
    assert table.table.count("*not recorded yet*") == 4 and "*W_c is not recorded yet.*" in texts(found)
    save(tmp_path, procedure="")
    assert texts(read(lab, tmp_path))[0] == "*Nothing is written or recorded yet.*"


def test_recorded_results_are_formulas(lab, tmp_path):
    lab.answer("1.2", W_c=[[1, 2], [3, 4]])
    lab.answer("Table 3", K=0.000123456, poles=[-1, -2 + 3j, -2 - 3j], A=[[1e-15, 20000]], t_s=0.5)
    found = read(lab, tmp_path)
    assert r"$$ W_{c} = \begin{bmatrix} 1 & 2 \\ 3 & 4 \end{bmatrix}\ \text{V} $$" in texts(found)
    assert recorded(found, "Table 3").table.splitlines()[2:] == [
        "| The stiffness | $K$ | $$0.0001235$$ | N/m |",
        r"| The poles | $\text{poles}$ | $$\begin{matrix} -2 - 3j \\ -2 + 3j \\ -1 \end{matrix}$$ | 1/s |",
        r"| The matrix | $A$ | $$\begin{bmatrix} 0 & 2 \cdot 10^{4} \end{bmatrix}$$ | SI |",
        "| The settling time | $t_{s}$ | $$0.5$$ | s |",
    ]


def test_words_of_a_name_stay_on_one_line_as_browsers_do_not_show_a_second_one():
    table = Question("Table 1", "1", "04_results", "Poles", (), (parts.poles("desired_poles", 1, "A-1", "Poles."),))
    ((_, symbol, *_),) = values.rows(table, {"desired_poles": None})
    assert symbol == r"$\text{desired~poles}$"


def test_a_figure_is_the_students_own_or_a_problem_says_what_to_do(lab, tmp_path):
    lab.answer("1.2", figure=speed())
    found = read(lab, tmp_path)
    figure = recorded(found, "Figure 1.2")
    (saved,) = (tmp_path / recorded_figures.FOLDER).iterdir()
    assert figure.svg == saved.read_text() and not any("is drawn" in problem for problem in found.problems)
    assert "Diagram of speed ω (rad/s) against time (s), from 0 to 10" in figure.alt
    saved.unlink()
    found = read(lab, tmp_path)
    assert "<svg" in recorded(found, "Figure 1.2").svg
    assert any("Figure 1.2 is drawn" in problem and "records it again" in problem for problem in found.problems)


@pytest.mark.parametrize(("limit", "is_said"), [(1, True), (2, False), (None, False), ("1", False)])
def test_a_report_is_written_beside_the_notebooks_and_its_pages_are_compared_with_the_limit(
    lab, tmp_path, capsys, limit, is_said
):
    (tmp_path / "course.json").write_text(json.dumps({"student": "ada", "page_limit": limit}), encoding="utf-8")
    lab.report("first")
    said = capsys.readouterr().out
    assert "first_report.pdf, first_report.html" in said
    assert "2 pages, from 04_results.ipynb as it was saved at" in said and "called Figure 7" in said
    assert ("your course allows" in said) == is_said
    assert (tmp_path / "first_report.pdf").read_bytes().startswith(b"%PDF-")
    assert "We measured." in (tmp_path / "first_report.html").read_text(encoding="utf-8")
    lab.report("first")  # what it made itself, it makes anew
    assert "Written in" in capsys.readouterr().out


@pytest.mark.parametrize("name", OURS.reports)
def test_nothing_is_left_out_of_the_texts_of_the_solved_notebooks(name, tmp_path):
    """Their answers are not recorded here."""
    for path in (ROOT / "solutions").glob("*_results.ipynb"):
        (tmp_path / path.name).write_bytes(path.read_bytes())
    found = contents.read(Session("ada", tmp_path, OURS, {}, 1), tmp_path, name, NOON)
    made = writing.write(found)
    assert made.problems == () and len([piece for piece in found.pieces if isinstance(piece, Heading)]) >= 13
    numbers = {piece.label.split()[-1] for piece in found.pieces if isinstance(piece, Exhibit)}
    mentioned = {number for text in texts(found) for number in re.findall(r"(?:Figure|Table) (\d[\d.]*\d|\d)", text)}
    assert numbers == mentioned & numbers and made.page.count('href="#figure-') >= 3 and 'href="#table-' in made.page


def test_without_libraries_or_if_typst_fails_nothing_is_written(lab, tmp_path, capsys, monkeypatch):
    for missing in (["pypandoc"], ["typst"], ["pypandoc", "typst"]):
        with monkeypatch.context() as patch:
            patch.setattr(making, "find_spec", lambda name, missing=missing: None if name in missing else True)
            lab.report("first")
        assert f"%pip install {' '.join(making.NEEDED[name] for name in missing)}" in capsys.readouterr().out
    monkeypatch.setattr(writing, "_resource", lambda name: "#panic()" if name.endswith("typ") else "$body$")
    lab.report("first")
    assert "typst" in capsys.readouterr().out
    assert not list(tmp_path.glob("*report*"))


def test_where_a_program_runs_the_notebook_nothing_is_made_or_needed(lab, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(making, "by_program", lambda: True)
    monkeypatch.setattr(making, "find_spec", lambda name: None)
    making.button(REPORT, lab)
    lab.report("first", pdf="nowhere.pdf")
    assert capsys.readouterr().out.count("lab.report() ") == 2
    assert not list(tmp_path.glob("*report*"))


def test_a_report_is_named_by_its_beginning_and_none_is_guessed():
    for name in ("First report", "first", "FIRST"):
        assert making.find(CATALOGUE.reports, name) == REPORT
    for name in ("", "second", "report"):
        with pytest.raises(AnswerError, match="First report"):
            making.find(CATALOGUE.reports, name)
