"""The counter of lines of code, on made-up files."""

import count_lines

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
    for name in ("rotflex/a.py", "rotflex/cli.py", "rotflex/hil/b.py", "rotflex/hil/serial/c.py", "rotflex/new/d.py"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).touch()
    rooms = {
        "serial": (9, ["rotflex/hil/serial/**/*.py"]),
        "hil": (9, ["rotflex/hil/**/*.py"]),
        "rest": (9, ["rotflex/cli.py"]),
        "core": (9, ["rotflex/*.py"]),
    }
    found = count_lines.rooms_of_modules(tmp_path, rooms)
    assert {path.stem: room for path, room in found.items()} == {
        "a": "core",
        "cli": "rest",
        "b": "hil",
        "c": "serial",
        "d": None,
    }


def test_a_room_over_its_budget_and_a_module_in_no_room_fail(tmp_path, monkeypatch, capsys):
    for name in ("rotflex/a.py", "rotflex/new/b.py"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text("one = 1\ntwo = 2\n", encoding="utf-8")
    monkeypatch.setattr(count_lines, "ROOT", tmp_path)
    monkeypatch.setattr(count_lines, "ROOMS", {"core": (1, ("rotflex/*.py",))})
    assert count_lines.main() == 1
    shown = capsys.readouterr().out
    assert "core: 2 lines of code, and its budget is 1" in shown
    assert "new/b.py is in no room" in shown
    monkeypatch.setattr(count_lines, "ROOMS", {"core": (2, ("rotflex/*.py",)), "new": (2, ("rotflex/new/*.py",))})
    assert count_lines.main() == 0
