"""Owners of submissions: by name, by course.json, and where these contradict each other."""

import pytest
from hypothesis import given
from hypothesis import strategies as st
from packings import WANTED, before, lay, moodle, under, work, zipped
from said_problems import names

from labcourse.errors import GradingError
from labcourse.grading import intake
from labcourse.grading.gradebook.records import StudentRecord
from labcourse.grading.intake.owners import Roster
from labcourse.grading.submission import PLATFORM, Doubt
from labcourse.problems import Code, Problem

COMPOSED, APART = "j\u00fcrgen", "ju\u0308rgen"
ROSTER = [
    StudentRecord("ada", "Ada Lovelace"),
    StudentRecord("bob", "Bob Noether"),
    StudentRecord(COMPOSED, "Jürgen G"),
]


def found_in(folder, roster=()):
    found = intake.find(folder, roster)
    return {one.student: one for one in found.submissions}, found.ignored


def not_read(*whys):
    """What is told of names that are not read for some reasons: (names, codes of the reasons)."""
    return [([*one.parameters["files"]], [why.code for why in one.parameters["why"]]) for one in whys]


def names_in(submission):
    return {item.name for item in intake.read(submission, WANTED).items}


def test_submissions_are_folders_and_zips_by_the_students_names(tmp_path):
    for folder in ("grace", "Ada L", ".git"):
        (tmp_path / folder).mkdir()
    lay(tmp_path, {"emmy.ZIP": b"", "readme.txt": b"", "lonely.ipynb": b"{}", "work.rar": b""})
    (tmp_path / "linked").symlink_to(tmp_path / "grace", target_is_directory=True)
    found, ignored = found_in(tmp_path)
    assert list(found) == ["Ada L", "emmy", "grace", "work"]
    assert not_read(*ignored) == [
        (["linked", "readme.txt"], [Code.NO_FOLDER_NO_ZIP]),
        (["lonely.ipynb"], [Code.LOOSE_NOTEBOOK, Code.OWNER_TO_BE_GIVEN]),
    ]


@pytest.mark.parametrize(
    "name", ["grades.csv", "Gradebook.sqlite", "gradebook.sqlite-wal", "a\nb", "x" * 81, "NUL", "a:b", "ada."]
)
def test_a_name_that_cannot_be_an_id_is_reported_and_not_used(tmp_path, name):
    (tmp_path / name).mkdir()
    (tmp_path / "ada").mkdir()
    found, ignored = found_in(tmp_path)
    assert list(found) == ["ada"]
    assert not_read(ignored[0]) == [([name], [Code.NOT_AN_ID, Code.OWNER_TO_BE_GIVEN])]


@pytest.mark.parametrize("other", [APART, APART.upper(), COMPOSED.upper(), f"{APART} "])
@pytest.mark.parametrize("roster", [ROSTER, ()], ids=["roster", "no roster"])
def test_names_that_differ_in_accents_capitals_or_spaces_only_are_one_students(tmp_path, other, roster):
    (tmp_path / COMPOSED).mkdir()
    (tmp_path / f"{other}.zip").write_bytes(b"")
    found, ignored = found_in(tmp_path, roster)
    assert len(found) == 1 and ignored == []
    (submission,) = found.values()
    assert len(submission.pieces) == 2 and submission.student.casefold() == COMPOSED


def test_without_a_roster_an_id_is_spelled_as_it_was_first():
    known = Roster([])
    assert [known.spelled(name) for name in ("ADA", "ada ", "Ada")] == ["ADA"] * 3


@pytest.mark.parametrize("as_read", ["cp437", "cp1252", "latin-1"])
@pytest.mark.parametrize("roster", [ROSTER, ()], ids=["roster", "no roster"])
def test_a_name_in_utf_8_that_was_taken_for_something_else_is_put_right(tmp_path, as_read, roster):
    lay(tmp_path / COMPOSED.encode().decode(as_read), work(None if roster else APART))
    found, _ignored = found_in(tmp_path, roster)
    assert list(found) == [COMPOSED] and found[COMPOSED].problems == []


def test_a_name_in_the_code_of_old_windows_is_understood_by_the_roster(tmp_path):
    (tmp_path / "Jürgen G".encode("cp850").decode("latin-1")).mkdir()
    assert list(found_in(tmp_path, ROSTER)[0]) == [COMPOSED]


def test_of_two_names_that_differ_in_an_accent_each_is_its_students(tmp_path):
    names = {"ada": "José García", "bob": "Jose Garcia"}
    for name in names.values():
        lay(tmp_path / name, work(None))
    found, ignored = found_in(tmp_path, [StudentRecord(student, name) for student, name in names.items()])
    assert ({student: submission.pieces[0].source for student, submission in found.items()}, ignored) == (names, [])


