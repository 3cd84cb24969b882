"""Answers in words are read off code cells, where they stand between quotes, and nothing is run."""

from __future__ import annotations

import pytest
from made_notebooks import answer, code, locked, text

from rotflex.courseware.run.words_in_code import words_in_code

RECORDER = locked("a-answer", 'lab.answer("1.4", why=why, k=k)')


@pytest.mark.parametrize(
    ("source", "found"),
    [
        ('why = "It rubs."', "It rubs."),
        ('why = (\n    "It "\n    "rubs."\n)', "It rubs."),
        ('why = """\n    It rubs.\n      Always.\n    """', "It rubs.\n  Always."),
        ('why = "No."\nwhy = "It rubs."', "It rubs."),
        ("why = other = 'It rubs.'", "It rubs."),
        ("k = 3\nwhy = f'It rubs {k} times.'", None),
        ("why = 'It'\nwhy += ' rubs.'", None),
        ("why = ''\nif True:\n    why = 'It rubs.'", None),
        ("why = 'It '.strip()", None),
    ],
)
def test_the_last_thing_that_a_name_is_given_counts(source, found):
    assert words_in_code([answer("a", source), RECORDER])[("1.4", "why")] == found


@pytest.mark.parametrize(
    "source", ["", "why = ''", "why = None", 'why = """ """', "k = 3", "why = (", "!ls", "why = '\0'"]
)
def test_what_has_no_text_is_left_out(source):
    assert ("1.4", "why") not in words_in_code([answer("a", source), RECORDER])


def test_pieces_and_added_cells_count_and_what_comes_after_the_recorder_does_not():
    cells = [text("t", "why = 'text'"), answer("a", "why = 'one'"), code("b", "why = 'two'"), RECORDER]
    assert words_in_code([*cells, code("c", "why = 'three'")]) == {("1.4", "why"): "two"}
