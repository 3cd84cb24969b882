"""A student's own PDF as the report: what is taken, what is said of it, and what no list asks for any more."""

import os
import zipfile

import pytest
from made_notebooks import notebook, saved
from pdfs import blank, composed, typeset
from report_texts import of_text

from labcourse.answers import report_files
from labcourse.answers.catalogue import Catalogue
from labcourse.answers.cell_reports import CellReports
from labcourse.answers.parts import Question, ReportItem, number
from labcourse.errors import AnswerError
from labcourse.problems import Code, Problem, has
from labcourse.report import writing
from labcourse.run import check as checking
from labcourse.run import student_folder
from labcourse.run.check import GOOD, CheckState
from labcourse.run.submit import submit
from labcourse.session import Session

TITLES = ["Procedure", "Results", "Analysis", "Conclusion"]
CATALOGUE = Catalogue(
    [Question("1.1", "1", "01", "Swing", (), (number("k", "N/m", None, "", "?"),))],
    report_items=[
        *(ReportItem("First report", str(n), f"{one}: it", "?", ("B",), part=one) for n, one in enumerate(TITLES)),
        ReportItem("First report", "F", "Looks", "?", ("G",), judged="looks"),
    ],
    reports={"First report": ("2", "02", "On the swing")},
)
NAME = "first_report.pdf"


@pytest.fixture
def folder(tmp_path):
    work = tmp_path / "work"
    work.mkdir()
    (work / "02.ipynb").write_bytes(saved(notebook()))
    return work


@pytest.fixture
def lab(folder):
    return Session("ada", folder, CATALOGUE, {}, 1)


def attach(lab, capsys, data, name="mine.pdf"):
    (lab._folder / name).write_bytes(data)
    lab.report("first", pdf=name)
    return capsys.readouterr().out


@pytest.mark.parametrize("name", ["mine.pdf", NAME])
def test_a_document_lies_beside_the_notebooks_under_the_reports_name(lab, folder, capsys, name):
    said = attach(lab, capsys, typeset(), name)
    assert (folder / NAME).read_bytes() == typeset()
    assert f"Your report is now {name} (" in said and NAME in said
    with pytest.raises(AnswerError, match=r"nowhere\.pdf"):
        lab.report("first", pdf="nowhere.pdf")
    lab.report("first")  # the notebook's report does not write over it
    assert (folder / NAME).read_bytes() == typeset() and "document of your own" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("data", "why"),
    [
        (b"PK\x03\x04 a .docx", "no PDF"),
        (b"", "no PDF"),
        (blank(password="x"), "asks for a password"),
        (blank(owner="x"), "asks for a password"),
        (b"%PDF-1.7 1 0 obj <</Type/XRef/Encrypt<</Filter/Standard", "asks for a password"),
        (b"%PDF-1.7" + bytes(report_files.MAX_BYTES), "20 MB"),
    ],
    ids=["other", "empty", "locked", "not to be changed", "locked in a stream", "large"],
)
def test_what_cannot_be_handed_in_is_refused_and_nothing_is_written(lab, folder, capsys, monkeypatch, data, why):
    monkeypatch.setitem(CATALOGUE.reports, "Second report", CATALOGUE.reports["First report"])
    with pytest.raises(AnswerError, match=why):
        attach(lab, capsys, data)
    with pytest.raises(AnswerError, match="another report than the First report"):
        attach(lab, capsys, typeset(), "second_report.pdf")
    assert not (folder / NAME).exists()


def test_a_document_that_was_made_of_the_notebook_is_taken(lab, capsys):
    assert "made from the texts of the notebook" in attach(lab, capsys, composed())


def test_its_texts_are_missing_nowhere_until_it_is_gone_again(lab, folder, capsys):
    assert "missing: First report Procedure" in report_files.outline("First report", lab)
    attach(lab, capsys, typeset())
    outline = report_files.outline("First report", lab)
    assert "missing" not in outline and outline.count(f"in your own document, {NAME}") == 4
    lab.progress("02")
    assert f"On the swing: in your own document, {NAME}" in capsys.readouterr().out
    (folder / NAME).unlink()
    assert "missing" in report_files.outline("First report", lab)


def test_a_report_that_is_made_of_empty_cells_is_no_document_of_ones_own(lab, folder):
    (folder / NAME).write_bytes(composed())
    assert lab.own_document("First report") is None
    assert "missing: First report Procedure" in report_files.outline("First report", lab)
    assert report_files.is_composed(writing.write(of_text("Words.")).pdf)
    assert not report_files.is_composed(typeset())


