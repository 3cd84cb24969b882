"""What all tutorials have in common."""

import re

from checkout import ROOT

TUTORIALS = ROOT / "docs" / "tutorials"


def test_pictures_are_small_and_described():
    pages = [path.read_text(encoding="utf-8") for path in TUTORIALS.glob("*.md")]
    shown = {name: words for page in pages for words, name in re.findall(r"!\[(.*?)\]\((.*?)\)", page)}
    assert {*shown} == {path.name for path in TUTORIALS.glob("*.png")}
    assert all(len(words.split()) > 8 for words in shown.values())
    assert all(path.stat().st_size < 200_000 for path in TUTORIALS.glob("*.png"))
