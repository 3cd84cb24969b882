"""The command ``rotflex export``."""

import zipfile

import pytest
from gradebooks import enrol, graded, mark, prose, record
from made_courses import OURS, copied
from their_exports import CANVAS, FILES, class_of_four
from typer.testing import CliRunner

from labcourse.grading.gradebook import Gradebook
from rotflex import cli


@pytest.fixture
def folder(tmp_path):
    """A folder of results, and beside it a file of each platform's."""
    (tmp_path / "out").mkdir()
    class_of_four(tmp_path / "out")
    for platform, content in FILES.items():
        (tmp_path / f"{platform.split()[-1]}.csv").write_bytes(content)
    return tmp_path


def export(folder, *options):
    words = ("export", folder / "out", "--solutions", OURS.folder, *options)
    done = CliRunner().invoke(cli.app, list(map(str, words)))
    return done, " ".join(done.output.split())


def test_marks_go_beside_the_platforms_file_which_stays(folder):
    done, said = export(folder, "--into", folder / "Canvas.csv", "--column", "Lab 3")
    assert done.exit_code == 1  # some have no mark, and are named
    assert (folder / "Canvas.csv").read_bytes() == FILES["Canvas"]
    expected = CANVAS.replace('twice",,8', 'twice",83.33,8')
    assert (folder / "Canvas-with-marks.csv").read_bytes().decode("utf-8-sig") == expected
    assert said.startswith("Canvas, column 'Lab 3 (1234)', out of 100: 1 written (0 of them in place")
    assert "s1003: left; still waits for a person: 2.11 explanation." in said
    assert "Canvas-with-marks.csv" in said


@pytest.mark.parametrize(
    ("more", "code"),
    [
        ((), 0),
        ((graded("s1003", mark("wrong", 0.0)),), 1),  # has no line in the file
        ((graded("s1001", mark(), prose(), submission="second"),), 1),  # something of it waits
    ],
)
def test_the_exit_code_says_whether_everybodys_mark_is_in(folder, more, code):
    whole = FILES["Brightspace"].decode().splitlines(keepends=True)[:3]
    (folder / "two.csv").write_text("".join(whole), newline="")
    with Gradebook(folder / "two.sqlite") as book:
        record(book, graded("s1001", mark()), graded("s1002", mark("wrong", 0.0)), *more)
    words = ("export", folder / "two.sqlite", "--solutions", OURS.folder, "--into", folder / "two.csv")
    done = CliRunner().invoke(cli.app, list(map(str, (*words, "--write", folder / "new.csv"))))
    assert done.exit_code == code and "1 replaced: s1002: 8 → 0" in done.output
    waits = code and more[0].run.student == "s1001"
    assert ("ada@x.org,," if waits else "ada@x.org,20,") in (folder / "new.csv").read_text()


STRANGER = '"Nobody, Known",75,s1009,known,Lab A,,,,,\r\n'


@pytest.mark.parametrize(
    ("platform", "column", "change", "code"),
    [
        ("Canvas", "1234", {}, 0),  # one is excused there, and the test student is nobody's
        ("Canvas", "1234", {"\r\n\r\n\r\n": f"\r\n{STRANGER}"}, 1),
        ("Canvas", "1234", {"\r\n\r\n\r\n": f"\r\n{STRANGER}".replace("s1009", "s1005")}, 0),  # was erased
        ("Canvas", "1234", {",40.00,": ",good,", ",EX,": ",1,"}, 1),
        ("worksheet", "Grade", {}, 1),  # Moodle takes no mark of one
        ("worksheet", "Grade", {"50.00,No": "50.00,Yes"}, 0),  # who has handed in nothing
    ],
)
def test_the_exit_code_of_an_ordinary_week_is_0_and_1_if_somebody_has_to_act(folder, platform, column, change, code):
    file = folder / f"{platform}.csv"
    content = file.read_bytes().decode()
    for old, new in change.items():
        assert old in content
        content = content.replace(old, new)
    file.write_text(content, encoding="utf-8", newline="")
    with Gradebook(folder / "out" / "gradebook.sqlite") as book:
        book.set_mark("s1003", "2.11", "explanation", 1.0, reason="All of it.", actor="anna")
        enrol(book, folder, ("s1005", "Dan Dot", "", ""))
        book.persons.erase("s1005", "anna")
    done, _ = export(folder, "--into", file, "--column", column)
    assert done.exit_code == code, done.output


