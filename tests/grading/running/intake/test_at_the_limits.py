"""Each limit on what is taken in, at either side of its value: what just fits is taken, and one more is not."""

import json
import re
from types import SimpleNamespace

import pytest
from checkout import ROOT
from packings import WANTED, lay, notebook, under, work, zipped

from labcourse.answers import answers, notebooks, own_files, report_files
from labcourse.errors import GradingError
from labcourse.grading.gradebook.records import StudentRecord
from labcourse.grading.running import intake
from labcourse.grading.running.intake import labels, limits, reading, stores, times
from labcourse.grading.running.intake.stores import Unreadable, Where

ROSTER = [StudentRecord("ada", "Ada Lovelace")]
FITS = pytest.mark.parametrize("fits", [True, False], ids=["fits", "one more"])


def limited(monkeypatch, name, size, fits):
    monkeypatch.setattr(limits, name, size if fits else size - 1)


def read(folder, roster=ROSTER):
    submission = next(one for one in intake.find(folder, roster).submissions if one.student == "ada")
    delivered = intake.read(submission, WANTED)
    told = [*intake.problems(delivered), *intake.notes(delivered)]
    return sorted({name for one in delivered for name in one.notebooks}), " ".join(told), delivered


def zip_in(folder, files, name="ada.zip"):
    packed = zipped(files)
    lay(folder, {name: packed})
    return packed


@FITS
@pytest.mark.parametrize("packed", [True, False], ids=["zip", "folder"])
def test_files_and_folders(tmp_path, monkeypatch, fits, packed):
    files = work("ada")
    limited(monkeypatch, "MAX_ENTRIES", len(files), fits)
    lay(tmp_path, {"ada.zip": zipped(files)}) if packed else lay(tmp_path / "ada", files)
    found, told, _delivered = read(tmp_path)
    assert (found == WANTED, "3 files" in told) == (fits, not fits)


@FITS
def test_folders_count_as_files_do(tmp_path, monkeypatch, fits):
    files = under("work", work("ada"))
    limited(monkeypatch, "MAX_ENTRIES", len(files) + 1, fits)
    lay(tmp_path / "ada", files)
    assert (read(tmp_path)[0] == WANTED) == fits


@FITS
@pytest.mark.parametrize("packed", [True, False], ids=["zip", "folder"])
def test_folders_within_folders(tmp_path, fits, packed):
    depth = limits.MAX_DEPTH + (not fits)
    deep = "/".join("d" * depth)
    files = work("ada") | {f"{deep}/deep.csv": b"1"}
    lay(tmp_path, {"ada.zip": zipped(files)}) if packed else lay(tmp_path / "ada", files)
    (piece,) = intake.find(tmp_path, ROSTER).submissions[0].pieces
    assert (f"{deep}/deep.csv" in piece.files) == fits
    assert [f"{limits.MAX_DEPTH} folders" in told for told in piece.others.values()] == ([] if fits else [True])


@FITS
@pytest.mark.parametrize(("name", "levels"), [("MAX_ARCHIVE", 0), ("MAX_INNER_ARCHIVE", 1)])
def test_bytes_of_a_zip(tmp_path, monkeypatch, fits, name, levels):
    packed = zipped(work("ada"))
    limited(monkeypatch, name, len(packed), fits)
    lay(tmp_path, {"ada.zip": zipped({"inner.zip": packed}) if levels else packed})
    found, told, _delivered = read(tmp_path)
    assert (found == WANTED, f"{len(packed) - 1} bytes" in told or "zip has more" in told) == (fits, not fits)


@FITS
def test_bytes_of_a_zips_table_of_contents(tmp_path, monkeypatch, fits):
    packed = zip_in(tmp_path, work("ada"))
    table = int.from_bytes(packed[-10:-6], "little")  # as the zip's end says
    limited(monkeypatch, "MAX_DIRECTORY", table, fits)
    where = Where(tmp_path / "ada.zip")
    if fits:
        with stores.opened(where) as store:
            assert len(store.listing(10).files) == len(work("ada"))
        return
    with pytest.raises(Unreadable, match=f"{table - 1} bytes"), stores.opened(where):
        pass


@FITS
def test_zips_within_zips(tmp_path, fits):
    packed = zipped(work("ada"))
    for _level in range(limits.MAX_NESTING + (not fits)):
        packed = zipped({"inner.zip": packed})
    lay(tmp_path, {"ada.zip": packed})
    assert (read(tmp_path)[0] == WANTED) == fits


@FITS
def test_zips_side_by_side(tmp_path, fits):
    number = limits.MAX_INNER_ARCHIVES
    files = {f"{place:03}.zip": zipped({"x.csv": b"1"}) for place in range(number - 1 + (not fits))}
    files["z.zip"] = zipped(work("ada"))
    zip_in(tmp_path, files)
    assert (read(tmp_path)[0] == WANTED) == fits


