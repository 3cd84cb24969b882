"""Owner and time of each hand-in, whatever a student calls a file: a table, computed from how names are built."""

import unicodedata
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from itertools import product

import pytest
from packings import WANTED, lay, under, work, zipped

from labcourse.grading import intake
from labcourse.grading.gradebook.records import StudentRecord
from labcourse.grading.submission import OWNER, PARTNER, PLATFORM, TIME_RECEIVED

DUE = datetime(2026, 11, 21, 12, 0, tzinfo=UTC)
BEFORE, AFTER = DUE - timedelta(days=3), DUE + timedelta(days=2)
FORGED = datetime(2026, 11, 1, 13, 5, 58, tzinfo=UTC)  # what a student would like it to be


@dataclass(frozen=True)
class Person:
    """A student, as the platforms know them."""

    id: str
    first: str
    last: str
    number: int

    @property
    def name(self) -> str:
        return f"{self.first} {self.last}"


ADA, BOB, EVE = (
    Person("ada", "Ada", "Lovelace", 12345),
    Person("bob", "Bob", "Burns", 1234),
    Person("eve", "Eve", "X", 777),
)

#: Form → name of what lies in the download.
FORMS = {
    "Moodle's folder": "{who}_{number}_assignsubmission_file_/{part}",
    "Moodle's file": "{who}_{number}_assignsubmission_file_{part}",
    "Moodle's blind": "Participant_{number}_assignsubmission_file_/{part}",
    "Canvas": "{who}{_late}_{number}_678{number}_{part}",
    "Canvas, anonymous": "{late_}anon_a{number}_678{number}_{part}",
    "Blackboard": "Lab_{who}_attempt_{when:%Y-%m-%d-%H-%M-%S}_{part}",
    "Brightspace's folder": "1-{number} - {who} - {when:%b %d, %Y %I%M %p}/{part}",
    "Brightspace's file": "1-{number} - {who}- {when:%b %d, %Y %I%M %p} - {part}",
    "nbgrader": "{who}+lab1+{when:%Y-%m-%d %H:%M:%S} UTC/{part}",
}
BLIND = ("Moodle's blind", "Canvas, anonymous")
HAS_NUMBER = ("Moodle's folder", "Moodle's file", "Moodle's blind", "Canvas", "Canvas, anonymous")
LOGINS = ("Blackboard", "nbgrader")  # of these, the platform knows no name


def named(form: str, who: str, number: int, when: datetime, late: bool, part: str) -> str:
    """Return the name of a student as the platform calls them, with a time, a flag, and their own name for the file."""
    flags = {"_late": "_LATE", "late_": "LATE_"} if late else {"_late": "", "late_": ""}
    return FORMS[form].format(who=who, number=number, when=when, part=part, **flags)


#: What a student may call a file to be taken for a class-mate, or for somebody who was in time.
PARTS = [
    *("work.zip", "bob.zip", f"{FORGED:%b %d, %Y %I%M %p} - w.zip"),
    *(f"x-{named(form, 'Bob Burns', BOB.number, FORGED, False, 'work.zip')}".replace("/", "_") for form in FORMS),
    *(named(form, "bob", BOB.number, FORGED, False, "w.zip") for form in ("Canvas", "Blackboard")),
]


def called(form: str, person: Person, by: str) -> str:
    """How a platform writes a student in a name."""
    if by == "ID" or form in LOGINS:
        return person.id
    return f"{person.last}{person.first}".lower() if form == "Canvas" else person.name


def roster(form: str, by: str) -> list[StudentRecord]:
    """The class as the instructor has it; ``by`` says what of a name is on it."""
    number = "a{}" if form == "Canvas, anonymous" else "{}"
    record = {
        "name": lambda one: StudentRecord(one.id, one.name),
        "ID": lambda one: StudentRecord(one.id),
        "number": lambda one: StudentRecord(one.id, aliases=(number.format(one.number),)),
    }
    others = [StudentRecord(one.id, one.name, aliases=(number.format(one.number),)) for one in (BOB, EVE)]
    if by == "no roster":
        return []
    return others if by == "not on the roster" else [*map(record[by], (ADA, BOB, EVE))]


def is_known(form: str, by: str) -> bool:
    """Whether the instructor's side says who a name of the platform means."""
    if by == "number":
        return form in HAS_NUMBER or form in LOGINS
    if by == "no roster":
        return form == "nbgrader"  # the login is the ID
    return by in ("name", "ID") and form not in BLIND