def test_the_column_of_another_assignment_is_named_and_the_scale_stated(folder):
    (course := copied(folder / "course")).joinpath("course.toml").write_text(
        '[[assignment]]\ntitle = "Lab 02"\nnotebooks = ["02_finding_stiffness"]\nout_of = 20\n'
        '[[assignment]]\ntitle = "Lab 3"\nnotebooks = ["03_model_validation"]\nout_of = 25\n'
    )
    asked = ("--into", folder / "Canvas.csv", "--column", "1234", "--solutions", course, "--assignment")
    done, said = export(folder, *asked, "Lab 02")
    assert done.exit_code == 1 and "seems to be the column of Lab 3, not of Lab 02" in said
    assert "out of 100 (Lab 02: 20; the points are scaled)" in said
    assert "seems to be" not in export(folder, *asked, "Lab 3")[1]


def test_a_dry_run_tells_the_same_and_each_new_mark_and_writes_nothing(folder):
    there = sorted(path.name for path in folder.rglob("*"))
    asked = ("--into", folder / "worksheet.csv", "--feedback", folder / "feedback.zip")
    dry, _ = export(folder, *asked, "--dry-run")
    assert sorted(path.name for path in folder.rglob("*")) == there
    done, _ = export(folder, *asked)
    would, will = (set(one.output.splitlines()) for one in (dry, done))
    assert would - will == {"1 into empty cells: s1001: 41.67", "Nothing was written (--dry-run)."}
    assert will - would == {f"Written: {folder / 'worksheet-with-marks.csv'}"}


def test_points_decimals_and_what_is_unfinished_are_as_asked(folder):
    asked = ("--into", folder / "Moodle.csv", "--column", "Lab 3", "--out-of", "100", "--decimals", "0")
    export(folder, *asked, "--unfinished")
    written = (folder / "Moodle-with-marks.csv").read_text()
    assert "ada@x.org,83," in written and "cleo@x.org,67," in written


def test_feedback_for_moodle_and_for_canvas(folder):
    _, said = export(folder, "--into", folder / "worksheet.csv", "--feedback", folder / "moodle.zip")
    names = zipfile.ZipFile(folder / "moodle.zip").namelist()
    assert [name.split("_")[1] for name in names] == ["501", "502", "503"]
    assert "3 pages of feedback in the zip." in said and "s1004: no page; nothing of theirs is graded." in said
    with zipfile.ZipFile(folder / "submissions.zip", "w") as archive:
        archive.writestr("lovelaceada_71_9001_lab.zip", b"")
    asked = ("--into", folder / "Canvas.csv", "--column", "1234", "--submissions", folder / "submissions.zip")
    export(folder, *asked, "--feedback", folder / "canvas.zip")
    assert zipfile.ZipFile(folder / "canvas.zip").namelist() == ["lovelaceada_71_9001_lab.zip"]
    with Gradebook(folder / "out" / "gradebook.sqlite") as book:
        book.publish("anna")
    (folder / "canvas.zip").unlink()
    _, said = export(folder, *asked, "--feedback", folder / "canvas.zip")
    assert "0 pages of feedback in the zip; 1 have not changed (--all)." in said
    assert not (folder / "canvas.zip").exists()
    export(folder, *asked, "--feedback", folder / "canvas.zip", "--all")
    assert zipfile.ZipFile(folder / "canvas.zip").namelist() == ["lovelaceada_71_9001_lab.zip"]


@pytest.mark.parametrize(
    ("options", "why"),
    [
        ((), "Missing option '--into'"),
        (("--into", "{f}/Canvas.csv", "--submissions", "{f}/x.zip"), "--submissions gives names for --feedback"),
        (("--into", "{f}/Canvas.csv", "--write", "{f}/../{n}/Canvas.csv"), "Two of the files are the same"),
        (("--into", "{f}/Canvas.csv", "--write", "{f}/x", "--feedback", "{f}/x"), "Two of the files are the same"),
        (("--into", "{f}/none.csv"), "none.csv: No such file"),
        (("--into", "{f}/Brightspace.csv", "--write", "{f}/none/x.csv"), "x.csv: No such file or directory"),
    ],
)
def test_what_cannot_be_is_refused_in_words_and_nothing_is_written(folder, options, why):
    there = sorted(path.name for path in folder.rglob("*"))
    done, said = export(folder, *(one.format(f=folder, n=folder.name) for one in options))
    assert done.exit_code == 2 and why in said
    assert sorted(path.name for path in folder.rglob("*")) == there