def test_a_zip_that_does_not_say_that_its_names_are_utf_8_is_read_as_such(tmp_path):
    files = moodle("Jürgen G", 7, {"messung_ü.csv": b"1"} | work(None))
    lay(tmp_path, {"class.zip": zipped(files, plain=True)})
    found, _ignored = found_in(tmp_path, ROSTER)
    assert list(found) == [COMPOSED]
    assert "messung_ü.csv" in names_in(found[COMPOSED])


def test_no_folder_and_an_empty_folder_are_errors(tmp_path):
    with pytest.raises(GradingError, match="no folder"):
        intake.find(tmp_path / "nowhere")
    with pytest.raises(GradingError, match="no submissions"):
        intake.find(tmp_path)


def test_loose_notebooks_may_begin_with_an_id_of_the_roster(tmp_path):
    known = [*ROSTER, StudentRecord("ada_b")]
    lay(tmp_path, before("ada_", work(None)) | before("ADA_B - ", work(None)) | before("eve_", work(None)))
    found, ignored = found_in(tmp_path, known)
    assert list(found) == ["ada", "ada_b"]
    for submission in found.values():
        assert set(WANTED) <= names_in(submission)
    (told,) = ignored
    assert "eve_01_first_look.ipynb" in told.parameters["files"]


@pytest.mark.parametrize("roster", [ROSTER, ()], ids=["roster", "no roster"])
def test_where_name_and_course_file_contradict_each_other_the_name_counts_and_it_is_trouble(tmp_path, roster):
    lay(tmp_path / "ada", work("bob"))
    found, _ignored = found_in(tmp_path, roster)
    assert list(found) == ["ada"] and found["ada"].bench_of == "ada"
    assert found["ada"].problems == [Problem.of(Code.OTHER_STUDENT_NAMED, named="bob", owner="ada")]


@pytest.mark.parametrize("says", ["ADA ", "", None, 7, ["ada"]])
def test_the_same_student_written_otherwise_and_nobody_are_no_contradiction(tmp_path, says):
    lay(tmp_path / "ada", work("x") | work(says) if says is not None else work(None))
    assert found_in(tmp_path)[0]["ada"].problems == []


def test_a_course_file_that_names_what_cannot_be_an_id_is_reported(tmp_path):
    lay(tmp_path / "ada", work("a/b"))
    (problem,) = found_in(tmp_path)[0]["ada"].problems
    assert problem == Problem.of(Code.OTHER_STUDENT_NAMED, named="a/b", owner="ada")


def test_what_a_course_file_says_makes_nobody_the_owner_but_is_what_the_row_asks(tmp_path):
    lay(tmp_path / "final version", work("ada"))
    lay(tmp_path / "C:", work("bob"))
    lay(tmp_path / "zoe", work(None))
    lay(tmp_path / "old stuff", {"x.txt": b""})
    found = intake.find(tmp_path, ROSTER)
    assert [one.student for one in found.submissions] == ["zoe"]
    assert found.submissions[0].notes == [Problem.of(Code.NOT_ON_ROSTER, "zoe", student="zoe")]
    rows = {doubt.submission: (doubt.assumed, doubt.alternatives) for doubt in found.doubts if doubt.about == "owner"}
    assert rows == {"final version": ("", "ada"), "C:": ("", "bob"), "zoe": ("zoe", ""), "old stuff": ("", "")}


def test_a_students_own_folder_can_be_given_as_it_is(tmp_path):
    lay(tmp_path, work("ada") | {"data/x.csv": b"1"})
    found, ignored = found_in(tmp_path)
    assert list(found) == ["ada"] and ignored == []
    assert "data/x.csv" in names_in(found["ada"])


@pytest.mark.parametrize("target", ["class", "class.zip"])
def test_what_an_instructor_links_to_is_taken_as_itself(tmp_path, target):
    lay(tmp_path, under("class/ada", work("ada")) | {"class.zip": zipped(under("ada", work("ada")))})
    (tmp_path / "link").symlink_to(tmp_path / target, target_is_directory=target == "class")
    found, ignored = found_in(tmp_path / "link")
    assert list(found) == ["ada"] and set(WANTED) <= names_in(found["ada"]) and ignored == []


@pytest.mark.parametrize("roster", [ROSTER, ()], ids=["roster", "no roster"])
@pytest.mark.parametrize("name", ["ada+bob", "Ada+BOB.zip", "ada + bob (1).zip"])
def test_a_pair_is_named_so(tmp_path, name, roster):
    if name.endswith(".zip"):
        lay(tmp_path, {name: zipped(work("bob"))})
    else:
        lay(tmp_path / name, work("bob"))
    found, _ignored = found_in(tmp_path, roster)
    assert [student.casefold() for student in found] == ["ada", "bob"]
    ada, bob = found.values()
    assert (ada.bench_of.casefold(), bob.bench_of.casefold()) == ("bob", "bob")
    assert (ada.partners, bob.partners) == ((bob.student,), (ada.student,))
    assert ada.pieces == bob.pieces


