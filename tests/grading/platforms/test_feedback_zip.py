"""Feedback pages under each platform's names. Their importers' rules are written down here a second time, by hand."""

import io
import zipfile
from dataclasses import replace
from datetime import UTC, datetime

import pytest
from made_courses import OURS
from their_exports import FILES, WORKSHEET, class_of_four

from labcourse.errors import GradingError
from labcourse.grading.gradebook import Gradebook
from labcourse.grading.platforms import feedback_zip, matching, rules
from labcourse.grading.platforms.their_file import read
from labcourse.grading.settings import FeedbackSettings

WORKSHEETS = "Moodle's grading worksheet"


@pytest.fixture(scope="module")
def book(tmp_path_factory):
    with Gradebook(class_of_four(tmp_path_factory.mktemp("class"))) as opened:
        yield opened


def places(book, content, submissions=()):
    found = rules.recognised(read(content if isinstance(content, bytes) else content.encode()))
    return feedback_zip.places(found, matching.match(found, book.students()), submissions)


def moodles_importer(path, participants):
    """Whose a file in the zip is, and what it is called then, as Moodle's importer has it (since 2.x)."""
    parts = path.split("/")
    while parts:
        info = parts.pop(0).split("_", 4)
        if len(info) < 4 or not info[1].isdigit() or int(info[1]) not in participants:
            continue
        assert info[2:4] == ["assignsubmission", "file"]  # a plugin that every Moodle has
        return participants[int(info[1])], "/".join([info[4] if len(info) > 4 else "", *parts]).strip("/")
    return None


def canvass_importer(path, files):
    """Whose a file in the zip is, and what it is shown as, as Canvas's importer has it."""
    numbers = [one for one in path.rsplit("/", 1)[-1].split("_") if one.isdigit()][:2]
    return files.get(tuple(map(int, numbers)))


def test_moodle_takes_each_page_for_the_participant_whose_it_is(book):
    found = places(book, WORKSHEET)
    participants = {501: "s1001", 502: "s1002", 503: "s1003", 504: "s1004"}
    assert {student: moodles_importer(path, participants) for student, path in found.paths.items()} == {
        student: (student, "feedback.html") for student in participants.values()
    }
    assert found.paths["s1001"] == "Ada Lovelace_501_assignsubmission_file_/feedback.html"


@pytest.mark.parametrize("name", ["Ada_99_Love", "../../Ada", 'Ada: "x" <y>|?*', "_", ". .", "Ada\\Love"])
def test_no_name_leads_astray_or_out_of_the_folder(book, name):
    quoted = '"' + name.replace('"', '""') + '"'
    path = places(book, WORKSHEET.replace('"Ada Lovelace"', quoted)).paths["s1001"]
    assert moodles_importer(path, {501: "s1001", 99: "another"}) == ("s1001", "feedback.html")
    assert path.count("/") == 1 and not path.startswith(".") and not set(path) & set('\\:*?"<>|')


def test_canvas_gets_the_names_of_its_own_download_the_newest_and_what_cannot_be_is_said(book):
    handed_in = [
        "lovelaceada_71_9001_lab.zip",
        "lovelaceada_LATE_71_9005_lab-1.zip",
        "oneilbob_72_9002_report.ipynb",
        "strangerann_88_9003_lab.zip",
        "__MACOSX/readme.txt",
    ]
    found = places(book, FILES["Canvas"], handed_in)
    assert found.paths == {"s1001": "lovelaceada_LATE_71_9005_lab-1.zip"}
    assert canvass_importer(found.paths["s1001"], {(71, 9005): ("s1001", "lab-1.zip")}) == ("s1001", "lab-1.zip")
    assert "would show the page as 'oneilbob_72_9002_report.ipynb'" in found.without["s1002"]
    assert found.without["s1003"] == "nothing of theirs is in the download of submissions."


