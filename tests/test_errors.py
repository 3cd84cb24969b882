"""What a student sees of an error of the course's, in a notebook that a real kernel runs."""

import re
import subprocess
import sys

import nbformat
from nbclient import NotebookClient

from labcourse.errors import AnswerError

HELPER = "def stiffness():\n    # mine\n    return lab.value('2.12', 'K_s')"
SENTENCE = "AnswerError: 2.12  K_s  not answered yet: notebook 02_finding_stiffness asks for it. Answer it there first."


def shown(folder, *cells):
    """What the last cell shows of its error, without colours."""
    notebook = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(source) for source in cells])
    NotebookClient(
        notebook, timeout=120, kernel_name="python3", allow_errors=True, resources={"metadata": {"path": str(folder)}}
    ).execute()
    (error,) = [output for output in notebook.cells[-1].outputs if output.output_type == "error"]
    return error, [re.sub(r"\x1b\[[\d;]*m", "", line) for line in "\n".join(error.traceback).splitlines()]


def test_an_error_of_the_courses_is_its_sentence_and_the_lines_that_led_to_it(tmp_path):
    """In a cell by itself, and in a function of an earlier cell's; any other error has its traceback."""
    begin = "import rotflex.course.lab\nlab = rotflex.course.lab.start('ada', quiet=True)"
    error, lines = shown(tmp_path, begin, HELPER, "x = 1\nK_s = lab.value('2.12', 'K_s')")
    assert lines == [SENTENCE, "  line 2:  K_s = lab.value('2.12', 'K_s')"]
    assert (error.ename, error.evalue) == ("AnswerError", SENTENCE.removeprefix("AnswerError: "))
    assert shown(tmp_path, begin, HELPER, "# a\n# b\nK_s = stiffness()")[1] == [
        SENTENCE,
        "  line 3:  K_s = stiffness()",
        "  line 3 of a cell that was run before:  return lab.value('2.12', 'K_s')",
    ]
    error, lines = shown(tmp_path, begin, HELPER, "lab.value('2.12', 'K_s' + 1)")
    assert error.ename == "TypeError" and any("Traceback" in line for line in lines)


def test_one_that_no_cell_led_to_is_its_sentence():
    assert AnswerError("No.")._render_traceback_() == ["\x1b[31mAnswerError\x1b[39m: No."]


def test_in_plain_python_the_whole_traceback_is_printed():
    code = "from labcourse.student_id import normalised\nnormalised('a/b')"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.stderr.startswith("Traceback") and "in normalised" in done.stderr
