"""The explorers' scripts: all go to the page, as one module, and a linter sees that module."""

import check_scripts
import pytest
from checkout import ROOT

from labcourse.scene import explorer

SCENE = ROOT / "labcourse" / "scene"
RIGHT = "export function render() { return helper(); }\n"
HELPER = "// A helper.\nfunction helper() {\n  return document.title;\n}\n"


def found(folder, *texts):
    scripts = [folder / f"{number}.js" for number in range(len(texts))]
    for script, text in zip(scripts, texts, strict=True):
        script.write_text(text, encoding="utf-8")
    return [(one.script, one.line, one.rule) for one in check_scripts.findings(scripts)]


def test_every_script_goes_to_the_page():
    assert sorted([*explorer._SCRIPTS, "course_bar.js"]) == sorted(path.name for path in SCENE.glob("*.js"))


def test_the_scripts_are_in_order(capsys):
    assert (check_scripts.main(), capsys.readouterr().out) == (0, "")


def test_a_script_may_use_what_another_defines(tmp_path):
    assert found(tmp_path, HELPER, RIGHT) == []


@pytest.mark.parametrize(
    ("text", "line", "rule"),
    [
        (HELPER + "\nfunction unused() {}\n", 6, "eslint(no-unused-vars)"),
        (HELPER.replace("document", "documnt"), 3, "eslint(no-undef)"),
        (HELPER.replace("document.title", "document.title == 1"), 3, "eslint(eqeqeq)"),
        (HELPER.replace("return document.title", "return 1; helper()"), 3, "eslint(no-unreachable)"),
    ],
)
def test_what_is_wrong_is_told_by_script_and_line(tmp_path, text, line, rule):
    assert found(tmp_path, RIGHT, text) == [(str(tmp_path / "1.js"), line, rule)]
