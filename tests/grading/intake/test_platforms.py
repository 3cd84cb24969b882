"""What learning platforms hand over is understood: their packings, their names, and what they say of time."""

from datetime import UTC, datetime, timedelta, timezone

import packings
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from packings import WANTED, lay, under, work, zipped
from said_problems import within

from labcourse.errors import GradingError
from labcourse.grading import intake
from labcourse.grading.gradebook.records import StudentRecord
from labcourse.grading.intake import platforms
from labcourse.grading.intake.owners import Roster
from labcourse.grading.intake.platforms import Label, label_of
from labcourse.grading.submission import OWNER, TIME_RECEIVED
from labcourse.problems import Code, Problem
from labcourse.sentences import sentence

ROSTER = [
    StudentRecord("ada", "Ada King Lovelace", "ada@example.org", aliases=("alovelace", "12345")),
    StudentRecord("bob", "Noether, Emmy", aliases=("Participant 1234568", "23456")),
    StudentRecord("jürgen", "Jürgen Groß"),
    StudentRecord("mary", "Mary-Ann Smith-Jones"),
]
WEST = timezone(timedelta(hours=-5))


def first_answer(found, student, name=WANTED[0]):
    submission = next(one for one in found.submissions if one.student == student)
    intake.read(submission, WANTED)
    intake.choose_newest(submission, submission.items, WANTED)
    assert intake.unread_problems(submission) == []
    assert set(submission.notebooks) == set(WANTED)
    return submission.notebooks[name][0].source


def students(found):
    return [one.student for one in found.submissions]


def test_nobody_is_guessed_whom_the_roster_does_not_have(tmp_path):
    lay(tmp_path, packings.moodle("Grace Hopper", 7, work("ada")))
    lay(tmp_path, packings.moodle("Emmy Noether", 1234568, work("bob")))
    found = intake.find(tmp_path, ROSTER)
    assert students(found) == ["bob"]
    assert [doubt.alternatives for doubt in found.doubts if doubt.about == OWNER] == ["ada"]
    (told,) = found.ignored
    assert told.parameters["files"] == ["Grace Hopper_7_assignsubmission_file_"]
    whys = [Problem.of(Code.PLATFORM_NAME_UNKNOWN, platform="Moodle"), Problem.of(Code.COURSE_FILE_NAMES, named="ada")]
    assert told.parameters["why"] == [*whys, Problem.of(Code.OWNER_TO_BE_GIVEN)]
    assert "rotflex roster" in sentence(told)


def test_two_of_one_name_are_distinguished_by_their_number_or_not_at_all(tmp_path):
    roster = [StudentRecord("a1", "Ada Lovelace", aliases=("111",)), StudentRecord("a2", "Ada Lovelace")]
    lay(tmp_path, packings.canvas("lovelaceada", 111, work(None)))
    lay(tmp_path, packings.canvas("lovelaceada", 222, work(None)))
    lay(tmp_path, under("Ada Lovelace", work(None)))
    found = intake.find(tmp_path, roster)
    assert students(found) == ["a1"]
    (told,) = found.ignored
    assert [name.rpartition("_222_")[0] or name for name in told.parameters["files"]] == ["Ada Lovelace", "lovelaceada"]
    assert told.parameters["why"][0] == Problem.of(Code.SEVERAL_STUDENTS, students=["a1", "a2"])


def test_two_numbers_of_one_name_in_a_download_are_two_persons_of_whom_the_roster_may_know_one(tmp_path):
    roster = [StudentRecord("a1", "Ada Lovelace", aliases=("111",)), StudentRecord("b1", "Bob Bell")]
    for week, numbers in (("week 1", (111, 222)), ("week 2", (333, 444)), ("week 3", (555,))):
        for number in numbers:
            lay(tmp_path / week, packings.moodle("Ada Lovelace", number, work(None)))
        lay(tmp_path / week, packings.moodle("Bob Bell", 7, work(None)))
    found = intake.find(tmp_path, roster)
    taken = {one.student: sorted(piece.source for piece in one.pieces) for one in found.submissions}
    assert [source[:24] for source in taken["a1"]] == ["week 1/Ada Lovelace_111_", "week 3/Ada Lovelace_555_"]
    asked = {told.parameters["why"][0]: len(told.parameters["files"]) for told in found.ignored}
    assert asked == {
        Problem.of(Code.NAME_WITH_OTHER_NUMBERS, student="a1", numbers=["111", "222"]): 1,
        Problem.of(Code.NAME_WITH_OTHER_NUMBERS, student="a1", numbers=["333", "444"]): 2,
    }


