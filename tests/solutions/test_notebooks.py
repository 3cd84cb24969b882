"""Rules that every notebook keeps: ids, metadata, questions, sizes. (nbval runs them and compares outputs.)"""

from __future__ import annotations

import ast
import re
from pathlib import Path

import nbformat
import pytest
from checkout import ROOT

from labcourse.answers.words import where_of
from rotflex.course.questions import CATALOGUE

SOLUTIONS = sorted((ROOT / "solutions").glob("*.ipynb"))
FOR_STUDENTS = [path for path in SOLUTIONS if not path.name.startswith("9")]
STUDENT_NOTEBOOKS = sorted((ROOT / "notebooks").glob("*.ipynb"))
MOST_BYTES = 1_500_000


def cells(path: Path) -> list[nbformat.NotebookNode]:
    return nbformat.read(path, as_version=4).cells


def tags(cell: nbformat.NotebookNode) -> list[str]:
    return cell.metadata.get("tags", [])


def in_words(path: Path) -> dict[tuple[str, str], nbformat.NotebookNode]:
    """(question, part) → the text cell that is the answer to it."""
    return {where: cell for cell in cells(path) if (where := where_of(cell))}


def answered(path: Path) -> dict[str, list[nbformat.NotebookNode]]:
    """Question number → the cells that record it, but for answers in words."""
    found: dict[str, list[nbformat.NotebookNode]] = {}
    for cell in cells(path):
        call = re.match(r'lab\.answer\(\s*"([^"]+)"', cell.source) if cell.cell_type == "code" else None
        if call:
            found.setdefault(call.group(1), []).append(cell)
    return found


@pytest.mark.parametrize("path", SOLUTIONS, ids=lambda path: path.stem)
class TestEverySolution:
    def test_is_valid_and_says_so(self, path):
        nbformat.validate(nbformat.read(path, as_version=4))

    def test_has_ids_that_are_stable_and_unique(self, path):
        ids = [cell.id for cell in cells(path)]
        assert len(ids) == len(set(ids))
        assert all(re.fullmatch(r"[a-z0-9][a-z0-9-]*", cell_id) for cell_id in ids)

    def test_is_not_large(self, path):
        assert path.stat().st_size <= MOST_BYTES

    def test_stores_outputs_of_a_run_from_top_to_bottom(self, path):
        counts = [cell.execution_count for cell in cells(path) if cell.cell_type == "code"]
        assert counts == list(range(1, len(counts) + 1))
        errors = [o for c in cells(path) if c.cell_type == "code" for o in c.outputs if o.output_type == "error"]
        assert not errors

    def test_outputs_hold_nothing_of_a_machine(self, path):
        for cell in cells(path):
            for output in cell.get("outputs", []):
                data = output.get("data", {})
                text = "".join(str(data.get(kind, "")) for kind in ("text/plain", "text/markdown", "text/html"))
                text += output.get("text", "")
                assert not re.search(r"0x[0-9a-f]{6,}|/(home|root|tmp|Users)/|\b[A-Z]:\\", text), (cell.id, text)

    def test_every_picture_has_a_description(self, path):
        for cell in cells(path):
            for output in cell.get("outputs", []):
                if "image/png" in output.get("data", {}) and not answer_cell(cell):
                    assert output.metadata.get("image/png", {}).get("alt"), cell.id
                for image in re.findall("<img [^>]*", output.get("data", {}).get("text/html", "")):
                    assert 'alt="' in image, cell.id


def answer_cell(cell: nbformat.NotebookNode) -> bool:
    return bool(cell.metadata.get("nbgrader", {}).get("solution"))


