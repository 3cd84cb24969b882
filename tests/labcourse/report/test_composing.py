"""A report put together of a student's folder: answers, texts and captions of the saved notebook; and what is said."""

import base64
import json
from datetime import datetime

import matplotlib.pyplot as plt
import numpy as np
import pytest
from report_texts import png

from labcourse.answers import notebooks, parts
from labcourse.answers.catalogue import Catalogue
from labcourse.answers.parts import Question, ReportItem
from labcourse.errors import AnswerError
from labcourse.report import checklist, composing, fine_curves, making, writing
from labcourse.report.document import Recorded
from labcourse.report.markup import Markup
from labcourse.run import RUNNING
from labcourse.session import Session

REPORT = "First report"
NOON = datetime(2026, 11, 23, 12)
_K = parts.number("K", "N/m", None, "A-1", "The stiffness.")
_SPEED = (parts.figure("figure", "A-1", "The speed over time."), parts.matrix("W_c", (2, 2), "A-1", "W."))
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


def save(folder, front=FRONT):
    picture = {"m.png": {"image/png": base64.b64encode(png()).decode()}}
    procedure = "We measured.\n\n$$ a = b \\tag{law} $$\n\n![Mine](attachment:m.png)"
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


def composed(lab, tmp_path):
    return composing.compose(lab, tmp_path, REPORT, NOON)


def recorded(document, label):
    pieces = [piece for section in document.sections for piece in section.pieces]
    return next(piece for piece in pieces if isinstance(piece, Recorded) and piece.label == label)


def messages(document):
    return [notice.message for notice in document.notices]


def test_texts_captions_and_sources_are_those_of_the_saved_notebook(lab, tmp_path, monkeypatch):
    monkeypatch.setattr(notebooks, "MAX_PICTURES", 10)  # of grading; a report has them all
    document = composed(lab, tmp_path)
    assert [one.number for one in document.sections] == ["I.1", "II.1", "II.2", "III.1"]  # without what is judged
    first = document.sections[0]
    assert (first.heading, first.place.link) == ("Procedure: measuring", "04_results.ipynb#cell-id=procedure")
    assert first.pieces[0].pictures["attachment:m.png"].startswith(b"\x89PNG")
    names = ["Mechanics", "2026", "Ada Lovelace, Charles Babbage, C. Third", "ada", "2026-11-23"]
    assert (list(document.cover.values())[1:], document.page_limit) == (names, 2)
    figure, table = recorded(document, "Figure 1.2"), recorded(document, "Table 3")
    assert (figure.caption.markdown, figure.own_caption) == ("The speed $v$\nafter the step.", True)
    assert (table.caption.markdown, table.own_caption) == ("Results of the measurement", False)
    assert {key: text.markdown for key, text in document.sources.items()} == {"1": "A. Author, *A title*."}
    assert [message for message in messages(document) if "'Figure 7' is none" in message]
    for front in ("Nothing.", None):  # changed, or gone
        save(tmp_path, front=front)
        assert composed(lab, tmp_path).cover["authors"] == ""
    assert "is missing: lab.restore() gives it back" in messages(composed(lab, tmp_path))[0]


def test_numbers_run_through_the_whole_report(lab, tmp_path):
    lab.answer("1.2", figure=speed(), W_c=[[1, 2], [3, 4]])
    markup = Markup(composed(lab, tmp_path))
    items = [str(one) for numbered in markup.numbered.values() for one in numbered]
    assert items == ["Figure 1", "Figure 2 (Figure 1.2)", "Table 1 (Table 3)"]
    equations = ["a = b", r"W_{c} = \begin{bmatrix} 1 & 2 \\ 3 & 4 \end{bmatrix}", "c = d"]
    assert [latex for name, latex in markup.alt.items() if name.startswith("equation")] == equations


def test_results_that_are_not_recorded_are_missing_with_their_cell(lab, tmp_path):
    document = composed(lab, tmp_path)
    figure, table, section = recorded(document, "Figure 1.2"), recorded(document, "Table 3"), document.sections[1]
    assert (figure.svg, figure.axes, figure.missing) == ("", (), ("Figure 1.2",))
    assert table.missing == ("The stiffness", "The poles", "The matrix", "The settling time")
    assert (section.missing, section.place.notebook) == (("W_c",), "02_measuring.ipynb")
    lab.answer("Table 3", K=0.000123456, poles=[-1, -2 + 3j, -2 - 3j], A=[[1e-15, 20000]], t_s=0.5)
    table = recorded(composed(lab, tmp_path), "Table 3")
    assert table.missing == ()
    assert table.table.splitlines()[2:] == [
        "| The stiffness | $K$ | $0.0001235$ | N/m |",
        r"| The poles | $\text{poles}$ | $\begin{matrix} -2 \pm 3j \\ -1 \end{matrix}$ | 1/s |",
        r"| The matrix | $A$ | $\begin{bmatrix} 0 & 2 \cdot 10^{4} \end{bmatrix}$ | SI |",
        "| The settling time | $t_{s}$ | $0.5$ | s |",
    ]


def test_a_pole_without_its_conjugate_has_its_own_sign(lab, tmp_path):
    lab.answer("Table 3", K=1, poles=[-1, -2 + 3j, -4 - 5j], A=[[1, 2]], t_s=0.5)
    assert r" -4 - 5j \\ -2 + 3j \\ -1 " in recorded(composed(lab, tmp_path), "Table 3").table


def test_a_figure_is_drawn_with_all_its_points_or_a_notice_says_that_they_are_gone(lab, tmp_path):
    def complete():
        return not any("Figure 1.2 is drawn from the points" in one for one in messages(composed(lab, tmp_path)))

    lab.answer("1.2", figure=speed())
    lab.answer("1.2", figure="no figure")  # is refused
    figure = recorded(composed(lab, tmp_path), "Figure 1.2")
    assert complete() and figure.axes == (("time (s)", r"speed $\omega$ (rad/s)"),)
    assert "Diagram of speed ω (rad/s) against time (s), from 0 to 10" in figure.alt
    (saved,) = (tmp_path / fine_curves.FOLDER).iterdir()
    good = saved.read_text()
    for damaged in ('{"of": 1}', "[", "{}", good.replace('"of": "', '"of": "x')):  # as of another figure
        saved.write_text(damaged)
        assert not complete()
    assert len(recorded(composed(lab, tmp_path), "Figure 1.2").svg) < 0.7 * len(figure.svg)


def test_a_report_is_written_beside_the_notebooks(lab, tmp_path, capsys):
    lab.report("first")
    said = capsys.readouterr().out
    assert "first_report.pdf, first_report.html" in said
    assert "pages, from 04_results.ipynb as it was saved at" in said
    assert "04_results.ipynb: Table 1 (Table 3): not filled in" in said and checklist.NOT_CHECKED in said
    assert (tmp_path / "first_report.pdf").read_bytes().startswith(b"%PDF-")
    assert "We measured." in (tmp_path / "first_report.html").read_text(encoding="utf-8")
    lab.report("first")  # what it made itself, it makes anew
    assert "Written in" in capsys.readouterr().out


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