def test_a_number_that_is_somebody_elses_decides_nothing(tmp_path):
    """A student's number at the university may be another's at the platform."""
    roster = [StudentRecord("12345", "Bob Smith"), StudentRecord("777", "Ada Lovelace")]
    lay(tmp_path, packings.canvas("lovelaceada", 12345, work(None)))
    lay(tmp_path, packings.canvas("hoppergrace", 12345, work(None)))
    found = intake.find(tmp_path, roster)
    differ = Problem.of(Code.NAME_AND_NUMBER_DIFFER, students=["12345", "777"])
    assert not found.submissions and differ in within(found.ignored)


def test_what_the_platform_wrote_itself_is_reported_and_not_read(tmp_path):
    lay(tmp_path / "1" / "in", packings.blackboard("bob", "2026-11-21-13-06-59", work("bob")))
    typed = "Ada King Lovelace_1_assignsubmission_onlinetext_/onlinetext.html"
    lay(tmp_path / "2" / "in", {typed: b"<p>Here it is</p>", "ada/x.txt": b"", "index.html": b""})
    (blackboard,) = intake.find(tmp_path / "1", ROSTER).ignored
    moodle, index = intake.find(tmp_path / "2", ROSTER).ignored
    (typed,), (receipt,) = moodle.parameters["files"], blackboard.parameters["files"]
    assert typed.endswith("Ada King Lovelace_1_assignsubmission_onlinetext_")
    assert receipt.endswith("2026-11-21-13-06-59.txt")
    whys = [Problem.of(Code.WRITTEN_BY_PLATFORM, platform=name) for name in ("Moodle", "Blackboard")]
    assert [moodle.parameters["why"], blackboard.parameters["why"]] == [[why] for why in whys]
    assert index.parameters["files"] == ["in/index.html"]


def only_piece(found, student="ada"):
    (submission,) = [one for one in found.submissions if one.student == student]
    (piece,) = submission.pieces
    return piece


@pytest.mark.parametrize(
    ("files", "when"),
    [
        (packings.blackboard("ada", "2026-11-21-13-05-59", work()), datetime(2026, 11, 21, 13, 5, 59)),
        (packings.blackboard("ada", "2026-13-41-13-05-59", work()), None),
        (packings.brightspace("ada", "Sept 1, 2026 1230 AM", work()), datetime(2026, 9, 1, 0, 30)),
        (packings.brightspace("ada", "21 novembre 2026 13 05", work()), None),
    ],
)
def test_the_time_in_a_platforms_name_counts(tmp_path, files, when):
    saved = datetime(2026, 1, 2, tzinfo=UTC)
    piece = only_piece(intake.find(lay(tmp_path, files, saved), ROSTER, zone=WEST))
    assert piece.received == (when.replace(tzinfo=WEST) if when else saved)
    assert ("name" in piece.clock) == (when is not None)


def test_a_list_of_times_counts_where_names_have_none(tmp_path):
    sheet = (
        "Identifier,Full name,Email address,Status,Grade,Last modified (submission)\n"
        'Participant 1234567,Ada King Lovelace,,Submitted,-,"Saturday, 21 November 2026, 1:05 PM"\n'
        "Participant 1234568,Emmy Noether,,Submitted,-,2026-11-22T08:00:00+01:00\n"
        "Participant 9,Nobody,,No submission,-,-\n"
        "Participant 10,Somebody,,Submitted,-,yesterday\n"
    )
    (tmp_path / "times.csv").write_text(sheet)
    when, problems = platforms.read_times(tmp_path / "times.csv", WEST)
    assert problems == ["Line 5: 'yesterday' is not a time; write it as 2026-11-21 13:05."]
    lay(tmp_path / "in", packings.moodle("Ada King Lovelace", 1234567, work()))
    lay(tmp_path / "in", packings.moodle("Participant", 1234568, work("bob")))
    found = intake.find(tmp_path / "in", ROSTER, when)
    assert only_piece(found).received == datetime(2026, 11, 21, 13, 5, tzinfo=WEST)
    assert only_piece(found, "bob").received == datetime(2026, 11, 22, 7, 0, tzinfo=UTC)  # it says its own zone
    assert only_piece(found, "bob").clock == "the list of times"


