"""What a run writes down of its cells, and that nothing of it is believed that is not of its form."""

import json
import subprocess
import sys

import pytest
from hypothesis import given
from hypothesis import strategies as st

from labcourse.answers import cell_reports
from labcourse.answers.cell_reports import CellError, CellReport, Refusal
from labcourse.answers.schema import read_reports

CELLS = {
    "fine": "x = 1",
    "slip": "y = 2\n\nprint(omgea)",
    "inner": "def f():\n    return 1 / 0\n\nf()",
    "syntax": "a = 1\nb = = 2",
    "mute": "class Odd(Exception):\n    def __str__(self):\n        raise ValueError\n\nraise Odd",
    "long": "raise ValueError('x' * 10**6)",
    "library": "import json\njson.loads('{')",
    "awaited": "import asyncio\nawait asyncio.sleep(0)\nundefined",
}
PROGRAM = """
import json, sys
from IPython.core.interactiveshell import InteractiveShell
from labcourse.answers import cell_reports
shell = InteractiveShell.instance()
path, cells = sys.argv[1], json.loads(sys.argv[2])
cell_reports.begin(path, "one.ipynb")
for name, source in cells.items():
    shell.run_cell(source, cell_id=name)
shell.run_cell("1 / 0")  # of no cell
shell.run_cell("get_ipython().exit_now = True", cell_id="left")  # as a kernel's exit() does
"""


@pytest.fixture(scope="module")
def reports(tmp_path_factory):
    path = tmp_path_factory.mktemp("run") / "reports"
    command = [sys.executable, "-c", PROGRAM, str(path), json.dumps(CELLS)]
    subprocess.run(command, check=True, capture_output=True)
    return {report.cell: report for report in read_reports(path.read_bytes()).cells}


ERRORS = {
    "fine": None,
    "slip": CellError("NameError", "name 'omgea' is not defined", 3),
    "inner": CellError("ZeroDivisionError", "division by zero", 2),
    "syntax": CellError("SyntaxError", "invalid syntax", 2),
    "mute": CellError("Odd", "", 5),
    "long": CellError("ValueError", "x" * 300, 1),
    "awaited": CellError("NameError", "name 'undefined' is not defined", 3),
    "left": CellError(cell_reports.LEFT, ""),
}


def test_every_cell_is_reported_by_its_id_with_type_message_and_line_of_its_error(reports):
    assert list(reports) == [*CELLS, "left"]
    assert all(report.finished and report.notebook == "one.ipynb" for report in reports.values())
    assert {cell: reports[cell].error for cell in ERRORS} == ERRORS
    assert (reports["library"].error.type, reports["library"].error.line) == ("JSONDecodeError", 2)  # the cell's line


def line(**content):
    return json.dumps({"notebook": "n", **content}).encode() + b"\n"


def test_reports_on_cells_that_are_not_the_notebooks_are_left_out():
    found = read_reports(line(event="started", cell="c") + line(event="started", cell="d"))
    assert [one.cell for one in found.of({("n", "d"), ("m", "c")}).cells] == ["d"]


def test_what_was_lacked_belongs_to_the_cell_that_was_being_run():
    assert read_reports(line(event="started", cell="c")).cells == (CellReport("n", "c", finished=False),)
    refused = line(event="refused", question="1", part="x", why="it is text")
    assert read_reports(refused).refusals == (Refusal("1", "x", "it is text"),)
    data = line(event="started", cell="c") + line(event="lacked", question="1", part="x") * 2
    (report,) = read_reports(data + line(event="ended", cell="c", error=None)).cells
    assert report.lacked == (("1", "x"),) and report.finished
    many = b"".join(line(event="started", cell=str(number)) for number in range(10_000))
    assert len(read_reports(many).cells) == 6_000


def test_where_nobody_asked_nothing_is_written(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    cell_reports.refused("1", "x", "it is text")
    cell_reports.lacked("1", "x")
    assert list(tmp_path.iterdir()) == []


json_values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.text(),
    lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner),
)
events = st.fixed_dictionaries(
    {},
    optional={
        "event": st.sampled_from(["started", "ended", "lacked", "refused"]) | json_values,
        "notebook": st.text() | json_values,
        "cell": st.text() | json_values,
        "question": st.text() | json_values,
        "part": st.text() | json_values,
        "why": st.text() | json_values,
        "error": st.none() | st.fixed_dictionaries({"type": json_values, "message": json_values, "line": json_values}),
    },
)


@pytest.mark.slow
@given(st.lists(events) | st.binary())
def test_whatever_stands_there_is_bounded_text(content):
    data = content if isinstance(content, bytes) else b"\n".join(json.dumps(one).encode() for one in content)
    found = read_reports(data)
    for report in found.cells:
        assert isinstance(report.cell, str) and len(report.cell) <= 300
        if report.error:
            assert isinstance(report.error.type, str) and len(report.error.message) <= 300
            assert report.error.line is None or 0 < report.error.line < 10**6