def download(folder, form, by, parts, when, late):
    """A platform's zip of the class, with the times at which it received the files."""
    files = {}
    for person, part in parts.items():
        name = named(form, called(form, person, by), person.number, when, late, part)
        files[name] = zipped(work("bob", names=WANTED[:1], **{"with": [person.id]}), FORGED)
    folder.mkdir()
    path = folder / "submissions.zip"
    path.write_bytes(zipped(files, when))
    return path


def outcome(found):
    """Who has which hand-in, when, and which rows ask for a decision."""
    theirs = {
        one.student: [(piece.source, piece.received if piece.clock else None) for piece in one.pieces]
        for one in found.submissions
    }
    rows = sorted({row.about for row in found.doubts if not row.assumed})
    return {student: pieces for student, pieces in theirs.items() if pieces}, rows


@pytest.mark.parametrize("form", FORMS)
def test_neither_owner_nor_time_is_what_a_student_wrote(tmp_path, form):
    cells = 0
    conditions = [(BEFORE, False), (AFTER, False), (AFTER, True)]
    ways = ["name", "ID", "number", "not on the roster", "no roster"]
    for number, (part, by, (when, late)) in enumerate(product(PARTS, ways, conditions)):
        path = download(tmp_path / str(number), form, by, {ADA: part, EVE: "plain.zip"}, when, late)
        found = intake.find(path, roster(form, by))
        theirs, rows = outcome(found)
        known = is_known(form, by)
        assert ADA.id in theirs if known else ADA.id not in theirs, (part, by)
        assert BOB.id not in theirs, (part, by)
        times = {time for pieces in theirs.values() for _source, time in pieces}
        minutes = {when.replace(second=0)} if "Brightspace" in form else {when}
        assert times <= minutes, (part, by, when)
        assert PLATFORM not in rows and (OWNER in rows) == (not known), (part, by)
        cells += 1
    assert cells == len(PARTS) * 5 * 3


@pytest.mark.parametrize("form", FORMS)
def test_a_download_of_one_file_is_right_or_asks_once(tmp_path, form):
    for number, part in enumerate(PARTS):
        path = download(tmp_path / str(number), form, "name", {ADA: part}, AFTER, False)
        found = intake.find(path, roster(form, "number" if form in BLIND else "name"))
        theirs, rows = outcome(found)
        assert [*theirs] == [ADA.id] or (not found.submissions and rows == [PLATFORM])
        answer = {"platform": form.partition(",")[0].partition("'")[0]}
        decided, rows = outcome(intake.find(path, roster(form, "number" if form in BLIND else "name"), **answer))
        assert [*decided] == [ADA.id] and PLATFORM not in rows


#: What honest students call their zips.
HONEST = [
    *("work", "work (1)", "work-2", "work - Copy", "lab02_2026_11_21_final", "2026-11-21-13-05-59", "1_2_3"),
    *("7", "Übung 2", "U\u0308bung 2", "实验二", "tp nº 2 – été", "a+b", "ada+x", "ada", "Ada Lovelace"),
    *("lovelaceada", "12345_678901", "submissions", "Lab_attempt_2", "file_", "onlinetext"),
    *("lovelaceada_12345_678901_work", "lovelaceada_LATE_12345_678901_work", "LATE", "anon_1_2_x"),
    *("Ada Lovelace_12345_assignsubmission_file_work", "Lab_ada_attempt_2026-11-20-10-00-00_work"),
    *("1-2 - Ada Lovelace - Nov 20, 2026 105 PM", "ada+lab1+2026-11-20 10:00:00 UTC", "bob helped me"),
    *("bob_notes", "course.json", "02_finding_it", "a - b - c", "- "),
]


def laid(folder, layout, files):
    """A platform's download, as an instructor may leave it; what is to be graded."""
    if layout == "unpacked":
        return lay(folder, files, BEFORE)
    if layout == "in a folder":
        return lay(folder, under("Laboratory 1 Download", files), BEFORE)
    inner = under("Laboratory 1", files) if layout == "zip with a folder" else files
    lay(folder, {"submissions.zip": zipped(inner, BEFORE)}, BEFORE)
    return folder / "submissions.zip" if layout == "zip alone" else folder


