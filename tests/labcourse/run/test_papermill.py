"""Notebooks of a release and solutions run with papermill itself, in order, in one folder, and as by our engine."""

import json

import pytest
from checkout import ROOT
from executed import executed, outputs

from labcourse.answers.notebooks import imports_of
from labcourse.run import warm

pytestmark = pytest.mark.slow

RANDOM = {"practice"}  # a cell that draws another bench in each run


def ran(folder, cells, engine, number, **options):
    """The first notebooks of a folder, each run after the last, in a folder: file name → notebook."""
    paths = sorted((ROOT / folder).glob("[01]*.ipynb"))[:number]
    assert len(paths) == (number or 12)
    parameters = {"student": "ada", "bench": "virtual"}
    options |= {"cwd": cells, "execution_timeout": 120}
    return {path.name: executed(path, engine, parameters=parameters, **options) for path in paths}


@pytest.mark.parametrize("folder", ["notebooks", "solutions"])
@pytest.mark.parametrize("number", [3, pytest.param(None, marks=pytest.mark.scheduled)], ids=["three", "all"])
@pytest.mark.timeout(900)
def test_papermill_runs_the_notebooks_and_knows_their_parameters(folder, number, tmp_path, caplog):
    for notebook in ran(folder, tmp_path, None, number).values():
        assert {cell.metadata.papermill.status for cell in notebook.cells} == {"completed"}
    assert [record.message for record in caplog.records if record.name.startswith("papermill")] == []
    if folder == "solutions":  # in a release's, nothing is answered
        assert json.loads((tmp_path / "answers.json").read_bytes())["student"] == "ada"


@pytest.mark.scheduled
@pytest.mark.timeout(900)
def test_solutions_show_the_same_by_both_engines(tmp_path, monkeypatch):
    monkeypatch.delenv("PYTEST_CURRENT_TEST", raising=False)  # with it, a kernel does not look at its descriptors
    masters = {path.name: json.loads(path.read_bytes()) for path in (ROOT / "solutions").glob("[0-9]*.ipynb")}
    found = []
    for engine, options in {None: {}, "labcourse": {"imports": imports_of(masters)}}.items():
        (folder := tmp_path / str(engine)).mkdir()
        notebooks = ran("solutions", folder, engine, None, **options)
        found_in = [*notebooks]
        found.append(
            {
                (name, cell.id): outputs(cell, folder)
                for name, notebook in notebooks.items()
                for cell in notebook.cells
                if "outputs" in cell and "injected-parameters" not in cell.metadata.tags  # it has another id each time
            }
        )
    warm.end()
    theirs, ours = ({place: shown for place, shown in of.items() if place[1] not in RANDOM} for of in found)
    assert [place for place in theirs if theirs[place] != ours.get(place)] == []
    code = {(name, cell["id"]) for name in found_in for cell in masters[name]["cells"] if cell["cell_type"] == "code"}
    assert ours.keys() == {place for place in code if place[1] not in RANDOM}
