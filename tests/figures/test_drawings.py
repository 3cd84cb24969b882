"""The drawings: files that say what they show, and need nothing of the machine."""

import re
from xml.etree import ElementTree

import pytest
from checkout import ROOT

from rotflex import figures
from rotflex.errors import RotflexError


@pytest.mark.parametrize("path", sorted((ROOT / "rotflex/figures/drawings").iterdir()), ids=lambda path: path.stem)
def test_a_drawing_describes_itself_and_needs_no_font_and_nothing_from_elsewhere(path):
    root = ElementTree.parse(path).getroot()
    words = root.findtext("{*}desc")
    assert re.fullmatch(r"[A-Z].{50,}\.", words) and not re.search(r"[\n$\\{}]|\w- \w|  ", words)
    assert path.stem != "desired_poles" or not re.search(r"\d\d|0\.6", words)  # they are asked for
    kinds = {element.tag.partition("}")[2] for element in root.iter()}
    assert kinds <= {"svg", "title", "desc", "defs", "style", "g", "path", "use", "pattern", "rect"}
    places = re.findall(r'(?:href="|url\()(.*?)[")]', path.read_text(encoding="utf-8"))
    assert set(places) <= {f"#{element.get('id')}" for element in root.iter()}


def test_a_drawing_that_does_not_exist_is_refused_with_the_names_of_those_that_do():
    with pytest.raises(RotflexError, match=r"'arms'.*joint_angles, lumped_model"):
        figures.show_drawing("arms")
