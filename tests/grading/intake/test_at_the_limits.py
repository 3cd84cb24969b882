"""Each limit on what is taken in, at either side of its value: what just fits is taken, and one more is not."""

import json
import re

import pytest
from checkout import ROOT
from packings import WANTED, lay, notebook, tarred, under, work, zipped
from said_problems import within

from labcourse.answers import answers, notebooks
from labcourse.errors import GradingError
from labcourse.grading import intake
from labcourse.grading.gradebook import roster as roster_table
from labcourse.grading.gradebook.records import StudentRecord
from labcourse.grading.intake import archives, finding, owners, platforms, reading
from labcourse.grading.intake.archives import Shelf, StoredFile, Unreadable
from labcourse.grading.submission import OWNER
from labcourse.problems import Code, Problem, has

ROSTER = [StudentRecord("ada", "Ada Lovelace")]
FITS = pytest.mark.parametrize("fits", [True, False], ids=["fits", "one more"])


def limited(monkeypatch, module, name, size, fits):
    monkeypatch.setattr(module, name, size if fits else size - 1)


def read(folder, roster=ROSTER):
    submission = next(one for one in intake.find(folder, roster).submissions if one.student == "ada")
    delivered = intake.read(submission, WANTED)
    reported = within([*intake.unread_problems(delivered), *delivered.notes])
    return sorted({item.name for item in delivered.items} & set(WANTED)), reported, delivered


def whys(piece):
    """Why files are not read, and whether it is because of what was read before them."""
    return [(why.code, why.parameters.get("with_others")) for why in piece.refused.values()]


def zip_in(folder, files):
    packed = zipped(files)
    lay(folder, {"ada.zip": packed})
    return packed


@FITS
@pytest.mark.parametrize("packed", [True, False], ids=["zip", "folder"])
def test_files_and_folders(tmp_path, monkeypatch, fits, packed):
    """What programs leave behind does not count."""
    files = work("ada")
    limited(monkeypatch, archives, "MAX_ENTRIES", len(files), fits)
    files |= {".git/config": b"", ".DS_Store": b"", "__pycache__/x.pyc": b""}
    lay(tmp_path, {"ada.zip": zipped(files)}) if packed else lay(tmp_path / "ada", files)
    found, reported, _delivered = read(tmp_path)
    too_many = Problem.of(Code.TOO_MANY_FILES, most=len(work("ada")) - 1, with_others=False)
    assert (found == WANTED, too_many in reported) == (fits, not fits)


@FITS
def test_folders_count_as_files_do(tmp_path, monkeypatch, fits):
    files = under("work", work("ada"))
    limited(monkeypatch, archives, "MAX_ENTRIES", len(files) + 1, fits)
    lay(tmp_path / "ada", files)
    assert (read(tmp_path)[0] == WANTED) == fits


@FITS
@pytest.mark.parametrize("packed", [True, False], ids=["zip", "folder"])
def test_folders_within_folders(tmp_path, fits, packed):
    depth = archives.MAX_DEPTH + (not fits)
    deep = "/".join("d" * depth)
    files = work("ada") | {f"{deep}/deep.csv": b"1"}
    lay(tmp_path, {"ada.zip": zipped(files)}) if packed else lay(tmp_path / "ada", files)
    (piece,) = intake.find(tmp_path, ROSTER).submissions[0].pieces
    assert (f"{deep}/deep.csv" in piece.files) == fits
    assert [*piece.refused.values()] == [Problem.of(Code.TOO_DEEP, most=archives.MAX_DEPTH)] * (not fits)


@FITS
@pytest.mark.parametrize(("name", "levels"), [("MAX_ARCHIVE", 0), ("MAX_INNER_ARCHIVE", 1)])
def test_bytes_of_a_zip(tmp_path, monkeypatch, fits, name, levels):
    packed = zipped(work("ada"))
    limited(monkeypatch, archives, name, len(packed), fits)
    lay(tmp_path, {"ada.zip": zipped({"inner.zip": packed}) if levels else packed})
    found, reported, _delivered = read(tmp_path)
    too_large = Problem.of(Code.TOO_MANY_BYTES, most=len(packed) - 1)
    assert (found == WANTED, too_large in reported) == (fits, not fits)


