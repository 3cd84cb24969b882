"""What a student sees of an error of the course's, in a notebook that a real kernel runs."""

import re
import subprocess
import sys

import nbformat
from nbclient import NotebookClient

from labcourse.errors import AnswerError

HELPER = "def stiffness():\n    # mine\n    return lab.value('2.12', 'K_s')"
SENTENCE = "AnswerError: 2.12  K_s  not answered yet: notebook 02_finding_stiffness asks for it. Answer it there first."


def test_an_error_of_the_courses_is_its_sentence_and_the_lines_that_led_to_it(tmp_path):
    """In a cell by itself, and in a function of an earlier cell's; any other error has its traceback."""
    begin = "import rotflex.course.lab\nlab = rotflex.course.lab.start('ada', quiet=True)"
    wrong = "x = 1\nK_s = lab.value('2.12', 'K_s')", "# a\n# b\nK_s = stiffness()", "lab.value('2.12', 'K_s' + 1)"
    notebook = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(one) for one in (begin, HELPER, *wrong)])
    NotebookClient(
        notebook, timeout=120, kernel_name="python3", allow_errors=True, resources={"metadata": {"path": str(tmp_path)}}
    ).execute()
    first, second, other = (cell.outputs[-1] for cell in notebook.cells[2:])
    shown = [re.sub(r"\x1b\[[\d;]*m", "", "\n".join(one.traceback)).splitlines() for one in (first, second, other)]
    assert shown[0] == [SENTENCE, "  line 2:  K_s = lab.value('2.12', 'K_s')"]
    assert (first.ename, first.evalue) == ("AnswerError", SENTENCE.removeprefix("AnswerError: "))
    assert shown[1] == [
        SENTENCE,
        "  line 3:  K_s = stiffness()",
        "  line 3 of a cell that was run before:  return lab.value('2.12', 'K_s')",
    ]
    assert other.ename == "TypeError" and any("Traceback" in line for line in shown[2])


def test_one_that_no_cell_led_to_is_its_sentence():
    assert AnswerError("No.")._render_traceback_() == ["\x1b[31mAnswerError\x1b[39m: No."]


def test_in_plain_python_the_whole_traceback_is_printed():
    code = "from labcourse.student_id import normalised\nnormalised('a/b')"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.stderr.startswith("Traceback") and "in normalised" in done.stderr