@FITS
def test_bytes_of_a_course_file(tmp_path, monkeypatch, fits):
    files = work("ada")
    limited(monkeypatch, "MAX_COURSE_FILE", len(files["course.json"]), fits)
    lay(tmp_path / "final", files)
    if fits:
        assert read(tmp_path)[0] == WANTED  # whose it is, stands there alone
    else:
        assert [one.student for one in intake.find(tmp_path).submissions] == ["final"]


@FITS
def test_bytes_of_answers_that_were_recorded_at_home(tmp_path, monkeypatch, fits):
    claim = b'{"answers": {}}'
    monkeypatch.setattr(answers, "MAX_BYTES", len(claim) - (not fits))
    lay(tmp_path / "ada", work("ada") | {"answers.json": claim})
    _found, told, (delivered,) = read(tmp_path)
    assert (delivered.claim == claim, "answers.json" in told) == (fits, not fits)


@FITS
def test_notebooks_of_unknown_names(tmp_path, monkeypatch, fits):
    monkeypatch.setattr(limits, "MAX_STRANGERS", 3 if fits else 2)
    files = {f"{letter}.ipynb": notebook(name) for letter, name in zip("abc", WANTED, strict=True)}
    lay(tmp_path / "ada", files)
    submission = intake.find(tmp_path, ROSTER).submissions[0]
    masters = {name: {cell["id"]: cell for cell in json.loads(notebook(name))["cells"]} for name in WANTED}
    (delivered,) = intake.read(submission, WANTED, masters)
    assert len(delivered.notebooks) == (3 if fits else 2)


@FITS
@pytest.mark.parametrize("name", ["MAX_SUBMISSION", "MAX_SECONDS"])
def test_bytes_and_seconds_of_a_student(tmp_path, monkeypatch, name, fits):
    """The notebooks that come after are named, and those before them count."""
    files = {name: notebook(name) for name in WANTED}
    sizes = {"MAX_SUBMISSION": sum(map(len, files.values())), "MAX_SECONDS": len(WANTED)}
    limited(monkeypatch, name, sizes[name], fits)
    seconds = iter(range(-1, 100))  # a second for each file; the first look begins
    monkeypatch.setattr(reading, "time", SimpleNamespace(monotonic=lambda: next(seconds)))
    lay(tmp_path / "ada", files)
    (delivered,) = intake.read(intake.find(tmp_path, ROSTER).submissions[0], WANTED)
    assert [*delivered.notebooks] == list(WANTED if fits else WANTED[:-1])
    assert [*delivered.unread] == ([] if fits else [WANTED[-1]])


def class_zip(folder):
    """A zip of two students' folders, given as it is."""
    packed = zipped(under("ada", work("ada")) | under("bob", work("bob")))
    lay(folder, {"class.zip": packed})
    return folder / "class.zip", packed


