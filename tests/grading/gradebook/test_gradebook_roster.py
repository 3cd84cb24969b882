"""Import a roster: a class's CSV, as spreadsheets and course systems write it."""

from dataclasses import replace

import pytest

from labcourse.errors import GradingError
from labcourse.grading.gradebook import Graded, RunRecord, StudentRecord, roster
from labcourse.grading.gradebook.records import RosterReport
from labcourse.grading.intake.owners import Roster
from labcourse.grading.intake.platforms import Label

ADA = StudentRecord("ada", "Ada Lovelace", "ada@example.org", "A", enrolled=True)


@pytest.fixture
def imported(book, tmp_path):
    def bring_in(content):
        """Import a roster; return the report, and the students."""
        file = tmp_path / "roster.csv"
        file.write_bytes(content if isinstance(content, bytes) else content.encode())
        return book.import_roster(file), book.students()

    return bring_in


def counts(report):
    return report.added, report.changed, report.unchanged


@pytest.mark.parametrize(
    "content",
    [
        "student,name,email,section\nada,Ada Lovelace,ada@example.org,A\n",
        "\ufeffStudent ID;Full Name;E-Mail;Group\r\nada;Ada Lovelace;ada@example.org;A\r\n",
        "SECTION\tEmail Address\tFirst_Name\tLast-Name\tUsername\tNickname\nA\tada@example.org\tAda\tLovelace\tada\tx",
        "Student,ID,SIS User ID,Email,Section,Exam (7)\nAda Lovelace,17,ada,ada@example.org,A,3\n",
        'sep=;\r\n"student";"name";"email";"section"\r\n"ada";" Ada\n Lovelace ";"ada@example.org";"A"\r\n;;;\r\n\r\n',
        "id,name,email,section,\r ada ,Ada  Lovelace,ada@example.org,A,,,surplus\r",
        "student\tname\temail\tsection\nada\tAda Lovelace\tada@example.org\tA\n".encode("utf-16"),
    ],
    ids=["plain", "mark and semicolons", "tabs", "course system", "Excel", "old Mac", "UTF-16"],
)
def test_rosters_of_many_forms_are_read(imported, content):
    report, students = imported(content)
    assert counts(report) == (1, 0, 0)
    other_names = ("17",) if ",17," in str(content) else ()  # a course system's own number
    group = "A" if "group" in str(content).casefold() else ""  # which is the section, too, where there is none
    assert students == [replace(ADA, aliases=other_names, group=group)]


@pytest.mark.parametrize(
    ("content", "student", "aliases"),
    [
        (  # Canvas's gradebook
            'Student,ID,SIS User ID,SIS Login ID,Section\n"Lovelace, Ada",12345,a0042,alovelace@example.org,A\n',
            "a0042",
            ("12345", "alovelace@example.org"),
        ),
        (  # Moodle's grading worksheet
            "Identifier,Full name,ID number,Email address\nParticipant 1234567,Ada Lovelace,0042,ada@example.org\n",
            "0042",
            ("Participant 1234567",),
        ),
        (  # Blackboard's grade centre
            '"Last Name","First Name","Username","Student ID"\nLovelace,Ada,alovelace,"=""0042"""\n',
            "0042",
            ("alovelace",),
        ),
        (  # Brightspace's export
            "OrgDefinedId,Username,Last Name,First Name,Email,End-of-Line Indicator\n#0042,#alovelace,L,A,a@b.org,#\n",
            "0042",
            ("alovelace",),
        ),
        ("student,aliases\nada,Countess; alovelace ;;Countess\n", "ada", ("Countess", "alovelace")),
        ("student,alias\n#ada,\n", "#ada", ()),
    ],
    ids=["Canvas", "Moodle", "Blackboard", "Brightspace", "by hand", "none"],
)
def test_names_that_platforms_use_for_a_student_are_stored(imported, content, student, aliases):
    _report, (record,) = imported(content)
    assert (record.student, record.aliases) == (student, aliases)
    assert counts(imported(content)[0]) == (0, 0, 1)


def test_a_row_changes_the_fields_of_its_columns(imported):
    imported("student,name,email,section\nada,Ada Lovelace,ada@example.org,A\nbob,Bob,,B\n")
    assert imported("section,id\nC,bob\nA,ADA\nC,eve\n") == (
        RosterReport(added=1, changed=2, unchanged=0, notes=("bob: section 'B' → 'C'.",)),
        [
            StudentRecord("ADA", ADA.name, ADA.email, "A", enrolled=True),
            StudentRecord("bob", "Bob", "", "C", enrolled=True),
            StudentRecord("eve", "", "", "C", enrolled=True),
        ],
    )
    assert imported("student\nbob\n")[0] == RosterReport(added=0, changed=0, unchanged=1)