@pytest.mark.parametrize("heading", ["name,time", "student;submitted", "File\tReceived"])
def test_a_list_of_times_may_name_files_or_students(tmp_path, heading):
    separator = heading.strip("abcdefghijklmnopqrstuvwxyzFR")[0]
    (tmp_path / "t.csv").write_text(f"{heading}\nada.zip{separator}2026-11-21 13:05\n", encoding="utf-8-sig")
    lay(tmp_path / "in", {"ada.zip": zipped(work())})
    when, problems = platforms.read_times(tmp_path / "t.csv")
    assert (only_piece(intake.find(tmp_path / "in", (), when)).received.hour, problems) == (13, [])


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (None, "There is no file .*t.csv"),
        (b"", "a column 'time'"),
        (b"who,then\n", "a column 'time'"),
        (b"name\n", "a column 'time'"),
        (b"\xff\xfe\xff", "t.csv cannot be read: .* UTF-8"),
    ],
)
def test_what_is_no_list_of_times_is_refused(tmp_path, content, message):
    if content is not None:
        (tmp_path / "t.csv").write_bytes(content)
    with pytest.raises(GradingError, match=message):
        platforms.read_times(tmp_path / "t.csv")


SAVED, LAID = datetime(2026, 11, 21, 13, 5, 58, tzinfo=UTC), datetime(2026, 11, 25, 9, 0, tzinfo=UTC)


@pytest.mark.parametrize(
    ("files", "is_trusted"),
    [
        ({"ada.zip": zipped(work(), SAVED)}, True),
        ({"class.zip": zipped({"ada.zip": zipped(work(), SAVED)}, LAID)}, False),  # made by nobody knows whom
        ({"class.zip": zipped(packings.canvas("lovelaceadaking", 7, {"x.zip": zipped(work(), SAVED)}), LAID)}, True),
        (packings.moodle("Ada King Lovelace", 1234567, {"ada.zip": zipped(work(), SAVED)}), True),
        ({"ada.zip": zipped({"inner.zip": zipped(work(), SAVED)}, SAVED)}, True),
        ({f"ada/{name}": data for name, data in work().items()}, False),
        ({"ada/work.zip": zipped(work(), SAVED)}, False),  # unpacked of another zip, maybe
        ({"class.zip": zipped({f"ada/{name}": data for name, data in work().items()}, SAVED)}, False),
        (packings.moodle("Ada King Lovelace", 1234567, work()), False),
        ({"class.zip": zipped(packings.moodle("Ada King Lovelace", 1234567, work()), LAID)}, True),
        (packings.canvas("Ada King Lovelace", 1234567, work()), True),  # Canvas's own time of each file
    ],
)
def test_the_clock_of_the_students_computer_is_no_time_of_receipt(tmp_path, files, is_trusted):
    found = intake.find(lay(tmp_path, files, LAID), ROSTER)
    piece = only_piece(found)
    assert bool(piece.clock) == is_trusted == (TIME_RECEIVED not in {one.about for one in found.doubts})
    if is_trusted:
        assert piece.received == LAID


def test_times_in_a_platforms_zip_are_of_the_zone_that_is_named(tmp_path):
    packed = zipped(packings.canvas("lovelaceadaking", 7, {"x.zip": zipped(work(), SAVED)}), LAID)
    piece = only_piece(intake.find(lay(tmp_path, {"class.zip": packed}), ROSTER, zone=WEST))
    assert piece.received == LAID.replace(tzinfo=WEST)