def test_brightspace_gets_the_folders_of_its_own_download_by_names_that_are_one_students_only(book):
    handed_in = [
        "index.html",
        "12345-601 - Ada Lovelace - Mar 2, 2026 105 PM/lab.zip",
        "12345-601 - Ada Lovelace - Mar 3, 2026 905 AM/lab.zip",
        "12345-602 - Bob O'Neil - Mar 2, 2026 105 PM/lab.zip",
    ]
    found = places(book, FILES["Brightspace"], handed_in)
    assert found.paths == {
        "s1001": "12345-601 - Ada Lovelace - Mar 3, 2026 905 AM/feedback.html",
        "s1002": "12345-602 - Bob O'Neil - Mar 2, 2026 105 PM/feedback.html",
    }
    assert found.without == {"s1003": "no folder of the download bears their name."}
    namesake = FILES["Brightspace"].decode().replace('Other,"Ann, or An"', "Lovelace,Ada").encode()
    found = places(book, namesake, handed_in)
    assert found.without["s1001"] == "several in the file are called 'Ada Lovelace'." and "s1001" not in found.paths


def test_a_name_in_brightspaces_folders_that_may_be_several_students_gets_no_page(book):
    """As where one section was exported, and the download is of both."""
    handed_in = [
        "12345-777 - Ada Lovelace - Mar 3, 2026 905 AM/lab.zip",
        "12345-601 - Ada Lovelace - Mar 2, 2026 105 PM/lab.zip",
        "12345-602 - Bob O'Neil - Mar 2, 2026 105 PM/lab.zip",
    ]
    found = places(book, FILES["Brightspace"], handed_in)
    assert list(found.paths) == ["s1002"]
    assert found.without["s1001"] == (
        "folders of several numbers bear the name 'Ada Lovelace', and may be of several students: 12345-601, 12345-777."
    )


@pytest.mark.parametrize(
    ("platform", "why"),
    [
        ("Moodle", "grading worksheet"),
        ("Blackboard", "Blackboard"),
        ("Canvas", "--submissions"),
        ("Brightspace", "--submissions"),
    ],
)
def test_what_a_platform_does_not_take_is_refused_in_words(book, platform, why):
    with pytest.raises(GradingError, match=why):
        places(book, FILES[platform])


def test_the_pages_are_those_of_the_report_and_a_zip_where_a_zip_was(book):
    pages = feedback_zip.pages(book, OURS, ["s1001", "s1002", "s1004"])
    assert (
        set(pages) == {"s1001", "s1002"} and b"Half of it." in pages["s1001"] and b"Half of it." not in pages["s1002"]
    )
    where = feedback_zip.Places({"s1001": "a_71_1_lab.zip", "s1002": "b/feedback.html", "s1004": "c"}, {"x": "why."})
    data, told = feedback_zip.packed(where, pages)
    assert feedback_zip.packed(where, pages)[0] == data
    assert told == [
        "2 pages of feedback in the zip.",
        "x: no page; why.",
        "s1004: no page; nothing of theirs is graded.",
    ]
    archive = zipfile.ZipFile(io.BytesIO(data))
    assert archive.namelist() == ["a_71_1_lab.zip", "b/feedback.html"] and archive.testzip() is None
    assert archive.read("b/feedback.html") == pages["s1002"]
    inner = zipfile.ZipFile(io.BytesIO(archive.read("a_71_1_lab.zip")))
    assert inner.namelist() == ["feedback.html"] and inner.read("feedback.html") == pages["s1001"]


def test_there_are_no_pages_before_feedback_opens(book):
    later = replace(OURS.settings, feedback=FeedbackSettings(opens=datetime(2999, 1, 1, tzinfo=UTC)))
    with pytest.raises(GradingError, match="2999-01-01"):
        feedback_zip.pages(book, replace(OURS, settings=later), ["s1001"])


def test_a_download_that_is_no_zip_is_refused(tmp_path):
    (tmp_path / "x.zip").write_bytes(b"no")
    with pytest.raises(GradingError, match=r"x\.zip"):
        feedback_zip.submissions_in(tmp_path / "x.zip")
