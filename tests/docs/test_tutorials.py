"""Whoever copies the files of docs/tutorials/own_course.md has the course that tests/courses releases and grades."""

import json
import re

from checkout import ROOT

TUTORIALS = ROOT / "docs" / "tutorials"
SPRING = ROOT / "tests" / "courses" / "spring"
SCRIPT = "make_notebook.py"
FILES = {
    name: text
    for name, text in re.findall(
        r"^\*\*`([\w./]+)`\*\*[^\n]*\n\n```(?:python|toml)\n(.*?)^```$",
        (TUTORIALS / "own_course.md").read_text(encoding="utf-8"),
        re.MULTILINE | re.DOTALL,
    )
}


def cells(path):
    """What makes a cell: its id, kind, source and metadata. Points are put in when notebooks are derived."""
    for cell in json.loads(path.read_text(encoding="utf-8"))["cells"]:
        cell["metadata"].get("nbgrader", {}).pop("points", None)
        yield cell["id"], cell["cell_type"], "".join(cell["source"]), cell["metadata"]


def test_every_file_of_the_course_is_on_the_page():
    there = {path.relative_to(SPRING).as_posix() for path in SPRING.rglob("*") if path.suffix in (".py", ".toml")}
    assert {*FILES} - {SCRIPT} == there


def test_each_file_is_as_it_stands_on_the_page():
    there = {name: (SPRING / name).read_text(encoding="utf-8") for name in FILES if name != SCRIPT}
    assert {name: FILES[name] for name in there} == there


def test_the_script_of_the_page_writes_the_notebook(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    exec(compile(FILES[SCRIPT], SCRIPT, "exec"), {})
    notebook = "solutions/01_spring.ipynb"
    assert [*cells(tmp_path / notebook)] == [*cells(SPRING / notebook)]


def test_pictures_are_small_and_described():
    pages = [path.read_text(encoding="utf-8") for path in TUTORIALS.glob("*.md")]
    shown = {name: words for page in pages for words, name in re.findall(r"!\[(.*?)\]\((.*?)\)", page)}
    assert {*shown} == {path.name for path in TUTORIALS.glob("*.png")}
    assert all(len(words.split()) > 8 for words in shown.values())
    assert all(path.stat().st_size < 200_000 for path in TUTORIALS.glob("*.png"))