@FITS
def test_bytes_of_a_zips_table_of_contents(tmp_path, monkeypatch, fits):
    packed = zip_in(tmp_path, work("ada"))
    table = int.from_bytes(packed[-10:-6], "little")  # as the zip's end says
    limited(monkeypatch, archives, "MAX_DIRECTORY", table, fits)
    with Shelf() as shelf:
        if fits:
            assert len(shelf.listing(StoredFile(tmp_path, "ada.zip", 0)).files) == len(work("ada"))
        else:
            with pytest.raises(Unreadable) as refused:
                shelf.listing(StoredFile(tmp_path, "ada.zip", 0))
            assert refused.value.problem == Problem.of(Code.LONG_TABLE_OF_CONTENTS, most=table - 1)


def test_the_table_of_contents_of_a_zip_within_a_zip_is_limited_too(tmp_path, monkeypatch):
    monkeypatch.setattr(archives, "MAX_DIRECTORY", archives._PIECE)
    inner = zipped({f"{number:09}": b"" for number in range(archives._PIECE // 55 + 1)})
    lay(tmp_path, {"ada.zip": zipped({"many.zip": inner, **work("ada")})})
    found, reported, _delivered = read(tmp_path)
    why = Problem.of(Code.LONG_TABLE_OF_CONTENTS, most=archives._PIECE)
    assert found == WANTED and Problem.of(Code.FILES_REFUSED, files=["many.zip"], why=why) in reported


@FITS
def test_zips_within_zips(tmp_path, fits):
    packed = zipped(work("ada"))
    for _level in range(finding.MAX_NESTING + (not fits)):
        packed = zipped({"inner.zip": packed})
    lay(tmp_path, {"ada.zip": packed})
    assert (read(tmp_path)[0] == WANTED) == fits


@FITS
def test_zips_side_by_side(tmp_path, fits):
    number = finding.MAX_INNER_ARCHIVES
    files = {f"{place:03}.zip": zipped({"x.csv": b"1"}) for place in range(number - 1 + (not fits))}
    files["z.zip"] = zipped(work("ada"))
    zip_in(tmp_path, files)
    assert (read(tmp_path)[0] == WANTED) == fits


@FITS
def test_bytes_of_a_course_file(tmp_path, monkeypatch, fits):
    files = work("ada")
    limited(monkeypatch, finding, "MAX_COURSE_FILE", len(files["course.json"]), fits)
    lay(tmp_path / "final", files)
    (row,) = [doubt for doubt in intake.find(tmp_path, ROSTER).doubts if doubt.about == OWNER]
    assert (row.assumed, row.alternatives) == (("", "ada") if fits else ("final", ""))


@FITS
def test_bytes_of_answers_that_were_recorded_at_home(tmp_path, monkeypatch, fits):
    claim = b'{"answers": {}}'
    monkeypatch.setattr(answers, "MAX_BYTES", len(claim) - (not fits))
    lay(tmp_path / "ada", work("ada") | {"answers.json": claim})
    _found, reported, delivered = read(tmp_path)
    taken = claim in [item.content for item in delivered.items]
    assert (taken, has(Code.FILE_UNREAD, reported, "answers.json")) == (fits, not fits)


@FITS
def test_notebooks_of_unknown_names(tmp_path, monkeypatch, fits):
    monkeypatch.setattr(reading, "MAX_STRANGERS", 3 if fits else 2)
    files = {f"{letter}.ipynb": notebook(name) for letter, name in zip("abc", WANTED, strict=True)}
    lay(tmp_path / "ada", files)
    submission = intake.find(tmp_path, ROSTER).submissions[0]
    masters = {name: {cell["id"]: cell for cell in json.loads(notebook(name))["cells"]} for name in WANTED}
    items = intake.read(submission, WANTED, masters).items
    assert len([item for item in items if item.name in WANTED]) == (3 if fits else 2)


@FITS
@pytest.mark.parametrize("name", ["MAX_SUBMISSION", "MAX_PARTS"])
def test_bytes_and_parts_of_a_student(tmp_path, monkeypatch, name, fits):
    """The notebooks that come after are named, and those before them count."""
    files = {name: notebook(name) for name in WANTED}
    sizes = {"MAX_SUBMISSION": sum(map(len, files.values())), "MAX_PARTS": sum(map(notebooks.parts_in, files.values()))}
    limited(monkeypatch, archives if name == "MAX_SUBMISSION" else notebooks, name, sizes[name], fits)
    lay(tmp_path / "ada", files)
    (submission,) = intake.find(tmp_path, ROSTER).submissions
    delivered = intake.read(submission, WANTED)
    assert [item.name for item in delivered.items] == list(WANTED if fits else WANTED[:-1])
    assert [*delivered.unread] == ([] if fits else [WANTED[-1]])


@FITS
@pytest.mark.parametrize(("compressed", "times"), [("gz", 1), ("bz2", archives.SLOW), ("xz", archives.SLOW)])
def test_what_is_unpacked_of_all_archives_counts_together(tmp_path, monkeypatch, fits, compressed, times):
    size = 10_240  # of a small tar when it is unpacked
    files = {f"{place}.tar.{compressed}": tarred({"x.csv": b"1"}, f"w:{compressed}") for place in range(3)}
    packed = sum(map(len, files.values())) + len(work("ada")["course.json"])
    monkeypatch.setattr(archives, "MAX_SUBMISSION", (3 if fits else 2) * size * times + packed)
    zip_in(tmp_path, files | work("ada"))
    (piece,) = intake.find(tmp_path, ROSTER).submissions[0].pieces
    assert whys(piece) == [(Code.TOO_MANY_BYTES, True)] * (not fits)


@FITS
def test_what_is_damaged_counts_as_what_it_says(tmp_path, monkeypatch, fits):
    """Else it could be unpacked again and again."""
    limited(monkeypatch, archives, "MAX_SUBMISSION", 10_001, fits)
    packed = bytearray(zipped({"damaged.csv": b"0123456789" * 1000, "x.csv": b"1"}))
    packed[packed.index(b"damaged.csv") + 20] ^= 0xFF
    lay(tmp_path, {"ada.zip": bytes(packed)})
    archive = StoredFile(tmp_path, "ada.zip", len(packed))
    with Shelf() as shelf:
        with pytest.raises(Unreadable) as refused:
            shelf.read(StoredFile(archive, "damaged.csv", 10_000), 10_000)
        assert refused.value.problem.code is Code.ARCHIVE_DAMAGED
        if fits:
            assert shelf.read(StoredFile(archive, "x.csv", 1), 10) == b"1"
        else:
            with pytest.raises(Unreadable) as refused:
                shelf.read(StoredFile(archive, "x.csv", 1), 10)
            assert refused.value.problem == Problem.of(Code.TOO_MANY_BYTES, most=10_000, with_others=True)


@FITS
def test_files_of_all_archives_count_together(tmp_path, monkeypatch, fits):
    limited(monkeypatch, archives, "MAX_ENTRIES", len(work("ada")) + 3, fits)
    zip_in(tmp_path, work("ada") | {"a.zip": zipped({"x.csv": b"1", "y.csv": b"1"})})
    (piece,) = intake.find(tmp_path, ROSTER).submissions[0].pieces
    assert whys(piece) == [(Code.TOO_MANY_FILES, True)] * (not fits)


@FITS
@pytest.mark.parametrize("kind", ["zip", "tar"])
def test_files_that_are_looked_through_count_also_where_they_are_skipped(tmp_path, monkeypatch, fits, kind):
    hidden = {f".git/{place}": b"" for place in range(10)}
    limited(monkeypatch, archives, "MAX_LOOKED_THROUGH", 10 if kind == "zip" else 20, fits)
    inner = {"a.zip": zipped(hidden)} if kind == "zip" else {"a.tar.gz": tarred(hidden)}
    zip_in(tmp_path, work("ada") | inner)
    (piece,) = intake.find(tmp_path, ROSTER).submissions[0].pieces
    assert whys(piece) == [(Code.TOO_MANY_FILES, True)] * (not fits)


@FITS
def test_characters_of_a_path(tmp_path, fits):
    name = "x" * (archives.MAX_PATH - 4 + (not fits)) + ".csv"
    zip_in(tmp_path, work("ada") | {name: b"1"})
    (piece,) = intake.find(tmp_path, ROSTER).submissions[0].pieces
    assert ((name in piece.files), len(piece.refused)) == (fits, int(not fits))


@FITS
@pytest.mark.parametrize("name", ["MAX_CLASS_ARCHIVE", "MAX_CLASS_ENTRIES"])
def test_a_zip_of_the_whole_class(tmp_path, monkeypatch, fits, name):
    packed = zipped(under("ada", work("ada")) | under("bob", work("bob")))
    path = lay(tmp_path, {"class.zip": packed}) / "class.zip"
    sizes = {"MAX_CLASS_ARCHIVE": len(packed), "MAX_CLASS_ENTRIES": 2 * len(work())}
    for one, size in sizes.items():
        monkeypatch.setattr(archives, one.replace("CLASS_", ""), size // 2 + size % 2)  # a student's is smaller
    limited(monkeypatch, archives, name, sizes[name], fits)
    roster = [*ROSTER, StudentRecord("bob")]
    submissions = intake.find(path, roster).submissions if fits else []
    assert [one.student for one in submissions] == ["ada", "bob"] * fits
    for submission in submissions:  # which lie in an archive that is larger than a student's may be
        assert intake.unread_problems(intake.read(submission, WANTED)) == []
    if not fits:
        assert has(Code.TOO_MANY_BYTES, within(intake.find(path, roster).ignored[:1]))


@FITS
def test_folders_around_those_of_the_students(tmp_path, fits):
    around = "/".join(f"around{level}" for level in range(finding.MAX_CLASS_DEPTH + (not fits)))
    lay(tmp_path / around / "ada", work(None))
    lay(tmp_path / around / "Ada Lovelace", work(None))
    try:
        found = [one.student for one in intake.find(tmp_path, ROSTER).submissions]
    except GradingError:
        found = []
    assert (found == ["ada"]) == fits


@FITS
def test_students_of_one_hand_in(tmp_path, fits):
    names = [f"s{number}" for number in range(owners.MOST_TOGETHER + (not fits))]
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
def test_a_list_of_times(tmp_path, monkeypatch, fits):
    """It is read as a whole, or not at all: half a line would be another time."""
    content = "name,time\nada,2026-11-20 12:00\nJ\u00fcrgen,2026-11-21 12:00".encode()
    path = tmp_path / "times.csv"
    path.write_bytes(content)
    monkeypatch.setattr(roster_table, "MAX_TABLE", len(content) - (not fits))
    if fits:
        assert len(platforms.read_times(path)[0]) == 2
        return
    for most in (len(content) - 1, content.index(b"\xc3") + 1):
        monkeypatch.setattr(roster_table, "MAX_TABLE", most)
        with pytest.raises(GradingError, match=f"{most} bytes"):
            platforms.read_times(path)


TEXT = (ROOT / "docs" / "handing_in.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("platform", sorted(platforms.DOWNLOAD_NAMES))
def test_the_examples_of_names_are_understood(platform):
    (examples,) = re.findall(rf"^\| {platform}'s .+? \| (.+) \|$", TEXT, re.MULTILINE)
    names = [example.removesuffix("/…") for example in re.findall(r"`(.+?)`", examples)]
    assert names and all(platforms.platforms_of(name) == [platform] for name in names)
