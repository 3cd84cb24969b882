"""Names that platforms give, read: also those that are not theirs."""

from datetime import UTC, datetime

import pytest
from hypothesis import given
from hypothesis import strategies as st

from labcourse.grading.intake.platforms import DOWNLOAD_NAMES, Label, label_of, platforms_of, without_copy_number

WHEN = datetime(2026, 11, 21, 13, 5, 59)


@pytest.mark.parametrize(
    ("name", "label"),
    [
        ("Teilnehmer_12_assignsubmission_file_", Label("Moodle", (), "12")),
        (
            "Group 3-Mary-Ann Smith_7_assignsubmission_file_my_work-1.ipynb",
            Label("Moodle", ("Group 3-Mary-Ann Smith", "Mary-Ann Smith", "Ann Smith"), "7", file="my_work-1.ipynb"),
        ),
        (
            "Ada_1_assignsubmission_onlinetext_onlinetext.html",
            Label("Moodle", ("Ada",), "1", file="onlinetext.html", is_receipt=True),
        ),
        ("o_neill_LATE_1_2_x_02-1.zip", Label("Canvas", ("o_neill",), "1", attempt=2, file="x_02-1.zip")),
        ("LATE_anon_a1B2c_99_x.ipynb", Label("Canvas", (), "a1B2c", attempt=99, file="x.ipynb")),
        ("Lab_ada_attempt_2026-11-21-13-05-59.txt", Label("Blackboard", ("Lab_ada", "ada"), "", WHEN, is_receipt=True)),
        (
            "Lab_1_a_lovelace_attempt_2026-11-21-13-05-59_ada work.zip",
            Label(
                "Blackboard",
                ("Lab_1_a_lovelace", "1_a_lovelace", "a_lovelace", "lovelace"),
                "",
                WHEN,
                0,
                "ada work.zip",
            ),
        ),
        (
            "12345-67891 - N0012345 - Mary-Ann Smith- Nov 21, 2026 105 PM - report - final.zip",
            Label("Brightspace", ("Mary-Ann Smith", "N0012345"), "", WHEN.replace(second=0), 0, "report - final.zip"),
        ),
        (
            "1-2 - Bob - Nov 21, 2026 105 PM - Nov 10, 2026 105 PM - w.zip",
            Label("Brightspace", ("Bob",), "", WHEN.replace(second=0), 0, "Nov 10, 2026 105 PM - w.zip"),
        ),
        ("1-2 - Ada - 21 novembre 2026 13 05", Label("Brightspace", ("Ada",))),
        ("ada+lab1+2026-11-21 13:05:59 UTC+a1b2", Label("nbgrader", ("ada",), time=WHEN.replace(tzinfo=UTC))),
    ],
)
def test_a_platforms_name_is_read(name, label):
    assert platforms_of(name) == [label.platform]
    assert label_of(name, label.platform) == label


@pytest.mark.parametrize(
    "name",
    [
        *("ada", "02_x.ipynb", "a_1_b", "1_2_x", "ada_lovelace", "1-2 - Ada", "1-2 - Ada - June", "x" * 5000),
        *("Ada Lovelace_assignsubmission_file_", "Lab_ada_attempt_2026-11-21", "ada - Nov 21, 2026 105 PM"),
    ],
)
def test_other_names_are_not_taken_for_a_platforms(name):
    assert platforms_of(name) == []


@pytest.mark.parametrize(
    ("name", "again"),
    [
        ("ada (1)", ("ada", 1)),
        ("ada(12)", ("ada", 12)),
        ("ada-2", ("ada", 2)),
        ("ada_2", ("ada", 2)),
        ("ada - Copy", ("ada", 1)),
        ("ada copy 3", ("ada", 3)),
        ("ada", None),
        ("ada-2026", None),
    ],
)
def test_the_number_of_a_copy_is_read(name, again):
    assert without_copy_number(name) == again


@given(st.text(st.sampled_from("a1_- ,:/()LATEattempt\u00fc\n"), max_size=400))
def test_any_name_is_read_at_once(name):
    assert {*platforms_of(name)} <= {*DOWNLOAD_NAMES}
    without_copy_number(name)