def test_the_newest_of_each_notebook_counts(tmp_path):
    lay(tmp_path, packings.blackboard("ada", "2026-11-21-13-05-59", {"ada.zip": zipped(work(answer="old = 1"))}))
    stage = work(answer="new = 1", names=WANTED[1:])
    lay(tmp_path, packings.blackboard("ada", "2026-12-01-09-00-00", {"ada.zip": zipped(stage)}))
    (submission,) = intake.find(tmp_path, ROSTER).submissions
    intake.read(submission, WANTED)
    intake.choose_newest(submission, submission.items, WANTED)
    assert [submission.notebooks[name][0].source for name in WANTED] == ["old = 1", "new = 1", "new = 1"]


@pytest.mark.parametrize(
    "names", [("ada.zip", "ada-1.zip"), ("ada (2).zip", "ada (10).zip"), ("ada/work.zip", "ada/work - Copy.zip")]
)
@pytest.mark.parametrize("roster", [ROSTER, []], ids=["roster", "no roster"])
def test_archives_of_one_time_are_taken_by_the_number_of_the_attempt(tmp_path, names, roster):
    first, second = names
    lay(tmp_path, {first: zipped(work(answer="old = 1")), second: zipped(work(answer="new = 1"))})
    found = intake.find(tmp_path, roster)
    assert students(found) == ["ada"] and first_answer(found, "ada") == "new = 1"


def test_of_loose_files_of_one_name_the_newer_counts_and_it_is_reported(tmp_path):
    """Who hands the same notebook in again has a higher number there."""
    lay(tmp_path, packings.canvas("lovelaceadaking", 12345, work(answer="old = 1")))
    lay(tmp_path, packings.canvas("lovelaceadaking", 12345, work(answer="new = 1", names=WANTED[:1]), first=700000))
    found = intake.find(tmp_path, ROSTER)
    assert [first_answer(found, "ada", name) for name in WANTED] == ["new = 1", "old = 1", "old = 1"]
    (reported,) = [one for one in found.ignored if one.parameters["why"] == [Problem.of(Code.NEWER_OF_SAME_NAME)]]
    assert any("_678901_" in name for name in reported.parameters["files"])


@given(st.datetimes(datetime(1990, 1, 1), datetime(2090, 1, 1)), st.sampled_from(["%I", "%H"]))
@example(datetime(2026, 11, 21, 12, 5), "%I")
@example(datetime(2026, 11, 21, 0, 5), "%I")
@example(datetime(2026, 11, 21, 12, 0), "%H")
def test_times_with_and_without_am_and_pm_are_read_as_strptime_reads_them(when, hour):
    half = " %p" if hour == "%I" else ""
    for pattern in (f"%A, %d %B %Y, {hour}:%M{half}", f"%d %b %Y at {hour}:%M:%S{half.strip().lower()}"):
        written = when.strftime(pattern)
        assert platforms.parse_time(written) == datetime.strptime(written, pattern).replace(second=0, tzinfo=UTC)
    written = when.strftime(f"%b %d, %Y {hour}%M{half}")
    label = label_of(f"12345-678910 - Ada Lovelace - {written}", platforms.BRIGHTSPACE)
    assert label.time == datetime.strptime(written, f"%b %d, %Y {hour}%M{half}")


@pytest.mark.parametrize("clock", ["13:05 AM", "13:05 PM", "25:05 PM", "24:05", "12:60 PM"])
def test_a_time_that_no_clock_shows_is_none(clock):
    assert platforms.parse_time(f"21 November 2026, {clock}") is None
    name = f"1-2 - Ada - Nov 21, 2026 {clock.replace(':', '')}"
    assert label_of(name, platforms.BRIGHTSPACE).time is None


