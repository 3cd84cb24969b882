"""Cells that only show something are left out of a graded run, and nothing comes out differently."""

import json

from made_courses import OURS

from labcourse.answers.words import where_of
from labcourse.grading.course_check import solved_cells
from labcourse.grading.release import student_notebooks
from labcourse.grading.running import bundle, runner
from labcourse.run import skippable_cells
from labcourse.run.merge import merged


def cell(name, source, *tags):
    return {"id": name, "cell_type": "code", "source": source, "metadata": {"tags": list(tags)}}


def left_out(answer, shown="picture = 1", another="print(picture)"):
    """What is left out of a notebook of an answer cell and two illustrations, the second of which uses the first."""
    illustrations = (cell("one", shown, "illustration"), cell("two", another, "illustration"))
    return skippable_cells.skippable([*illustrations, cell("answer", answer)])


def test_what_nothing_depends_on_is_left_out():
    assert left_out("x = 1\nprint(x)") == {"one", "two"}


def test_what_an_answer_uses_and_what_that_uses_in_turn_is_run():
    assert left_out("x = picture") == {"two"}
    assert left_out("y = second", another="second = picture") == set()


def test_where_it_cannot_be_read_off_everything_is_run():
    for answer in ("globals()['pic' + 'ture']", "%time picture", "!ls", "import sys", "x = = 1", "Out[1]", "_"):
        assert left_out(answer) == set(), answer


def test_only_illustrations_are_left_out():
    assert skippable_cells.skippable([cell("one", "a = 1"), cell("two", "b = 2")]) == set()


def test_no_answer_cell_and_no_call_of_the_laboratory_is_an_illustration():
    for path in OURS.notebooks:
        for one in student_notebooks.read(path).cells:
            if skippable_cells.ILLUSTRATION in one.metadata.get("tags", []):
                assert one.cell_type == "code" and not student_notebooks.is_answer(one), (path.name, one.id)
                assert "lab.answer" not in one.source, (path.name, one.id)


def test_answers_are_the_same_to_the_last_bit_with_and_without_illustrations(sandbox):
    """The whole course, solved. What an illustration draws, or runs on a bench, must leave no trace."""
    made = bundle.build(OURS)
    solved = solved_cells(OURS, made.pristine)
    settings = {"parameters": made.parameters, "imports": made.imports}
    notebooks = [merged(made.pristine, solved, every_cell).notebooks for every_cell in (True, False)]
    runs = [runner.run(made.packed, runner.Job("ada", one, 5, **settings)) for one in notebooks]
    assert runs[0].problems == runs[1].problems == ()
    cells = [one for notebook in made.pristine.values() for one in notebook["cells"]]
    in_words = {where[0] for one in cells if (where := where_of(one))}
    recorded = json.loads(runs[0].answers)["answers"].keys()
    assert recorded | in_words == OURS.catalogue.everything.keys()
    assert runs[0].answers == runs[1].answers


def test_a_good_part_of_the_course_is_left_out():
    made = bundle.build(OURS)
    cells = [one for notebook in made.pristine.values() for one in notebook["cells"] if one["cell_type"] == "code"]
    kept = [one for notebook in merged(made.pristine, {}).notebooks.values() for one in notebook["cells"]]
    assert len(kept) < 0.65 * len(cells)
