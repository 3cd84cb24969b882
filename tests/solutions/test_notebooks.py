"""Rules that every notebook keeps: ids, metadata, questions, sizes. (nbval runs them and compares outputs.)"""

from __future__ import annotations

import ast
import re
from pathlib import Path

import nbformat
import pytest
from checkout import ROOT

from rotflex.course.questions import CATALOGUE

SOLUTIONS = sorted((ROOT / "solutions").glob("*.ipynb"))
FOR_STUDENTS = [path for path in SOLUTIONS if not path.name.startswith("9")]
MOST_BYTES = 1_500_000


def cells(path: Path) -> list[nbformat.NotebookNode]:
    return nbformat.read(path, as_version=4).cells


def tags(cell: nbformat.NotebookNode) -> list[str]:
    return cell.metadata.get("tags", [])


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


def asked_of_a_lab(code: str) -> list[tuple[str, str]]:
    """Return question and part of each answer that code reads: ``lab.has("2.11", "omega_n")``, ``lab.value(...)``."""
    read = [
        [argument.value for argument in node.args[:2] if isinstance(argument, ast.Constant)]
        for node in ast.walk(ast.parse(code))
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr in ("has", "value")
    ]
    return [(question, part) for question, part in (each for each in read if len(each) == 2)]


def test_no_text_of_a_release_depends_on_an_answer_in_words():
    released = [path.read_text(encoding="utf-8") for path in sorted((ROOT / "rotflex").rglob("*.py"))]
    for path in FOR_STUDENTS:
        released += [cell.source for cell in cells(path) if cell.cell_type == "code" and "%" not in cell.source[:1]]
    read = {where for code in released for where in asked_of_a_lab(code)}
    in_words = {
        (question.number, part.name)
        for question in CATALOGUE.everything.values()
        for part in question.parts
        if part.kind == "prose"
    }
    assert ("2.12", "K_s") in read
    assert not read & in_words


@pytest.mark.parametrize("path", FOR_STUDENTS, ids=lambda path: path.stem)
def test_an_answer_cell_runs_as_it_is_and_answers_nothing(path):
    """Names are preset to None, and nothing outside a function is read but these names and imports."""
    imported = set()
    for cell in (cell for cell in cells(ROOT / "notebooks" / path.name) if cell.cell_type == "code"):
        body = ast.parse(cell.source).body
        aliases = [alias for node in body if isinstance(node, ast.Import | ast.ImportFrom) for alias in node.names]
        imported |= {(alias.asname or alias.name).partition(".")[0] for alias in aliases}
        bound = set(imported)
        for node in body if answer_cell(cell) else ():
            if isinstance(node, ast.FunctionDef):
                bound.add(node.name)
                continue
            names = [name for name in ast.walk(node) if isinstance(name, ast.Name)]
            assert {name.id for name in names if isinstance(name.ctx, ast.Load)} <= bound, cell.id
            bound |= {name.id for name in names if isinstance(name.ctx, ast.Store)}
            if isinstance(node, ast.Assign) and not isinstance(node.value, ast.Call):
                values = {value.value for value in ast.walk(node.value) if isinstance(value, ast.Constant)}
                assert values == {None}, cell.id
