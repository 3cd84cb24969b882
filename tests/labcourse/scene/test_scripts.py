"""The explorers' scripts: all go to the page, as one module, and a linter sees that module."""

import check_scripts
from checkout import ROOT

from labcourse.scene import live

SCENE = ROOT / "labcourse" / "scene"


def test_every_script_goes_to_the_page():
    assert sorted([*live._SCRIPTS, "course_bar.js"]) == sorted(path.name for path in SCENE.glob("*.js"))


def test_the_scripts_are_in_order(capsys):
    assert (check_scripts.main(), capsys.readouterr().out) == (0, "")
