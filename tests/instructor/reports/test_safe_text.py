"""Untrusted text made harmless."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rotflex.instructor.reports.safe_text import no_escapes, spreadsheet_cell


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("\x1b[31mred", "\\x1b[31mred"),
        ("bell\a", "bell\\x07"),
        ("\u202egnp.exe", "\\u202egnp.exe"),
        ("\x9b2J", "\\x9b2J"),
        ("half \ud800", "half \\ud800"),
        ("two\nlines\té,你,👩\u200d🔬", "two\nlines\té,你,👩\u200d🔬"),
    ],
)
def test_what_steers_a_terminal_is_shown_instead(text, shown):
    assert no_escapes(text) == shown


@given(st.text(st.characters()))
def test_harmless_text_stays_harmless_and_can_be_written(text):
    shown = no_escapes(text)
    assert no_escapes(shown) == shown
    assert "\x1b" not in shown
    shown.encode("utf-8")


@pytest.mark.parametrize("text", ["=1+1", "+1", "-1", "@SUM(A1)", "\t=1", " =1", "\xa0=1", "\n=1"])
def test_what_a_spreadsheet_would_calculate_is_made_text(text):
    assert spreadsheet_cell(text) == f"'{text}"


def test_other_text_is_left_as_it_is():
    assert spreadsheet_cell("2 =1") == "2 =1"