def test_an_empty_cell_changes_nothing(imported):
    imported("student,name,email,section,alias\nada,Ada Lovelace,ada@example.org,A,17\n")
    report, students = imported("student,name,email,section,alias\nada,Ada Lovelace,,,\n")
    assert students == [replace(ADA, aliases=("17",))] and counts(report) == (0, 0, 1)
    assert report.notes == ()


def test_a_dash_removes_and_each_student_who_changes_is_mentioned_once(imported):
    imported("student,name,email,section,alias\nada,Ada Lovelace,ada@example.org,A,17;18\nbob,,,,\n")
    report, students = imported("student,name,email,section,alias\nada,Ada King,-,B,-\nbob,Bob,-,,19\neve,-,-,-,-\n")
    assert students == [
        StudentRecord("ada", "Ada Lovelace", "", "B", ("Ada King",), enrolled=True),
        StudentRecord("bob", "Bob", aliases=("19",), enrolled=True),
        StudentRecord("eve", enrolled=True),
    ]
    assert counts(report) == (1, 2, 0)
    assert report.notes == (  # nothing of bob, of whom nothing was known, nor of eve
        "ada: email 'ada@example.org' is removed, section 'A' → 'B', other names '17; 18' is removed, also 'Ada King'.",
    )


CANVAS = (
    "Student,ID,SIS User ID,SIS Login ID,Section,Lab (7)\n,,,,,Manual Posting\n    Points Possible,,,,,20\n"
    '"Lovelace, Ada",71,s1,alove,A,\n"Keller, Mia",72,s2,mkell,A,\n"Keller, Mia",73,s3,mia2@x.org,B,\n'
    '"Student, Test",99,,f00ba4,A,\n'
)
MOODLE = (
    "Identifier,Full name,ID number,Email address,Groups\n"
    "Participant 1,Ada Lovelace,s1,ada@x.org,Bench 1\nParticipant 2,Mia Keller,s2,mia@x.org,Bench 1\n"
    "Participant 3,Mia Keller,,mia2@x.org,Bench 2\n"
)
BOTH = [  # s3 is found by the address, which is the login on Canvas, too
    ("s1", "Lovelace, Ada", "ada@x.org", "A", ("71", "alove", "Participant 1"), "Bench 1"),
    ("s2", "Keller, Mia", "mia@x.org", "A", ("72", "mkell", "Participant 2"), "Bench 1"),
    ("s3", "Keller, Mia", "mia2@x.org", "B", ("73", "mia2@x.org", "Participant 3"), "Bench 2"),
]


def test_lists_of_two_platforms_add_up_and_say_nothing_the_second_time(imported):
    report, _students = imported(CANVAS)
    assert counts(report) == (3, 0, 0) and report.problems == ()
    report, students = imported(MOODLE)
    facts = [(who.student, who.name, who.email, who.section, who.aliases, who.group) for who in students]
    mentioned = [f"{who.student}: also {who.aliases[-1]!r}." for who in students]
    assert facts == BOTH
    assert (counts(report), list(report.notes), report.problems) == ((0, 3, 0), mentioned, ())
    assert Roster(students).by_label(Label("Moodle", ("Mia Keller",), "2")).students == ("s2",)
    assert Roster(students).by_label(Label("Canvas", ("kellermia",), "73")).students == ("s3",)
    for again in (CANVAS, MOODLE):
        report, there = imported(again)
        assert (counts(report), there, report.problems) == ((0, 0, 3), students, ())
        assert not any(note.startswith("s") for note in report.notes)


@pytest.mark.parametrize(
    ("line", "student"),
    [
        ("Ada Lovelace,,Participant 9", "s1"),  # the only one of this name
        ("Mia Keller,,Participant 9", ""),  # one of two
        ("Mia Keller,mkell,Participant 9", "s2"),
        ("Otto Other,mkell,Participant 9", ""),  # the address of somebody with another name
        ("Zoe Zorn,zoe@x.org,Participant 9", ""),
    ],
)
def test_a_line_without_an_id_is_of_the_one_student_it_leads_to_or_is_reported(imported, line, student):
    _report, before = imported(CANVAS)
    report, students = imported(f"Full name,Email address,Identifier\n{line}\n")
    assert [who.student for who in students if "Participant 9" in who.aliases] == [student][: bool(student)]
    assert [problem[:7] for problem in report.problems] == ["Line 2:"][bool(student) :]
    assert len(students) == len(before)


