"""Whoever copies the files of docs/tutorials/own_course.md has the course that tests/courses releases and grades."""

import re

from checkout import ROOT

TUTORIALS = ROOT / "docs" / "tutorials"
SPRING = ROOT / "tests" / "courses" / "spring"
FILES = {
    name: text
    for name, text in re.findall(
        r"^\*\*`([\w./]+)`\*\*[^\n]*\n\n```(?:python|toml)\n(.*?)^```$",
        (TUTORIALS / "own_course.md").read_text(encoding="utf-8"),
        re.MULTILINE | re.DOTALL,
    )
}


def test_every_file_of_the_course_is_on_the_page():
    there = {path.relative_to(SPRING).as_posix() for path in SPRING.rglob("*") if path.suffix in (".py", ".toml")}
    assert {*FILES} == there


def test_each_file_is_as_it_stands_on_the_page():
    there = {name: (SPRING / name).read_text(encoding="utf-8") for name in FILES}
    assert there == FILES


def test_pictures_are_small_and_described():
    pages = [path.read_text(encoding="utf-8") for path in TUTORIALS.glob("*.md")]
    shown = {name: words for page in pages for words, name in re.findall(r"!\[(.*?)\]\((.*?)\)", page)}
    assert {*shown} == {path.name for path in TUTORIALS.glob("*.png")}
    assert all(len(words.split()) > 8 for words in shown.values())
    assert all(path.stat().st_size < 200_000 for path in TUTORIALS.glob("*.png"))