def test_without_a_course_file_it_is_the_first_ones_bench(tmp_path):
    lay(tmp_path / "bob+ada", work(None))
    assert {one.bench_of for one in found_in(tmp_path, ROSTER)[0].values()} == {"bob"}


@pytest.mark.parametrize("files", [work(None), work("ada+lab@example.org")])
def test_an_id_with_a_plus_is_no_pair_unless_something_says_so(tmp_path, files):
    lay(tmp_path / "ada+lab@example.org", files)
    assert list(found_in(tmp_path)[0]) == ["ada+lab@example.org"]
    known = [*ROSTER, StudentRecord("ada+lab@example.org"), StudentRecord("lab@example.org")]
    assert list(found_in(tmp_path, known)[0]) == ["ada+lab@example.org"]


def test_a_course_file_may_name_a_partner_who_handed_in_nothing(tmp_path):
    lay(tmp_path / "ada", work("ada", **{"with": ["BOB", "nobody/at/all", 7]}))
    found, _ignored = found_in(tmp_path, ROSTER)
    assert list(found) == ["ada", "bob"]
    assert [piece.source for piece in found["bob"].unconfirmed] == ["ada"] and not found["bob"].pieces
    unknown = [Problem.of(Code.PARTNER_UNKNOWN, partner=name) for name in ("nobody/at/all", "7")]
    assert [*found["ada"].notes] == unknown
    row = Doubt("ada", "partner", "", (Problem.of(Code.ONLY_THEIR_COURSE_FILE, student="ada"),), "bob")
    assert [doubt for doubt in intake.find(tmp_path, ROSTER).doubts if doubt.about == "partner"] == [row]


def by_instructor(answer):
    """One answer to the row on ada and bob."""
    return {"decisions": {Doubt("ada", "partner", "", (), "bob").key: answer}}


@pytest.mark.parametrize(
    ("folders", "options", "counts"),
    [
        ({"ada": ["bob"]}, {}, None),
        ({"ada": ["bob"], "bob": []}, {}, None),
        ({"ada": ["bob"], "bob": ["ada"]}, {}, True),
        ({"ada": ["bob"], "bob": ["eve"]}, {}, None),
        ({"ada": ["bob"]}, {"earlier": {"bob": ["bob", "ADA"]}.get}, True),
        ({"ada": ["bob"]}, {"earlier": {"bob": ["bob", "eve"]}.get}, None),
        ({"ada": ["bob"]}, by_instructor("yes"), True),
        ({"bob": ["ada"]}, by_instructor("yes"), True),
        ({"ada": ["bob"]}, by_instructor("no"), False),
        ({"ada": ["bob"], "bob": ["ada"]}, by_instructor("no"), False),
        ({"ada": ["bob"]}, by_instructor("perhaps"), None),
        ({"ada": ["bob"]}, {"roster": [StudentRecord("ada", group="7"), StudentRecord("bob", group="7")]}, True),
        ({"ada": ["bob"]}, {"roster": [StudentRecord("ada", group="7"), StudentRecord("bob", group="8")]}, None),
        ({"ada": ["bob"]}, {"roster": [StudentRecord(name, group="7") for name in ("ada", "bob", *"xy")]}, True),
        ({"ada": ["bob"]}, {"roster": [StudentRecord(name, group="7") for name in ("ada", "bob", *"xyz")]}, None),
        ({"Group 3-ada_1_assignsubmission_file_": ["bob"], "Group 3-bob_2_assignsubmission_file_": []}, {}, True),
        ({"Group 3-ada_1_assignsubmission_file_": ["bob"], "Group 4-bob_2_assignsubmission_file_": []}, {}, None),
    ],
)
def test_a_partner_counts_by_both_or_by_the_instructor(tmp_path, folders, options, counts):
    """True: counts; None: waits for a person; False: declined."""
    for name, partners in folders.items():
        student = name.removesuffix("_").partition("_")[0][-3:]
        lay(tmp_path / name, work(student, **{"with": partners}))
    found = intake.find(tmp_path, **{"roster": ROSTER} | options)
    first = "ada" if "ada" in next(iter(folders)) else "bob"
    submissions = {one.student: one for one in found.submissions}
    other = submissions["bob" if first == "ada" else "ada"]
    theirs = [piece.source for piece in other.pieces if first in piece.owner.students]
    assert bool(theirs) == (counts is True)
    assert bool(other.unconfirmed) == (counts is None)
    rows = [doubt.assumed for doubt in found.doubts if doubt.about == "partner"]
    assert rows == ([""] if counts is None else [])