def test_an_id_of_another_list_is_another_name_of_a_known_student_and_otherwise_a_new_student(imported):
    imported(CANVAS)
    report, students = imported("username,name,email\nalove,Ada Lovelace,\nmkell,Otto Other,\ns3,,mkell\n")
    assert [who.student for who in students] == ["mkell", "s1", "s2", "s3"]
    assert (counts(report), report.notes) == ((1, 1, 1), ())
    assert imported("id,name,email,alias\n71,Ada Lovelace,ada2@x.org,A1\n")[0].notes == ("s1: also 'A1'.",)


def test_columns_that_are_not_read_are_reported(imported):
    report, _students = imported(
        "student,tutorial,E-Mail,,First name,Name,email,group\nada,T1,a@b.org,,A,Ada,c@d.org,A\n"
    )
    assert report.notes == ("Columns that are not read: tutorial, First name, email.",)
    assert imported("student,section\nada,A\n")[0].notes == ()


def test_a_student_who_is_graded_already_gets_a_name(book, imported):
    run = RunRecord(
        key="k", student="ada", submission="s", master="m", software="rotflex 0", probe_seed=7, isolation="isolated"
    )
    book.record(Graded(run, (), "key"), "batch", "")
    report, students = imported("Student,Name\nAda,Ada Lovelace\n")
    assert (report.changed, students) == (1, [StudentRecord("Ada", "Ada Lovelace", enrolled=True)])
    assert book.current("Ada").run == run


def test_lines_without_a_usable_id_are_reported_and_left_out(imported):
    report, students = imported(
        "Student,SIS ID,Section\nEve,,\nAda,ada,A\nAda,ADA,A\nAda,ada,A\nBob,bob,B\nBob,bob,C\nX,"
        + "x" * 81 + ",\nY,a\x1bb,\n"
    )  # fmt: skip
    assert [one.student for one in students] == ["ada", "bob"] and report.added == 2
    lines = {problem.partition(":")[0]: problem for problem in report.problems}
    assert list(lines) == [f"Line {number}" for number in (4, 7, 8, 9, 2)]
    assert "has no ID" in lines["Line 2"] and "81 characters" in lines["Line 8"]
    assert "'bob' is in line 6 already" in lines["Line 7"]
    assert students[1].section == "B"


def test_ids_are_compared_and_checked_as_everywhere(imported):
    report, students = imported("student\nju\u0308rgen\nJ\u00dcRGEN\nada  l\na/b\n")
    assert [one.student for one in students] == ["ada  l", "j\u00fcrgen"]
    assert "is in line 2 already" in report.problems[0] and "'a/b'" in report.problems[1]
    report, students = imported("student,name\nju\u0308rgen,J\n")
    assert (report.changed, students[1].name) == (1, "J")


def test_cells_are_text_whatever_they_begin_with(imported):
    _, (student,) = imported('student,name,email,section\n="0042","=HYPERLINK(""x"")",@ada,-1+1\n')
    assert student == StudentRecord("0042", '=HYPERLINK("x")', "@ada", "-1+1", enrolled=True)


@pytest.mark.parametrize(
    ("content", "why"),
    [
        ("ada,Ada Lovelace\nbob,Bob\n", "no column of IDs: call one 'student'"),
        (b"student,name\nada,Ad\xe4\n", "cannot be read: .*utf-8"),
        ("student\n" + "x" * 200_000, "cannot be read: field larger"),
    ],
)
def test_a_file_that_is_no_roster_is_refused_as_a_whole(book, imported, content, why):
    with pytest.raises(GradingError, match=why):
        imported(content)
    assert book.students() == []


def test_an_import_is_one_transaction(book, imported, monkeypatch):
    add = roster.add

    def stumble(record, entry):
        if entry.student == "bob":
            raise AttributeError("shoe")
        return add(record, entry)

    monkeypatch.setattr(roster, "add", stumble)
    with monkeypatch.context() as patch, pytest.raises(AttributeError, match="shoe"):
        patch.setattr(book._database, "reading", None)  # what is read is read in the transaction that writes
        imported("id\nada\nbob\n")
    assert book.students() == []