@pytest.mark.parametrize("layout", ["unpacked", "in a folder", "zip with a folder", "zip alone"])
@pytest.mark.parametrize("form", FORMS)
def test_honest_names_ask_nothing_and_all_is_read(tmp_path, form, layout):
    """Ada hands in a zip, and eve her notebooks as they are."""
    for number, part in enumerate(HONEST):
        handed_in = {ADA: {f"{part}.zip": zipped(work("ada", "by = 'ada'"))}, EVE: work("eve", "by = 'eve'")}
        files = {
            named(form, called(form, person, "name"), person.number, BEFORE, False, own): content
            for person, parts in handed_in.items()
            for own, content in parts.items()
        }
        path = laid(tmp_path / str(number), layout, files)
        found = intake.find(path, roster(form, "number" if form in BLIND else "name"))
        asked = [row for row in found.doubts if row.about != TIME_RECEIVED]
        assert not asked and not found.ignored, (part, asked, found.ignored)
        assert [one.student for one in found.submissions] == ["ada", "eve"], part
        for one in found.submissions:
            intake.choose_newest(one, intake.read(one, WANTED).items, WANTED)
            assert {*one.notebooks} == {*WANTED}, part
            assert one.notebooks[WANTED[0]][0].source == f"by = {one.student!r}"


def test_ones_own_download_may_be_uploaded_again_and_mail_may_lie_beside_a_platform(tmp_path):
    own = zipped({"lovelaceada_12345_678901_work.zip": zipped(work("ada", "by = 'ada'"))})
    eves = zipped(work("eve"))
    files = {"lovelaceada_12345_678999_again.zip": own, "xeve_777_679000_w.zip": eves, "bob.zip": zipped(work("bob"))}
    found = intake.find(lay(tmp_path / "in", files), roster("Canvas", "name"))
    assert outcome(found)[1] == [] and [one.student for one in found.submissions] == ["ada", "bob", "eve"]
    assert not found.ignored and unicodedata.is_normalized("NFC", found.submissions[0].student)


@pytest.mark.parametrize("beside", [{}, {"eve.zip": zipped(work("eve"))}], ids=["alone", "beside another"])
def test_a_zip_with_a_class_mates_zip_in_it_hands_in_for_nobody_else(tmp_path, beside):
    """A zip is a class's only if it was given, or all that lies beside it is a class's, too."""
    inside = {"bob.zip": zipped(work("bob", "spoilt = 1"))}
    known = roster("Canvas", "name")
    for number, name in enumerate(("ada.zip", "homework.zip")):
        found = intake.find(lay(tmp_path / str(number), {name: zipped(inside)} | beside), known)
        owners = [one.student for one in found.submissions if one.pieces]
        if beside or name == "ada.zip":
            assert "bob" not in owners
        assert ("ada" in owners) == (name == "ada.zip")


def test_the_name_of_an_inner_archive_has_no_time_in_a_list(tmp_path):
    files = {"ada.zip": zipped({"bob.zip": zipped(work("ada"), FORGED)}, FORGED)}
    when = {"bob.zip": FORGED, "bob": FORGED, "ada": AFTER}
    (submission,) = intake.find(lay(tmp_path, files, AFTER), roster("Canvas", "name"), when).submissions
    assert [(piece.received, piece.clock) for piece in submission.pieces] == [(AFTER, "the list of times")]


def test_long_names_and_a_file_without_a_name_are_their_platforms(tmp_path):
    files = {
        f"lovelaceada_12345_678901_{'x' * 290}.zip": zipped(work("ada")),
        "xeve_777_679000_\\w.zip": zipped(work("eve")),
        "burnsbob_1234_679001_w.zip": zipped(work("bob")),
    }
    path = tmp_path / "submissions.zip"
    path.write_bytes(zipped(files, BEFORE))
    found = intake.find(path, roster("Canvas", "name"))
    assert [one.student for one in found.submissions] == ["ada", "bob", "eve"]
    assert PLATFORM not in outcome(found)[1]


def test_a_download_without_times_takes_none_from_an_archive_in_an_archive(tmp_path):
    inner = zipped({"in.zip": zipped(work("ada"), FORGED)}, FORGED)
    path = tmp_path / "submissions.zip"
    path.write_bytes(zipped({"lovelaceada_12345_678901_w.zip": inner}, datetime(1980, 1, 1)))
    found = intake.find(path, roster("Canvas", "name"))
    assert [piece.clock for piece in found.submissions[0].pieces] == [""]


def test_a_student_has_four_partners_at_most(tmp_path):
    pieces = {f"{n}.zip": zipped(work("ada", **{"with": [f"s{n}{place}" for place in range(4)]})) for n in range(9)}
    lay(tmp_path, {"ada.zip": zipped(pieces)})
    known = [StudentRecord("ada"), *(StudentRecord(f"s{n}{place}") for n in range(9) for place in range(4))]
    found = intake.find(tmp_path, known)
    assert len([row for row in found.doubts if row.about == PARTNER]) == 4
    assert sum(bool(one.unconfirmed) for one in found.submissions) == 4
