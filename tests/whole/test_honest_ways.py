"""The honest class, before anybody is graded: its ways can be built, and side by side; each is said in words."""

from __future__ import annotations

import hashlib
import itertools
import re
import unicodedata
from pathlib import Path

import pytest
from checkout import ROOT
from honest_class import WAYS, solved_notebooks
from honest_hand_in import is_answer, released_notebooks, text_of
from honest_slips import AS_A_WHOLE

SOLVED = solved_notebooks(ROOT)


def files(folder: Path) -> dict[str, str]:
    """What lies in a folder: path → digest of the content."""
    paths = [path for path in folder.rglob("*") if path.is_file()]
    return {str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest() for path in paths}


@pytest.fixture(scope="module")
def built(tmp_path_factory) -> dict[str, dict[str, str]]:
    """Each way, built once in a place of its own: name → files."""
    places = {way.name: tmp_path_factory.mktemp("way") for way in WAYS}
    for way in WAYS:
        way.build(places[way.name], SOLVED)
    return {name: files(place) for name, place in places.items()}


def caseless(text: str) -> str:
    return unicodedata.normalize("NFC", text).casefold()


def asked() -> set[str]:
    """The questions of the student notebooks, as their cells name them; and the reports, as a whole."""
    cells = [cell for notebook in released_notebooks(ROOT).values() for cell in notebook["cells"]]
    words = {about["question"] for cell in cells if "question" in (about := cell["metadata"].get("rotflex", {}))}
    return {*words, *AS_A_WHOLE} | {
        name for cell in cells for name in re.findall(r'^lab\.answer\(\s*"(.*?)"', text_of(cell), re.MULTILINE)
    }


def test_solved_notebooks_hold_an_answer_in_each_answer_cell_and_are_else_as_released():
    released = released_notebooks(ROOT)
    assert SOLVED.keys() == released.keys()
    for name, notebook in SOLVED.items():
        for now, before in zip(notebook["cells"], released[name]["cells"], strict=True):
            assert (now == before) != is_answer(before), before["id"]
            assert not is_answer(now) or not re.search("Your code here|Double-click here|SOLUTION", text_of(now))


@pytest.mark.parametrize("way", WAYS, ids=lambda way: way.name)
def test_a_way_puts_something_into_the_class_and_the_same_each_time(way, built, tmp_path):
    way.build(tmp_path, SOLVED)
    assert files(tmp_path)
    assert files(tmp_path) == built[way.name]


def test_no_way_changes_what_all_begin_with(built):
    assert solved_notebooks(ROOT) == SOLVED


def test_names_and_students_are_unique_so_that_all_make_one_class():
    students = [student for way in WAYS for student in (way.student, *way.others)]
    numbers = [row.number for way in WAYS for row in way.roster if row.number]
    for each in ([way.name for way in WAYS], [caseless(student) for student in students], numbers):
        assert len(each) == len(set(each))


def test_all_hand_ins_fit_into_one_folder(built):
    """No way's file or folder is another's, on a system that knows no capitals either."""
    places = [(name, {caseless(path.split("/")[0]) for path in files}) for name, files in built.items()]
    alike = [(a, b) for (a, here), (b, there) in itertools.combinations(places, 2) if here & there]
    assert alike == []