def test_both_may_hand_in_the_same(tmp_path):
    together = work("ada", **{"with": ["bob"]})
    lay(tmp_path, under("ada", together) | {"bob.zip": zipped(together)})
    found, _ignored = found_in(tmp_path, ROSTER)
    assert [len(one.pieces) for one in found.values()] == [2, 2]
    assert {one.bench_of for one in found.values()} == {"ada"}
    assert all(one.problems == [] for one in found.values())


@pytest.mark.parametrize(("before", "counts"), [(None, False), (["ada", "bob"], True), (["bob"], False), ([], False)])
def test_a_course_file_that_names_another_student_is_run_on_their_bench_only_if_they_named_its_owner(
    tmp_path, before, counts
):
    lay(tmp_path / "ada", work("bob", "spoilt = 1", **{"with": ["ada"]}))
    found = {one.student: one for one in intake.find(tmp_path, ROSTER, earlier={"bob": before}.get).submissions}
    assert bool(found["bob"].pieces) == counts
    assert found["ada"].bench_of == ("bob" if counts else "ada")
    assert len(found["ada"].problems) == (not counts)


def test_a_students_zip_with_folders_of_others_is_nothing_of_theirs(tmp_path):
    for roster in (ROSTER, ()):
        folder = tmp_path / str(len(roster))
        lay(folder / "ada", work("ada"))
        lay(folder, {"bob.zip": zipped(under("ada", work("ada", "spoilt = 1")) | under("x/ada", work("ada")))})
        found, _ignored = found_in(folder, roster)
        assert [piece.source for piece in found["ada"].pieces] == ["ada"]
        assert [piece.source for piece in found["bob"].pieces] == ["bob.zip"] and found["bob"].problems


def test_a_class_download_without_a_roster_is_believed_alone_only(tmp_path):
    several = moodle("Ada Lovelace", 1, work("ada")) | moodle("Eve", 2, work("eve"))
    lay(tmp_path, {"class.zip": zipped(several), "bob.zip": zipped(work("bob"))})
    for roster in ((), ROSTER):
        found, ignored = found_in(tmp_path, roster)
        assert list(found) == ["bob"] and not_read(ignored[0]) == [(["class.zip"], [Code.SEVERAL_HAND_INS])]
    (tmp_path / "bob.zip").unlink()
    assert list(found_in(tmp_path, ROSTER)[0]) == ["ada"]


entry_names = st.sampled_from(
    [
        *("ada", "ada.zip", "ada (1).zip", "ADA-1.zip", "ada+bob.zip", "x.7z", "notes.txt", "index.html", ".git"),
        *("Ada Lovelace_1_assignsubmission_file_", "lovelaceada_1_2_work.zip", "lovelaceada_1_3_01_first_look.ipynb"),
        *("L_bob_attempt_2026-11-21-13-05-59.txt", "L_bob_attempt_2026-11-21-13-05-59_x.zip", "who_1_2_run.csv"),
        *("1-2 - Bob Noether - Nov 21, 2026 105 PM", "class.zip", "course.json", "01_first_look.ipynb"),
    ]
)


@given(
    given_names=st.lists(entry_names, max_size=7, unique_by=str.casefold),
    course=st.booleans(),
    roster=st.sampled_from([ROSTER, []]),
)
def test_every_entry_is_taken_or_reported(tmp_path_factory, given_names, course, roster):
    root = tmp_path_factory.mktemp("any")
    for name in given_names:
        inside = work("bob" if course else None, names=WANTED[:1])
        if name.endswith(".zip"):
            packed = moodle("Bob Noether", 3, inside) if name == "class.zip" else inside
            (root / name).write_bytes(zipped(packed))
        elif "." in name[1:] and not name.startswith("."):
            (root / name).write_bytes(b'{"student": "ada"}' if name == "course.json" else b'{"cells": []}')
        else:
            lay(root / name, inside)
    try:
        found = intake.find(root, roster)
        if asked := [doubt for doubt in found.doubts if doubt.about == PLATFORM]:
            assert not found.submissions
            found = intake.find(root, roster, platform=asked[0].alternatives.partition(",")[0])
        sources = [piece.source for one in found.submissions for piece in one.pieces]
        files = [path for one in found.submissions for piece in one.pieces for path in piece.files]
        reported = " ".join([*sources, *files, names(found.ignored)])
    except GradingError as error:
        reported = str(error)
    for name in given_names if root.name not in reported else ():  # it is not one student's own folder as a whole
        assert name.startswith(".") or name in reported or name.split("_")[-1] in reported, name


def test_a_pair_is_two_ids_and_no_other_names(tmp_path):
    """An address with a plus may end as that of somebody else."""
    lay(tmp_path, {"ada+lab@example.org.zip": zipped(work(None)), "ada.zip": zipped(work(None))})
    found, _ignored = found_in(tmp_path, [*ROSTER, StudentRecord("eve", email="lab@example.org")])
    assert list(found) == ["ada", "ada+lab@example.org"]