@FITS
@pytest.mark.parametrize("name", ["MAX_CLASS_ARCHIVE", "MAX_CLASS_ENTRIES", "MAX_CLASS_DIRECTORY"])
def test_a_zip_of_the_whole_class(tmp_path, monkeypatch, fits, name):
    path, packed = class_zip(tmp_path)
    sizes = {
        "MAX_CLASS_ARCHIVE": len(packed),
        "MAX_CLASS_ENTRIES": 2 * len(work()),
        "MAX_CLASS_DIRECTORY": int.from_bytes(packed[-10:-6], "little"),
    }
    for one, size in sizes.items():
        monkeypatch.setattr(limits, one.replace("CLASS_", ""), size // 2 + size % 2)  # a student's is smaller
    limited(monkeypatch, name, sizes[name], fits)
    if fits:
        roster = [*ROSTER, StudentRecord("bob")]
        assert [one.student for one in intake.find(path, roster).submissions] == ["ada", "bob"]
    else:
        with pytest.raises(Unreadable, match="more than"):
            _listing(path)


def _listing(path):
    with stores.opened(Where(path), whole_class=True) as store:
        return store.listing(limits.MAX_CLASS_ENTRIES)


@FITS
def test_folders_around_those_of_the_students(tmp_path, fits):
    around = "/".join(f"around{level}" for level in range(limits.MAX_CLASS_DEPTH + (not fits)))
    lay(tmp_path / around / "ada", work(None))
    lay(tmp_path / around / "Ada Lovelace", work(None))
    try:
        found = [one.student for one in intake.find(tmp_path, ROSTER).submissions]
    except GradingError:
        found = []
    assert (found == ["ada"]) == fits


@FITS
def test_students_of_one_hand_in(tmp_path, fits):
    names = [f"s{number}" for number in range(4 + (not fits))]
    roster = [StudentRecord(name) for name in names]
    lay(tmp_path / "+".join(names), work(None))
    try:
        found = [one.student for one in intake.find(tmp_path, roster).submissions]
    except GradingError:
        found = []
    assert (found == names) == fits and (not fits or len(found) == 4)


@FITS
def test_partners_whom_a_course_file_names(tmp_path, fits):
    names = [f"s{number}" for number in range(5 if fits else 6)]
    roster = [StudentRecord(name) for name in names]
    lay(tmp_path / "s0", work("s0", **{"with": names[1:]}))
    found = [one.student for one in intake.find(tmp_path, roster).submissions]
    assert found == names[:5]


@FITS
def test_a_name_that_a_platform_writes(fits):
    name = "Ada Lovelace_7_assignsubmission_file_"
    long = "x" * (labels._LONGEST - len(name) + (not fits)) + name
    assert (labels.read(long) is not None) == fits
    again = "x" * (labels._LONGEST - len(" (2)") + (not fits)) + " (2)"
    assert (labels.again(again) is not None) == fits


@FITS
def test_a_list_of_times(tmp_path, monkeypatch, fits):
    """It is read as a whole, or not at all: half a line would be another time."""
    content = "name,time\nada,2026-11-20 12:00\nJ\u00fcrgen,2026-11-21 12:00".encode()
    path = tmp_path / "times.csv"
    path.write_bytes(content)
    monkeypatch.setattr(times, "_MAX_BYTES", len(content) - (not fits))
    if fits:
        assert len(times.read(path)[0]) == 2
        return
    for most in (len(content) - 1, content.index(b"\xc3") + 1):
        monkeypatch.setattr(times, "_MAX_BYTES", most)
        with pytest.raises(GradingError, match=f"{most} bytes"):
            times.read(path)


@FITS
def test_what_is_read_of_a_place_has_at_most_so_many_bytes(tmp_path, fits):
    lay(tmp_path, {"a.csv": b"12345"})
    lay(tmp_path, {"a.zip": zipped({"a.csv": b"12345"})})
    for where in (Where(tmp_path), Where(tmp_path / "a.zip")):
        with stores.opened(where) as store:
            store.listing(10)
            if fits:
                assert store.read("a.csv", 5) == b"12345"
            else:
                with pytest.raises(Unreadable, match="4 bytes"):
                    store.read("a.csv", 4)


def test_a_folder_or_a_file_that_is_gone_or_another_thing_is_told(tmp_path):
    folder = lay(tmp_path / "ada", work("ada"))
    store = stores.FolderStore(folder)
    assert len(store.listing(10).files) == len(work("ada"))
    for name in ("gone.csv", "course.json/x"):
        with pytest.raises(Unreadable, match=r"No such file|Not a directory"):
            store.read(name, 10)
    for gone in (stores.FolderStore(tmp_path / "nowhere"), stores.FolderStore(folder / "course.json")):
        with pytest.raises(Unreadable, match=r"No such file|Not a directory"):
            gone.listing(10)
    with pytest.raises(Unreadable, match="No such file"), stores.opened(Where(tmp_path / "nowhere.zip")):
        pass


TEXT = (ROOT / "docs" / "handing_in.md").read_text(encoding="utf-8")
MB = 1_000_000
DOCUMENTED = {
    "a student's zip": [limits.MAX_ARCHIVE / MB],
    "a zip within a zip": [limits.MAX_INNER_ARCHIVE / MB],
    "zips within one hand-in": [limits.MAX_INNER_ARCHIVES, limits.MAX_NESTING],
    "files and folders of a hand-in": [limits.MAX_ENTRIES, limits.MAX_DEPTH],
    "all that is read of one student": [limits.MAX_SUBMISSION / MB, limits.MAX_SECONDS],
    "a zip of the whole class": [limits.MAX_CLASS_ARCHIVE / MB, limits.MAX_CLASS_ENTRIES],
    "a notebook with its outputs, which are dropped": [notebooks.MAX_FILE / MB],
    "a notebook without its outputs and pictures": [notebooks.MAX_NOTEBOOK / MB],
    "pictures pasted into one notebook's text cells": [notebooks.MAX_PICTURES / MB],
    "a report as PDF": [report_files.MAX_BYTES / MB],
    "own files": [own_files.MAX_FILES, own_files.MAX_FILE / MB, own_files.MAX_TOTAL / MB],
    "`answers.json`": [answers.MAX_BYTES / MB],
}
ROWS = dict(re.findall(r"^\| (.+?) \| (.+?) \|$", TEXT.partition("## How much")[2], re.MULTILINE))


def test_each_limit_is_the_one_that_holds_and_no_other_is_stated():
    assert {what: [float(number) for number in re.findall(r"\d+", said)] for what, said in ROWS.items()} == DOCUMENTED


@pytest.mark.parametrize("platform", [labels.MOODLE, labels.CANVAS, labels.BLACKBOARD, labels.BRIGHTSPACE])
def test_the_examples_of_names_are_understood(platform):
    (examples,) = re.findall(rf"^\| {platform}'s .+? \| (.+) \|$", TEXT, re.MULTILINE)
    names = [example.removesuffix("/…") for example in re.findall(r"`(.+?)`", examples)]
    found = [labels.read(name) for name in names]
    assert found and all(label is not None and label.platform == platform for label in found)