@pytest.mark.parametrize(
    ("ada", "bob"),
    [
        ({"aliases": ("Emmy Noether",)}, {"name": "Emmy Noether"}),
        ({"name": "Noether, Emmy"}, {"name": "Emmy Noether"}),
        ({"aliases": ("Emmy Noether",)}, {"aliases": ("emmy noether",)}),
        ({"email": "Emmy Noether"}, {"name": "Emmy Noether"}),
    ],
)
def test_a_name_that_two_students_have_is_nobodys(tmp_path, ada, bob):
    roster = [StudentRecord("ada", **ada), StudentRecord("bob", **bob), StudentRecord("eve", "Eve")]
    for order in (roster, roster[::-1]):
        known = Roster(order)
        assert known.by_name("Emmy Noether").students == ()
        assert known.by_label(Label("Moodle", ("Emmy Noether",))).students == ()
    lay(tmp_path, packings.moodle("Emmy Noether", 7, work(None)) | under("eve", work("eve")))
    assert students(intake.find(tmp_path, roster)) == ["eve"]


@pytest.mark.parametrize("about", [{"aliases": ("bob",)}, {"name": "Bob"}, {"email": "BOB"}])
def test_an_id_means_its_own_student_where_another_is_called_so_too(about):
    for order in (
        [StudentRecord("ada", **about), StudentRecord("bob")],
        [StudentRecord("bob"), StudentRecord("ada", **about)],
    ):
        known = Roster(order)
        assert known.by_name("bob").students == ("bob",) == known.by_label(Label("Moodle", ("bob",))).students


def test_own_files_that_differ_in_a_number_only_are_both_had_under_their_own_names(tmp_path):
    """Canvas may have counted them: data.csv is there too, as no other file can be meant."""
    own = {"tools.py": b"G = 1\n", "tools-1.py": b"G = 2\n", "data-31.csv": b"3\n", "h-1.py": b"4\n", "h-2.py": b"5\n"}
    lay(tmp_path, packings.canvas("lovelaceadaking", 12345, work() | own))
    (submission,) = intake.find(tmp_path, ROSTER).submissions
    intake.read(submission, WANTED)
    intake.choose_newest(submission, submission.items, WANTED)
    assert submission.files == own | {"data.csv": b"3\n"}


def test_a_time_without_a_zone_is_of_the_one_where_it_is_read():
    east = timezone(timedelta(hours=5, minutes=30))
    assert platforms.in_utc(datetime(2026, 11, 21, 13, 5), east) == datetime(2026, 11, 21, 7, 35, tzinfo=UTC)
    assert platforms.in_utc(datetime(2026, 11, 21, 13, 5, tzinfo=UTC), east) == datetime(
        2026, 11, 21, 13, 5, tzinfo=UTC
    )


def test_of_several_archives_in_one_folder_the_later_counts(tmp_path):
    old, new = (zipped(work(answer=f"{word} = 1"), datetime(2026, 11, day)) for word, day in (("old", 3), ("new", 7)))
    lay(tmp_path, packings.moodle("Ada King Lovelace", 1, {"z.zip": old, "a.zip": new}))
    assert first_answer(intake.find(tmp_path, ROSTER), "ada") == "new = 1"


@pytest.mark.parametrize("name", ["Thumbs.db", ".DS_Store", "~$notes.docx", "ada-receipts.txt"])
def test_what_a_system_or_submit_left_beside_the_zips_is_passed_over(tmp_path, name):
    lay(tmp_path, {"ada.zip": zipped(work("ada")), name: b"\0"})
    found = intake.find(tmp_path)
    assert (students(found), found.ignored) == (["ada"], [])


def test_folders_named_by_students_are_read_from_any_platform(tmp_path):
    """As Microsoft Teams packs them, with each version in a folder."""
    for name, version, when in (
        ("Ada King Lovelace", 1, SAVED),
        ("Ada King Lovelace", 2, LAID),
        ("Emmy Noether", 3, LAID),
    ):
        folder = f"Submitted files/{name}/Laboratory 1/Version {version}"
        lay(tmp_path, under(folder, work(None, f"x = {version}")), when)
    found = intake.find(tmp_path, ROSTER)
    assert students(found) == ["ada", "bob"]
    assert (first_answer(found, "ada"), first_answer(found, "bob")) == ("x = 2", "x = 3")