@pytest.mark.parametrize("path", FOR_STUDENTS, ids=lambda path: path.stem)
class TestEverySolutionForStudents:
    def test_has_the_cells_that_a_run_needs(self, path):
        parameters = [cell for cell in cells(path) if "parameters" in tags(cell)]
        assert len(parameters) == 1
        names = [node.targets[0].id for node in ast.parse(parameters[0].source).body]
        assert names == ["student", "bench"]

    def test_answer_cells_carry_nbgraders_metadata(self, path):
        for cell in cells(path):
            data = cell.metadata.get("nbgrader")
            if cell.cell_type != "code" or "parameters" in tags(cell) or "instructor" in tags(cell):
                continue
            assert data, cell.id
            assert data["schema_version"] == 3
            assert data["grade_id"] == cell.id
            assert data["locked"] is not (data["solution"] or "open" in tags(cell))
            assert ("### BEGIN SOLUTION" in cell.source) is data["solution"], cell.id

    def test_each_question_has_its_answer_cell_before_the_cell_that_records_it(self, path):
        ids = [cell.id for cell in cells(path)]
        for number, recording in answered(path).items():
            for cell in recording:
                cell_id = cell.id.removesuffix("-answer")
                assert cell.id == f"{cell_id}-answer"
                assert ids.index(cell_id) == ids.index(cell.id) - 1
                if number[0].isdigit():
                    assert cell_id == f"q{number.replace('.', '-')}"

    def test_records_every_question_of_its_section_with_all_parts(self, path):
        expected = {number for number, question in CATALOGUE.everything.items() if question.notebook == path.stem}
        assert set(answered(path)) | {number for number, _part in in_words(path)} == expected
        for number in expected:
            calls = [ast.parse(cell.source).body[0].value for cell in answered(path).get(number, ())]
            names = [keyword.arg for call in calls for keyword in call.keywords]
            if None not in names:  # no ** in a call
                names += [part for asked, part in in_words(path) if asked == number]
                assert sorted(names) == sorted(part.name for part in CATALOGUE.everything[number].parts), number

    def test_points_are_those_of_the_catalogue(self, path):
        by_id = {cell.id: cell for cell in cells(path)}
        sums: dict[str, float] = {}
        for (number, part), cell in in_words(path).items():
            assert cell.metadata.nbgrader.points == CATALOGUE.everything[number].part(part).points
            sums[number] = sums.get(number, 0) + cell.metadata.nbgrader.points
        for number, recording in answered(path).items():
            given = sum(by_id[cell.id.removesuffix("-answer")].metadata.nbgrader.points for cell in recording)
            sums[number] = sums.get(number, 0) + given
        asked = [question for question in CATALOGUE.everything.values() if question.notebook == path.stem]
        assert sums == {question.number: question.points for question in asked}

    def test_every_answer_in_words_has_a_text_cell_of_its_own_just_before_its_code(self, path):
        ids = [cell.id for cell in cells(path)]
        questions = [question for question in CATALOGUE.everything.values() if question.notebook == path.stem]
        prose = {(one.number, part.name) for one in questions for part in one.parts if part.kind == "prose"}
        assert set(in_words(path)) == prose
        for (number, part), cell in in_words(path).items():
            assert cell.metadata.nbgrader.grade_id == cell.id
            assert cell.id.endswith(f"-{part.replace('_', '-')}")
            if number[0].isdigit():
                question = f"q{number.replace('.', '-')}"
                assert cell.id == f"{question}-{part}"
                assert question not in ids or ids.index(question) == ids.index(cell.id) + 1

    def test_every_question_is_recorded_in_the_stored_run(self, path):
        for recording in answered(path).values():
            for cell in recording:
                text = "".join(output.get("text", "") for output in cell.outputs)
                assert "recorded" in text
                assert "not answered" not in text


def test_there_is_a_student_notebook_for_each_solution():
    assert [path.name for path in STUDENT_NOTEBOOKS] == [path.name for path in FOR_STUDENTS]


@pytest.mark.parametrize("path", STUDENT_NOTEBOOKS, ids=lambda path: path.stem)
def test_student_notebooks_show_no_solution_and_no_output(path):
    for cell in cells(path):
        assert "SOLUTION" not in cell.source
        assert "instructor" not in tags(cell)
        assert cell.cell_type != "code" or (not cell.outputs and cell.execution_count is None)
