"""The house's own rules and counts, on made-up files."""

import re
import subprocess

import count_lines
import lint_house
import marks
import pytest


def test_each_breach_names_its_file_and_line(tmp_path, monkeypatch, capsys):
    for name, text in {
        "labcourse/answers/forms.py": "# one\n# theta, as a question of springlab has it\nconjoint = 2.1, '2.12'\n",
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
    assert places == ["labcourse/answers/forms.py:2"] * 2 + [
        "labcourse/answers/forms.py:3",
        "pyproject.toml",
        "tests/test_page.py",
    ]


@pytest.mark.parametrize("program", marks.PROGRAMS)
def test_a_program_does_not_start_in_a_test_without_its_marker(program):
    done = subprocess.run([program, "--version"], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (97, "")
    assert f"needs the marker {marks.PROGRAMS[program]}" in done.stderr


MODULE = '''"""Docstring
of a module."""

# A comment.
one = 1  # with a comment: counts


def two():
    """Docstring."""
    return """A string
# that is no comment

and no docstring"""
'''


def test_more_lines_than_before_and_a_module_in_no_room_fail(tmp_path, monkeypatch, capsys):
    for name in ("rotflex/a.py", "rotflex/new/b.py"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(MODULE, encoding="utf-8")
    monkeypatch.setattr(count_lines, "ROOT", tmp_path)
    (tmp_path / "tests").mkdir()
    for most, rooms, wrong in (
        # Where several patterns match, the longest one decides.
        (10, {"core": (4, ("rotflex/**/*.py",)), "new": (5, ("rotflex/new/*.py",))}, ()),
        (9, {"core": (4, ("rotflex/**/*.py",)), "new": (5, ("rotflex/new/*.py",))}, ("10 lines of code",)),
        (10, {"core": (4, ("rotflex/*.py",))}, ("new/b.py is in no room",)),
    ):
        monkeypatch.setattr(count_lines, "MOST", most)
        monkeypatch.setattr(count_lines, "ROOMS", rooms)
        assert count_lines.main() == bool(wrong)
        shown = capsys.readouterr().out
        assert all(one in shown for one in wrong)
        assert re.search(r"^core +5 +4 +1$", shown, re.MULTILINE)
