"""The house's own rules find what they are for, on made-up files."""

import lint_house
import pytest


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ('"""As in lab.value("2.12", "K_s")."""', ["K_s", "2.12"]),
        ('units = {"vm": "V"}  # Table 2', ["vm", "Table 2"]),
        ('x = 2.1 + 0.1  # place(0.1, 0.2), but not of "0.1"', ["0.1"]),
        ('draw(x, alpha=0.3); needs = ">=3.11", "3.11.2"; item.alpha = alphabet', []),
    ],
)
def test_questions_and_quantities_are_found_as_whole_words(text, found):
    assert list(lint_house.words_of_the_course(text)) == [(1, word) for word in found]


def test_each_breach_names_its_file_and_line(tmp_path, monkeypatch, capsys):
    for name, text in {
        "rotflex/courseware/kinds.py": "# any course\n# theta, as a question of springlab has it\n",
        "rotflex/hil/board.py": "# theta may be named here\n",
        "tests/test_page.py": "from playwright" + ".sync_api import sync_playwright\n",
    }.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text, encoding="utf-8")
    monkeypatch.setattr(lint_house, "ROOT", tmp_path)
    monkeypatch.setitem(lint_house.CONTRACTS["models"], "forbidden_modules", ["rotflex.instructor.new"])
    assert lint_house.main() == 1
    places = [line.partition(": ")[0] for line in capsys.readouterr().out.splitlines()]
    assert places == ["rotflex/courseware/kinds.py:2"] * 2 + ["pyproject.toml", "tests/test_page.py"]
