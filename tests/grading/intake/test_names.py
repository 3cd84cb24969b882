"""Names that platforms give, read: also those that are not theirs."""

from datetime import UTC, datetime

import pytest
from hypothesis import given
from hypothesis import strategies as st

from labcourse.grading.intake.platforms import PLATFORMS, Label, label_of, platforms_of, without_copy_number

WHEN = datetime(2026, 11, 21, 13, 5, 59)


@pytest.mark.parametrize(
    ("name", "label"),
    [
        ("Ada Lovelace_1234567_assignsubmission_file_", Label("Moodle", ("Ada Lovelace",), "1234567")),
        ("Ada Lovelace_1234567_assignsubmission_file", Label("Moodle", ("Ada Lovelace",), "1234567")),
        (
            "Group 3-Mary-Ann Smith_7_assignsubmission_file_my_work-1.ipynb",
            Label("Moodle", ("Group 3-Mary-Ann Smith", "Mary-Ann Smith", "Ann Smith"), "7", file="my_work-1.ipynb"),
        ),
        ("Teilnehmer_12_assignsubmission_file_", Label("Moodle", (), "12")),
        (
            "Ada_1_assignsubmission_onlinetext_onlinetext.html",
            Label("Moodle", ("Ada",), "1", file="onlinetext.html", is_receipt=True),
        ),
        (
            "lovelaceada_12345_678901_02_03_x-1.ipynb",
            Label("Canvas", ("lovelaceada",), "12345", attempt=678901, file="02_03_x-1.ipynb"),
        ),
        ("o_neill_LATE_1_2_x.zip", Label("Canvas", ("o_neill",), "1", attempt=2, file="x.zip")),
        ("o_neill_late_1_2_x.zip", Label("Canvas", ("o_neill",), "1", attempt=2, file="x.zip")),
        ("LATE_anon_a1B2c_99_x.ipynb", Label("Canvas", (), "a1B2c", attempt=99, file="x.ipynb")),
        (
            "Lab_1_a_lovelace_attempt_2026-11-21-13-05-59_ada work.zip",
            Label(
                "Blackboard",
                ("Lab_1_a_lovelace", "1_a_lovelace", "a_lovelace", "lovelace"),
                time=WHEN,
                file="ada work.zip",
            ),
        ),
        (
            "Lab_ada_attempt_2026-11-21-13-05-59.txt",
            Label("Blackboard", ("Lab_ada", "ada"), time=WHEN, is_receipt=True),
        ),
        (
            "12345-678910 - Mary-Ann Smith - Nov 21, 2026 105 PM",
            Label("Brightspace", ("Mary-Ann Smith",), time=WHEN.replace(second=0)),
        ),
        (
            "12345-67891 - N0012345 - Ada Lovelace- Nov 21, 2026 1305 - report - final.zip",
            Label(
                "Brightspace",
                ("Ada Lovelace", "N0012345"),
                time=WHEN.replace(second=0),
                file="report - final.zip",
            ),
        ),
        ("ada+lab1+2026-11-21 13:05:59 UTC", Label("nbgrader", ("ada",), time=WHEN.replace(tzinfo=UTC))),
        (
            "ada+lab1+2026-11-21 13:05:59 UTC+a1b2",
            Label("nbgrader", ("ada",), time=WHEN.replace(tzinfo=UTC)),
        ),
        ("1-2 - Ada - 21 novembre 2026 13 05", Label("Brightspace", ("Ada",))),
    ],
)
def test_a_platforms_name_is_read(name, label):
    assert platforms_of(name) == [label.platform]
    assert label_of(name, label.platform) == label


@pytest.mark.parametrize(
    "name",
    [
        *(
            "ada",
            "ada (1)",
            "02_x.ipynb",
            "a_1_b",
            "1_2_x",
            "ada_lovelace",
            "2026-11-21",
            "1-2 - Ada",
            "1-2 - Ada - June",
        ),
        *("Ada Lovelace_assignsubmission_file_", "Lab_ada_attempt_2026-11-21", "ada - Nov 21, 2026 105 PM", "x" * 5000),
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
    assert {*platforms_of(name)} <= {*PLATFORMS}
    without_copy_number(name)


@pytest.mark.parametrize(
    ("name", "platform", "person", "time"),
    [
        ("bytebob_12346_678902_ada_attempt_2099-11-10-10-00-00_w.zip", "Canvas", "bytebob", None),
        ("bytebob_LATE_12346_678902_ada_attempt_2026-11-10-10-00-00_w.zip", "Canvas", "bytebob", None),
        (
            "Lab_bob_attempt_2026-11-23-10-00-00_ada_attempt_2026-11-10-10-00-00_w.zip",
            "Blackboard",
            "bob",
            datetime(2026, 11, 23, 10),
        ),
        (
            "123-456 - Bob Byte - Nov 23, 2026 105 PM - x_ada_attempt_2026-11-10-10-00-00_w.zip",
            "Brightspace",
            "Bob Byte",
            datetime(2026, 11, 23, 13, 5),
        ),
        ("Bob Byte_12346_assignsubmission_file_ada_attempt_2026-11-10-10-00-00_w.zip", "Moodle", "Bob Byte", None),
        ("Bob Byte_12346_assignsubmission_file_x-ada_1_assignsubmission_file_w.zip", "Moodle", "Bob Byte", None),
        ("Bob Byte_12346_assignsubmission_file_x-participant_1_assignsubmission_file_w", "Moodle", "Bob Byte", None),
        ("bytebob_12346_678902_x-ada_1234_assignsubmission_file_work.zip", "Canvas", "bytebob", None),
        (
            "1-2 - Bob - Nov 23, 2026 105 PM - Nov 10, 2026 105 PM - w.zip",
            "Brightspace",
            "Bob",
            datetime(2026, 11, 23, 13, 5),
        ),
        (
            "1-2 - Bob - 2026-11-23 1305 - Nov 10, 2026 105 PM - w.zip",
            "Brightspace",
            "Bob",
            datetime(2026, 11, 23, 13, 5),
        ),
    ],
)
def test_a_students_own_name_for_a_file_changes_neither_owner_nor_time(name, platform, person, time):
    label = label_of(name, platform)
    assert label.time == time
    assert person in label.people and "ada" not in label.people


@pytest.mark.parametrize("name", ["1_" * 150, "1-1 - " + "a - " * 70, "a_attempt_" * 30, "-" * 300, "_1" * 149 + "_"])
def test_names_made_to_take_long_do_not(name):
    assert {*platforms_of(name)} <= {*PLATFORMS}
    without_copy_number(name)