def checked(folder, monkeypatch, text=""):
    """What a check finds, without a run."""
    about = {"nbgrader": {"solution": True}, "labcourse": {"question": "First report", "part": "Results"}}
    cell = {"cell_type": "markdown", "id": "results", "metadata": about, "source": "**✎ Your answer**"}
    (folder / "02.ipynb").write_bytes(saved(notebook({**cell, "source": f"{cell['source']}\n\n{text}"})))
    monkeypatch.setattr(checking, "_run", lambda *_: (None, CellReports()))
    return checking.check(folder, {"02.ipynb": notebook(cell)}, CATALOGUE)


@pytest.mark.parametrize(
    ("text", "pdf", "state"),
    [
        ("", None, CheckState.EMPTY),
        ("", composed(), CheckState.EMPTY),
        ("", typeset(), CheckState.IN_PDF),
        ("It swings.", typeset(), CheckState.WRITTEN),
    ],
    ids=["nothing", "made of the notebook", "own", "own and a text"],
)
def test_what_a_check_says_of_a_text(folder, monkeypatch, text, pdf, state):
    if pdf is not None:
        (folder / NAME).write_bytes(pdf)
    found = checked(folder, monkeypatch, text)
    assert [part.state for part in found.parts] == [state]
    assert (state in GOOD) == (state is not CheckState.EMPTY)
    assert has(Code.OWN_REPORT_READ, found.notes, "First report") == (pdf == typeset())


def test_a_report_is_asked_about_if_its_notebook_was_changed_since_whatever_the_clock_says(folder, lab, monkeypatch):
    def asked_about(text):
        return has(Code.REPORT_OUT_OF_DATE, checked(folder, monkeypatch, text).notes, NAME)

    assert not asked_about("It swings.")
    lab.report("first")
    for time in (0, 2**32):
        os.utime(folder / NAME, (time, time))
        assert not asked_about("It swings.") and asked_about("It does not.")


def packed(folder, **options):
    done = submit(folder, {"02.ipynb": notebook()}, CATALOGUE, student="ada", **options)
    with zipfile.ZipFile(done.path) as found:
        return {name: found.read(name) for name in found.namelist()}, "\n".join(done.lines)


def test_it_is_packed_and_the_receipt_names_it_and_a_change_changes_the_content(folder):
    (folder / NAME).write_bytes(typeset())
    (folder / "first_report.html").write_text("for the student alone")
    content, lines = packed(folder)
    assert content[NAME] == typeset() and "first_report.html" not in content
    assert f"Report     First report: your own document, {NAME}" in lines
    (folder / NAME).write_bytes(blank(2))
    assert packed(folder)[1].split("Content")[1].split("\n")[0] != lines.split("Content")[1].split("\n")[0]


def test_a_report_is_no_file_of_ones_own_that_a_run_depends_on(folder):
    (folder / NAME).write_bytes(typeset())
    work = student_folder.read(folder, ["02.ipynb"], catalogue=CATALOGUE)
    assert (dict(work.hand_in.files), list(work.hand_in.reports)) == ({}, [NAME])


def test_another_pdf_beside_the_notebooks_is_asked_about_unless_there_is_a_report(folder):
    (folder / "Report final.pdf").write_bytes(typeset())
    (note,) = student_folder.read(folder, ["02.ipynb"], catalogue=CATALOGUE).notes
    assert note == Problem.of(Code.LOOKS_LIKE_REPORT, "Report final.pdf")
    (folder / NAME).write_bytes(typeset())
    assert student_folder.read(folder, ["02.ipynb"], catalogue=CATALOGUE).notes == ()


@pytest.mark.skipif(os.name == "nt", reason="links need rights there")
def test_what_is_no_pdf_or_a_link_is_not_handed_in_and_that_is_told(folder, tmp_path):
    (folder / NAME).write_bytes(b"PK\x03\x04")
    problems = student_folder.read(folder, ["02.ipynb"], catalogue=CATALOGUE).problems
    assert Problem.of(Code.REPORT_NOT_HANDED_IN, NAME, why=Problem.of(Code.NOT_A_PDF)) in problems
    (folder / NAME).unlink()
    (tmp_path / "else.pdf").write_bytes(typeset())
    (folder / NAME).symlink_to(tmp_path / "else.pdf")
    work = student_folder.read(folder, ["02.ipynb"], catalogue=CATALOGUE)
    (link,) = [problem for problem in work.problems if problem.code is Code.REPORT_NOT_HANDED_IN]
    assert work.hand_in.reports == {} and "it is a link" in link.parameters["why"].parameters["error"]


def test_a_name_says_which_of_two_files_a_mark_was_given_for():
    one, other = (report_files.of_data("First report", data) for data in (blank(1), blank(2)))
    assert one.given != other.given
    assert report_files.is_given(f"A text.\n\n{one.given}") and not report_files.is_given("[PDF: x.pdf]")
    assert report_files.without_digests(one.given) == f"[PDF: {NAME}]"
