"""The house's own rules and counts, on made-up files."""

import re
import subprocess

import count_lines
import lint_house
import marks
import pytest


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ('"""As in lab.value("2.12", "K_s")."""', ["K_s", "2.12"]),
        ('units = {"vm": "V"}  # Table 2', ["vm", "Table 2"]),
        ("servo, joint(theta); conjoint, rejoint, thetas", ["servo", "joint", "theta"]),
        ('x = 2.1 + 0.1  # place(0.1, 0.2), but not of "0.1"', ["0.1"]),
        ('draw(x, alpha=0.3); needs = ">=3.11", "3.11.2"; item.alpha = alphabet', []),
    ],
)
def test_questions_and_quantities_are_found_as_whole_words(text, found):
    assert list(lint_house.words_of_the_course(text)) == [(1, word) for word in found]


def test_each_breach_names_its_file_and_line(tmp_path, monkeypatch, capsys):
    for name, text in {
        "labcourse/answers/forms.py": "# any course\n# theta, as a question of springlab has it\n",
        "rotflex/hil/board.py": "# theta may be named here\n",
        "tests/test_page.py": "from playwright" + ".sync_api import sync_playwright\n",
    }.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text, encoding="utf-8")
    monkeypatch.setattr(lint_house, "ROOT", tmp_path)
    listed = lint_house.CONTRACTS["library"]["source_modules"]
    monkeypatch.setitem(lint_house.CONTRACTS["library"], "source_modules", [*listed, "rotflex.gone"])
    assert lint_house.main() == 1
    places = [line.partition(": ")[0] for line in capsys.readouterr().out.splitlines()]
    assert places == ["labcourse/answers/forms.py:2"] * 2 + ["pyproject.toml", "tests/test_page.py"]


@pytest.mark.parametrize("program", marks.PROGRAMS)
def test_a_program_does_not_start_in_a_test_without_its_marker(program):
    done = subprocess.run([program, "--version"], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (97, "")
    assert f"needs the marker {marks.PROGRAMS[program]}" in done.stderr


MODULE = '''"""Docstring
of a module."""

# A comment.
import math  # with a comment: counts

class Point:
    """Docstring in one line."""

    def length(self):
        """Docstring.

        With a blank line.
        """
        # comment
        return math.hypot(
            self.x,

            self.y,
        )


HELP = """A string
# that is no comment

and no docstring"""
'''


def test_docstrings_comments_and_blank_lines_do_not_count():
    # import, class, def, return and its brackets: 4 lines, and 3 of the string.
    assert count_lines.code_lines(MODULE) == 3 + 4 + 3
    assert count_lines.code_lines('"""Nothing but a docstring."""\n') == 0
    assert count_lines.code_lines("") == 0


def test_a_module_belongs_to_the_room_with_the_longest_pattern(tmp_path):
    for name in ("rotflex/a.py", "rotflex/cli.py", "rotflex/hil/b.py", "rotflex/hil/quick/c.py", "rotflex/new/d.py"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).touch()
    patterns = {"quick": "rotflex/hil/quick/**/*.py", "hil": "rotflex/hil/**/*.py", "rest": "rotflex/cli.py"}
    rooms = {room: (9, [pattern]) for room, pattern in (patterns | {"core": "rotflex/*.py"}).items()}
    found = count_lines.rooms_of_modules(tmp_path, rooms)
    expected = {"a": "core", "cli": "rest", "b": "hil", "c": "quick", "d": None}
    assert {path.stem: room for path, room in found.items()} == expected


def test_more_lines_than_before_and_a_module_in_no_room_fail(tmp_path, monkeypatch, capsys):
    for name in ("rotflex/a.py", "rotflex/new/b.py"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text("one = 1\ntwo = 2\n", encoding="utf-8")
    monkeypatch.setattr(count_lines, "ROOT", tmp_path)
    (tmp_path / "tests").mkdir()
    for most, rooms, wrong in (
        (4, {"core": (1, ("rotflex/*.py",)), "new": (2, ("rotflex/new/*.py",))}, ()),
        (3, {"core": (1, ("rotflex/*.py",)), "new": (2, ("rotflex/new/*.py",))}, ("4 lines of code",)),
        (4, {"core": (1, ("rotflex/*.py",))}, ("new/b.py is in no room",)),
    ):
        monkeypatch.setattr(count_lines, "MOST", most)
        monkeypatch.setattr(count_lines, "ROOMS", rooms)
        assert count_lines.main() == bool(wrong)
        shown = capsys.readouterr().out
        assert all(one in shown for one in wrong)
        assert re.search(r"^core +2 +1 +1$", shown, re.MULTILINE)
