"""Answers of an ID that was mistyped and put right: which come back, which come over, and which cannot."""

from __future__ import annotations

import json

import pytest

import rotflex.lab
from rotflex import experiments
from rotflex.courseware import brought_over
from rotflex.courseware.answers import AnswerBook, parse
from rotflex.errors import ConfigurationError


def begun(folder, student):
    return rotflex.lab.start(student, folder=folder, quiet=True)


@pytest.fixture
def folder(tmp_path):
    """With answers of every sort under a mistyped ID."""
    lab = begun(tmp_path, "adda")
    lab.answer("0.1", resolution=0.00153)
    lab.answer("2.11", omega_n=19.9, explanation="It gives way to the link.")
    with lab.bench() as on_the_bench:
        lab.answer("2.9", sweep=experiments.sweep(on_the_bench, duration=1.0, progress=False))
    return tmp_path


def test_they_come_over_but_for_what_belongs_to_the_other_bench_and_all_is_told(folder):
    before = json.loads((folder / "answers.json").read_text())
    lines = brought_over.bring_over(folder, "Adda", "ada")
    assert lines[0] == "Brought over to 'ada': 3 answers that 'Adda' had given."
    assert lines[1].startswith("Not brought over: 2.9 sweep. Recordings, figures and functions belong to the bench of")
    assert "Run your notebooks again, in order" in lines[2]
    lab = begun(folder, "ada")
    assert lab.value("2.11", "omega_n") == 19.9 and lab.has("0.1", "resolution") and not lab.has("2.9", "sweep")
    assert lab.book.notices == []
    assert json.loads((folder / "answers.adda.json").read_text()) == before
    now = parse((folder / "answers.json").read_bytes())
    for known in ("cells", "when"):
        assert {question: set(parts) for question, parts in now[known].items()} == {
            "0.1": {"resolution"},
            "2.11": {"omega_n", "explanation"},
        }


def test_what_the_right_id_has_answered_stays(folder):
    begun(folder, "ada").answer("2.11", omega_n=17.0)  # the others are set aside by this
    lines = brought_over.bring_over(folder, "adda", "ada")
    assert "2 answers" in lines[0]
    lab = begun(folder, "ada")
    assert lab.value("2.11", "omega_n") == 17.0 and lab.value("0.1", "resolution") == 0.00153
    assert (folder / "answers.adda.json").exists()


def test_they_come_back_by_themselves_when_the_id_is_put_right(tmp_path, capsys):
    begun(tmp_path, "Ada L").answer("0.1", resolution=0.00153)
    begun(tmp_path, "adda")  # mistyped: nothing is answered
    assert not (tmp_path / "answers.json").exists()
    capsys.readouterr()
    assert begun(tmp_path, "ada l").value("0.1", "resolution") == 0.00153
    assert "Your answers are back, which had been put aside as answers.Ada_L.json." in capsys.readouterr().out
    begun(tmp_path, "adda").answer("0.1", resolution=0.0016)  # mistyped again, and answered
    assert begun(tmp_path, "ada l").value("0.1", "resolution") == 0.00153
    assert not list(tmp_path.glob("answers.Ada*"))
    assert begun(tmp_path, "adda").value("0.1", "resolution") == 0.0016


def test_whose_label_is_the_same_has_no_part_in_it(tmp_path):
    begun(tmp_path, "a+b").answer("0.1", resolution=0.00153)
    assert not begun(tmp_path, "a b").has("0.1", "resolution")
    assert not brought_over.any_of(tmp_path, "a b") and brought_over.any_of(tmp_path, "A+B")


def test_where_a_program_runs_the_notebooks_nothing_comes_back(tmp_path):
    begun(tmp_path, "ada").answer("0.1", resolution=0.00153)
    (tmp_path / "answers.json").rename(tmp_path / "answers.ada.json")
    book = AnswerBook(tmp_path / "answers.json", "ada", {}, 7, clock=None)
    assert book.get("0.1", "resolution") is None and (tmp_path / "answers.ada.json").exists()


def test_an_id_without_answers_is_refused_by_name_and_nothing_changes(folder):
    before = {path.name: path.read_bytes() for path in folder.iterdir()}
    with pytest.raises(ConfigurationError, match="has no answers of 'bob'"):
        brought_over.bring_over(folder, "bob", "ada")
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == before


def test_a_third_ones_answers_and_a_broken_file_are_set_aside(folder):
    begun(folder, "eve").answer("0.1", resolution=0.002)
    brought_over.bring_over(folder, "adda", "ada")
    assert parse((folder / "answers.eve.json").read_bytes())["student"] == "eve"
    (folder / "answers.json").write_text("{")
    brought_over.bring_over(folder, "adda", "ada")
    assert (folder / "answers.broken.json").read_text() == "{"
    assert begun(folder, "ada").value("0.1", "resolution") == 0.00153


def test_of_functions_only_the_names_are_told(tmp_path):
    lab = begun(tmp_path, "adda")
    lab.answer("2.10", spectrum=lambda x, dt: ([0.0, 1.0], [0.0, 1.0]))
    assert lab.has("2.10", "spectrum")
    assert "2.10 spectrum" in brought_over.bring_over(tmp_path, "adda", "ada")[1]
