"""Submissions are read as untrusted input: what is taken, what is noted, what is refused."""

import gzip
import io
import json
import os
import random
import struct
import tarfile
from datetime import datetime

import pytest
from hypothesis import given
from hypothesis import strategies as st
from packings import NOTEBOOKS, WANTED, lay, notebook, renamed, tarred, under, work, zipped
from said_problems import codes, names, within

from labcourse.answers import notebooks, own_files
from labcourse.answers.catalogue import Catalogue
from labcourse.files import shown
from labcourse.grading import intake
from labcourse.grading.gradebook.records import StudentRecord
from labcourse.grading.intake import archives
from labcourse.problems import Code, Problem, has
from labcourse.run import student_folder, submit

A, B, C = WANTED


class Read:
    def __init__(self, root, masters=None, packages=("rotflex",)):
        self.found = intake.find(root)
        (submission,) = self.found.submissions
        self.delivered = self.hand_in = intake.read(submission, WANTED, masters, packages=packages)
        self.problems, self.notes = intake.unread_problems(submission), submission.notes
        self.missing = intake.choose_newest(submission, submission.items, WANTED)

    @property
    def notebooks(self):
        return list(self.hand_in.notebooks)

    def first(self, name):
        return self.hand_in.notebooks[name][0].source


def as_folder(root, files):
    lay(root / "ada", files)


def as_zip(root, files):
    lay(root, {"ada.zip": zipped(files)})


def as_zip_in_a_folder(root, files):
    lay(root / "ada", {"x.zip": zipped(under("work", files))})


def as_tar(root, files):
    lay(root, {"ada.tar.gz": tarred(files)})


@pytest.fixture(params=[as_folder, as_zip, as_zip_in_a_folder, as_tar])
def taken(request, tmp_path):
    def take(files, **more):
        request.param(tmp_path, files)
        return Read(tmp_path, **more)

    return take


def test_notebooks_own_files_the_claim_and_the_course_file_are_taken(taken):
    own = {"helpers.py": b"G = 2\n", "data/run 1.csv": b"1,2\n", "scratch.ipynb": b"{}"}
    result = taken(work(release="r7") | {"answers.json": b'{"a": 1}'} | own)
    assert result.notebooks == WANTED and result.first(A) == "x = 1"
    assert result.hand_in.files == own
    assert result.hand_in.answers_at_home == b'{"a": 1}'
    assert result.hand_in.course == {"student": "ada", "release": "r7"}
    assert (result.problems, result.notes, result.missing) == ([], [], [])


@pytest.mark.parametrize("partners", [[], ["bob"]])
def test_what_rotflex_submit_packs_is_taken_just_as_it_is_at_home(tmp_path, partners):
    own = {"helpers.py": b"G = 2\n", "data/m\u00fc.csv": b"1", "receipt.json": b"of an earlier zip", "random.py": b""}
    home = lay(tmp_path / "home" / "work", work("ada", release="r7") | own | {"answers.json": b"{}"})
    masters = {name: {"cells": []} for name in WANTED}
    submitted = submit.submit(home, masters, Catalogue([]), partners=partners, out=tmp_path / "in")
    submitted.receipts.unlink()
    found = intake.find(tmp_path / "in")
    assert [one.student for one in found.submissions] == ["ada", *partners] and found.ignored == []
    delivered = intake.read(found.submissions[0], WANTED)
    intake.choose_newest(delivered, delivered.items, WANTED)
    at_home = student_folder.read(home, WANTED).hand_in
    assert delivered.files == at_home.files == {"helpers.py": b"G = 2\n", "data/m\u00fc.csv": b"1"}
    assert (delivered.notebooks, delivered.answers_at_home) == (at_home.notebooks, at_home.claim)
    assert delivered.course == {**at_home.course, **({"with": partners} if partners else {})}
    assert intake.unread_problems(delivered) == delivered.notes == []


def test_a_whole_release_handed_in_counts_by_the_folder_of_its_notebooks(taken):
    others = {"README.md": b"", "LICENSE": b"", "rotflex/course/lab.py": b""}
    result = taken(others | under("notebooks", work() | {"h.py": b""}))
    assert result.notebooks == WANTED and list(result.hand_in.files) == ["h.py"]
    (note,) = result.notes
    assert note.code is Code.OUTSIDE_THE_FOLDER
    assert [name.removeprefix("work/") for name in note.parameters["files"]] == sorted(others)


def test_notebooks_count_where_most_lie_and_the_others_are_reported(taken):
    result = taken(
        {
            f"old/{A}": notebook(A, "old = 1"),
            **under("work/now", work()),
            f".ipynb_checkpoints/{A}": notebook(A, "hidden = 1"),
            f"__MACOSX/._{A}": b"junk",
        }
    )
    assert result.first(A) == "x = 1" and result.problems == []
    (note,) = result.notes
    (other,) = note.parameters["files"]
    assert (note.code, note.where) == (Code.ONE_OF_SEVERAL, A) and other in (f"old/{A}", f"work/old/{A}")


@pytest.mark.parametrize(
    "name",
    [
        "{stem} (1).ipynb",
        "{stem}-1.ipynb",
        "{stem}-Copy1.ipynb",
        "{stem}_copy.ipynb",
        "{stem} - Copy (2).ipynb",
        "Copy of {stem}.ipynb",
        "{stem}.ipynb.txt",
        "{stem}.ipynb.json",
        "{stem}_final_version2.ipynb",
        "ada_{stem}.ipynb",
        "lovelaceada_LATE_12345_678901_{stem}-2.ipynb",
        "{spaced}.IPYNB",
    ],
)
def test_a_notebook_that_was_renamed_on_the_way_is_found(taken, name):
    stem = A.removesuffix(".ipynb")
    files = work(names=[B, C])
    given = name.format(stem=stem, spaced=stem.replace("_", " "))
    result = taken(files | {given: notebook(A, "mine = 1")})
    assert result.first(A) == "mine = 1" and result.problems == []
    (note,) = result.notes
    assert (note.code, note.where) == (Code.TAKEN_BY_NAME, A)
    assert note.parameters["file"].rpartition("/")[2] == given


def test_a_copy_does_not_count_beside_the_notebook_itself_and_of_copies_the_last_does(taken):
    stem = B.removesuffix(".ipynb")
    result = taken(
        {A: notebook(A, "itself = 1")}
        | renamed({A: notebook(A, "copy = 1")}, "-Copy1")
        | {f"{stem} (2).ipynb": notebook(B, "second = 1"), f"{stem} (10).ipynb": notebook(B, "tenth = 1")}
    )
    assert (result.first(A), result.first(B)) == ("itself = 1", "tenth = 1")
    assert codes(result.notes) == [(Code.ONE_OF_SEVERAL, A), (Code.ONE_OF_SEVERAL, B)]
    assert result.hand_in.files == {}


def test_a_notebook_renamed_beyond_recognition_is_recognised_by_its_cells(taken):
    files = work(names=[A]) | {"my answers.ipynb": notebook(B, "mine = 1"), "own.ipynb": b'{"cells": []}'}
    masters = {
        name: {one: {"id": one, "cell_type": "code", "source": ""} for one in ids} for name, ids in NOTEBOOKS.items()
    }
    result = taken(files, masters=masters)
    assert result.first(B) == "mine = 1" and list(result.hand_in.files) == ["own.ipynb"]
    assert codes(result.notes) == [(Code.TAKEN_BY_CELLS, B), (Code.NOT_RECOGNISED, "")]
    assert codes(result.missing) == [(Code.NOT_HANDED_IN, C)]
    known, unknown = result.notes
    assert known.parameters["file"].endswith("my answers.ipynb") and "own.ipynb" in names([unknown])


MASTERS = {name: {cell["id"]: cell for cell in json.loads(notebook(name, "# your turn"))["cells"]} for name in WANTED}


def with_new_ids(name, **written):
    """Return a notebook with new cell ids and without metadata, as some editors save it."""
    cells = json.loads(notebook(name))["cells"]
    cells[0]["source"] = "x = 1"
    kept = [{**cell, "id": f"new-{place}", "metadata": {}} for place, cell in enumerate(cells)]
    more = [{**kept[1], "id": f"more-{place}", "source": f"pass  # {place}"} for place in range(2)]
    return json.dumps({"nbformat": 4, "nbformat_minor": 5, "metadata": {}, "cells": [*kept, *more]} | written).encode()


def test_a_notebook_of_another_name_and_new_ids_is_known_by_the_texts_of_its_cells(taken, monkeypatch):
    monkeypatch.setattr(intake.reading, "_FEWEST_CELLS", 2)
    few = {name: content for name, content in work().items() if name != WANTED[1]}
    result = taken(few | {"rotflex-nb.ipynb": with_new_ids(WANTED[1])}, masters=MASTERS)
    assert result.notebooks == WANTED and result.problems == []


def test_a_notebook_that_is_not_recognised_is_named_where_one_is_missing(taken):
    stranger = {"notes.ipynb": with_new_ids(WANTED[1], cells=[])}
    few = {name: content for name, content in work().items() if name != WANTED[1]}
    (note,) = taken(few | stranger, masters=MASTERS).notes
    assert note.code is Code.NOT_RECOGNISED and "notes.ipynb" in names([note])


def test_a_notebook_of_ones_own_beside_all_of_the_course_is_not_named(taken):
    assert taken(work() | {"notes.ipynb": with_new_ids(WANTED[1], cells=[])}, masters=MASTERS).notes == []


def test_a_notebook_with_outputs_of_many_megabytes_is_taken_without_them(taken):
    large = json.loads(notebook(A, "x = 1"))
    large["cells"][0]["outputs"] = [{"data": {"image/png": "A" * 6_000_000, "text": ['"[{\\"\u00fc']}}]
    large["metadata"] = {"widgets": {"state": [{"a": "]"}] * 1000}}
    files = work(names=[B, C]) | {A: json.dumps(large, ensure_ascii=False).encode()}
    result = taken(files)
    assert result.first(A) == "x = 1" and result.problems == []
    assert all(len(item.content) < 10_000 for item in result.delivered.items)


@pytest.mark.parametrize("depth", [1, 2, 3])
def test_what_cannot_be_compressed_is_read_from_a_zip_whatever_its_size(tmp_path, depth, monkeypatch):
    monkeypatch.setattr(archives, "MAX_DIRECTORY", 2_000_000)
    large = json.loads(notebook(A, "x = 1"))
    large["cells"][0]["outputs"] = [
        {"data": {"image/png": random.Random(1).randbytes(2 * archives.MAX_DIRECTORY).hex()}}
    ]
    noise = random.Random(2).randbytes(3 * 10**6)
    packed = zipped(work(names=[B, C]) | {A: json.dumps(large).encode(), "noise.bin": noise})
    for _ in range(depth - 1):
        packed = zipped({"inner.zip": packed})
    lay(tmp_path, {"ada.zip": packed})
    result = Read(tmp_path)
    assert result.notebooks == WANTED and result.problems == []
    assert result.hand_in.files == {"noise.bin": noise}


NO_NOTEBOOKS = ["{", "[]", "null", '{"cells": 3}', "", "[" * 100_000, '{"worksheets": 3}', f'{{"n": {"9" * 5000}}}']


@pytest.mark.parametrize("content", NO_NOTEBOOKS)
def test_what_is_no_notebook_is_a_problem_and_the_others_are_taken(taken, content):
    result = taken({A: content.encode(), B: notebook(B)})
    assert result.notebooks == [B]
    assert codes(result.problems) == [(Code.NOTEBOOK_UNREAD, A)]
    assert result.problems[0].parameters["why"].code in (Code.NOT_JSON, Code.NO_CELLS)


@pytest.mark.parametrize("files", [{"essay.txt": b"I think that"}, {"own.ipynb": notebook(A)}])
def test_a_submission_without_any_notebook_of_the_course_is_a_problem(taken, files):
    (problem,) = taken(files).problems
    assert problem.code is Code.NO_NOTEBOOK and problem.parameters["files"] in ([*files], ["x.zip"])


def test_a_notebook_that_cannot_be_read_leaves_the_one_before_it(tmp_path):
    lay(tmp_path, {"ada.zip": zipped(work(answer="old = 1")), "ada (1).zip": zipped({A: b"{", B: notebook(B)})})
    result = Read(tmp_path)
    assert result.first(A) == "old = 1"
    assert codes(result.problems) == [(Code.OLDER_NOTEBOOK_COUNTS, A)]


def test_a_notebook_that_could_not_be_read_and_was_handed_in_again_is_no_problem(tmp_path):
    lay(tmp_path, {"ada.zip": zipped({A: b"{"}), "ada (1).zip": zipped(work())})
    assert Read(tmp_path).problems == []


def test_a_zip_that_cannot_be_read_is_reported_and_no_longer_a_problem_once_it_was_handed_in_again(tmp_path):
    lay(tmp_path, {"ada.zip": b"no zip"})
    ada = intake.read(intake.find(tmp_path).submissions[0], WANTED)
    assert codes(intake.unread_problems(ada)) == [(Code.SUBMISSION_UNREAD, "ada.zip")]
    lay(tmp_path, {"ada (1).zip": zipped(work(), datetime(2107, 1, 1))})
    ada = intake.read(intake.find(tmp_path).submissions[0], WANTED)
    assert intake.unread_problems(ada) == [] and codes(ada.notes[:1]) == [(Code.SUBMISSION_UNREAD, "ada.zip")]


@pytest.mark.parametrize("name", ["Random.py", "springlab.py"])
def test_a_file_that_would_come_before_a_module_does_not_come_along(taken, name):
    """Which names these are: tests/labcourse/run/test_own_files.py."""
    result = taken(work() | {name: b"", "mine.py": b""}, packages=["springlab"])
    assert list(result.hand_in.files) == ["mine.py"]
    assert codes(result.notes) == [(Code.OWN_FILE_REFUSED, name)]
    assert result.notes[0].parameters["why"].code is Code.HIDES_MODULE


def test_own_files_may_be_shorter_than_the_zip_says_but_never_longer(tmp_path, monkeypatch):
    monkeypatch.setattr(own_files, "MAX_FILE", 100)
    packed = zipped(work() | {"a.csv": b" " * 200})
    said = struct.pack("<L", 200)
    place = packed.rindex(said)
    lay(tmp_path, {"ada.zip": packed[:place] + struct.pack("<L", 50) + packed[place + 4 :]})
    result = Read(tmp_path)
    assert "a.csv" not in result.hand_in.files or len(result.hand_in.files["a.csv"]) <= 100


def test_links_and_pipes_in_a_folder_are_not_followed(tmp_path):
    secret = lay(tmp_path / "secret", work(None))
    folder = lay(tmp_path / "in" / "ada", work(names=[B]))
    (folder / A).symlink_to(secret / A)
    (folder / "linked").symlink_to(secret, target_is_directory=True)
    (folder / "again").symlink_to(folder, target_is_directory=True)
    (folder / "pipes").mkdir()
    os.mkfifo(folder / "pipes" / A)
    result = Read(tmp_path / "in")
    assert result.notebooks == [B] and result.hand_in.files == {}
    (note,) = result.notes
    assert (note.code, note.parameters["why"]) == (Code.FILES_REFUSED, Problem.of(Code.NOT_A_FILE))


def test_a_link_put_in_a_files_place_between_finding_and_reading_is_not_followed(tmp_path):
    secret = lay(tmp_path / "secret", work(None, "secret = 1"))
    folder = lay(tmp_path / "in" / "ada", work(None))
    found = intake.find(tmp_path / "in")
    (folder / A).unlink()
    (folder / A).symlink_to(secret / A)
    delivered = intake.read(found.submissions[0], WANTED)
    assert A not in {item.name for item in delivered.items} and A in delivered.unread


def test_names_in_a_zip_that_point_elsewhere_write_nothing_anywhere(tmp_path):
    as_zip(tmp_path, {f"../../evil/{A}": notebook(A), f"/etc/{B}": notebook(B), "\\..\\x.csv": b""})
    before = set(tmp_path.rglob("*"))
    result = Read(tmp_path)
    assert set(tmp_path.rglob("*")) == before
    assert result.notebooks == [B] and result.hand_in.files == {}
    assert Problem.of(Code.LEADS_OUTSIDE) in within(result.notes)


def test_a_zip_that_swells_is_read_no_further_than_the_limit(tmp_path, monkeypatch):
    monkeypatch.setattr(notebooks, "MAX_FILE", 1_000_000)
    as_zip(tmp_path, {A: b"[" + b" " * 20_000_000, B: notebook(B)})
    assert (tmp_path / "ada.zip").stat().st_size < 200_000
    result = Read(tmp_path)
    why = Problem.of(Code.NOTEBOOK_TOO_LARGE, most=1_000_000)
    assert result.notebooks == [B] and result.problems == [Problem.of(Code.NOTEBOOK_UNREAD, A, why=why)]


@pytest.mark.parametrize("content", [b"", b"PK", b"this is no zip at all", b"PK\x05\x06" + b"\xff" * 18])
def test_what_is_no_zip_is_a_problem(tmp_path, content):
    (tmp_path / "ada.zip").write_bytes(content)
    result = Read(tmp_path)
    assert result.notebooks == [] and codes(result.problems[:1]) == [(Code.SUBMISSION_UNREAD, "ada.zip")]


@pytest.mark.parametrize(
    ("place", "byte", "why"),
    [(6, 1, Code.ENCRYPTED), (8, 12, Code.UNUSUAL_COMPRESSION), (14, 0, Code.ARCHIVE_DAMAGED)],
)
def test_a_zip_that_says_something_else_of_a_file_and_one_of_another_make_are_problems(tmp_path, place, byte, why):
    packed = bytearray(zipped({A: notebook(A)}))
    for header, further in ((b"PK\3\4", 0), (b"PK\1\2", 2)):  # what stands before the file, and in the zip's table
        packed[packed.index(header) + place + further] = byte
    lay(tmp_path / "in", {"ada.zip": bytes(packed), "bob/work.7z": b"7z", "eve.rar": b"rar"})
    found = intake.find(tmp_path / "in")
    assert [one.student for one in found.submissions] == ["ada", "bob", "eve"]
    reported = {one.student: intake.unread_problems(intake.read(one, WANTED)) for one in found.submissions}
    assert reported["ada"][0].where == A and has(why, within(reported["ada"][:1]))
    assert Problem.of(Code.PACKED_ARCHIVES, files=["work.7z"]) in within(reported["bob"][:1])
    assert Problem.of(Code.PACKED_OTHERWISE) in within(reported["eve"][:1])


def test_an_own_file_that_cannot_be_read_is_named_and_the_others_are_taken(tmp_path):
    packed = bytearray(zipped(work() | {"lost.csv": b"1,2\n", "kept.csv": b"3,4\n"}))
    packed[packed.rindex(b"PK\1\2", 0, packed.rindex(b"lost.csv")) + 8] |= 1  # encrypted, as its table of contents says
    lay(tmp_path, {"ada.zip": bytes(packed)})
    result = Read(tmp_path)
    assert result.hand_in.files == {"kept.csv": b"3,4\n"} and result.notebooks == WANTED
    assert codes(result.notes) == [(Code.OWN_FILE_REFUSED, "lost.csv")]


@given(data=st.data())
def test_a_damaged_zip_never_raises(data, tmp_path_factory):
    root = tmp_path_factory.mktemp("damaged")
    content = bytearray(zipped(work() | {"x.csv": b"1"}))
    for place in data.draw(st.lists(st.integers(0, len(content) - 1), min_size=1, max_size=8)):
        content[place] = data.draw(st.integers(0, 255))
    (root / "ada.zip").write_bytes(content)
    assert set(Read(root).notebooks) <= set(WANTED)


parts = st.text(st.sampled_from("ab.~/\\ :\u00fc\u202e\x07é*"), min_size=1, max_size=6)
path_names = st.sampled_from(["x.csv", "a/x.csv", "a", "h.py", "random.py", "so.so", ".git/x", A, f"a/{A}"]) | parts


@given(files=st.dictionaries(path_names, st.just(b"1"), max_size=6))
def test_nothing_leads_outside_and_everything_is_taken_or_reported(files, tmp_path_factory):
    """Of what is in a zip; but what programs leave behind stays behind without a word."""
    root = tmp_path_factory.mktemp("any")
    lay(root, {"ada.zip": zipped(work() | files)})
    result = Read(root)
    taken = set(result.hand_in.files)
    for path in taken:
        assert not path.startswith("/") and not {"..", ".", ""} & set(path.split("/")) and "\\" not in path
        assert not any(other.startswith(f"{path}/") for other in taken)
    reported = {name for note in result.notes for name in (note.where, *note.parameters.get("files", []))}
    many = has(Code.MORE_OWN_FILES_REFUSED, result.notes) or any("more" in note.parameters for note in result.notes)
    with archives.Shelf() as shelf:
        listing = shelf.listing(archives.StoredFile(root, "ada.zip", 0))
    for path in {*listing.files, *listing.refused} - taken - {*WANTED, "course.json"}:
        assert many or {path, shown(path)} & reported, path


def test_of_a_tar_only_ordinary_files_within_it_are_read(tmp_path):
    packed = io.BytesIO()
    with tarfile.open(fileobj=packed, mode="w:gz") as archive:
        for name, content in (work() | {"../outside.py": b"1", "/etc/own.py": b"2"}).items():
            entry = tarfile.TarInfo(name)
            entry.size = len(content)
            archive.addfile(entry, io.BytesIO(content))
        for kind in (tarfile.SYMTYPE, tarfile.LNKTYPE, tarfile.FIFOTYPE, tarfile.CHRTYPE):
            entry = tarfile.TarInfo(f"link-{kind.decode()}.py")
            entry.type, entry.linkname = kind, "/etc/passwd"
            archive.addfile(entry)
    lay(tmp_path, {"ada.tar.gz": packed.getvalue()})
    read = Read(tmp_path)
    assert read.notebooks == WANTED
    assert set(read.hand_in.files) <= {"etc/own.py"}


@pytest.mark.parametrize("name", ["ada.tar.gz", "ada.tar.xz", "ada.tar.bz2", "ada.tar"])
def test_a_tar_that_is_damaged_or_too_large_is_the_students_and_is_reported(tmp_path, name, monkeypatch):
    whole = tarred(work(), f"w:{name.rpartition('.')[2].replace('tar', '')}")
    monkeypatch.setattr(archives, "MAX_INNER_ARCHIVE", 50_000)
    for content in (whole[: len(whole) // 3], b"no archive", tarred({"a.ipynb": b"0" * 60_000}, "w:gz")):
        lay(tmp_path, {name: content})
        read = Read(tmp_path)
        assert read.notebooks == [] and read.problems


def test_a_sparse_file_in_a_tar_is_not_unpacked(tmp_path):
    """Its holes take no space in the archive, and 8 GB when it is unpacked."""
    packed = io.BytesIO()
    with tarfile.open(fileobj=packed, mode="w:gz", format=tarfile.GNU_FORMAT) as archive:
        hole = tarfile.TarInfo("hole.csv")
        hole.type = tarfile.GNUTYPE_SPARSE
        header = bytearray(hole.tobuf(tarfile.GNU_FORMAT))
        header[483:495] = b"%011o\0" % 8_000_000_000  # size with its hole
        header[148:156] = b"        "
        header[148:156] = b"%06o\0 " % sum(header)
        archive.fileobj.write(header)
    lay(tmp_path, {"ada.tar.gz": packed.getvalue()})
    (submission,) = intake.find(tmp_path).submissions
    assert submission.pieces[0].refused == {"hole.csv": archives._NOT_A_FILE}


def test_an_archive_that_cannot_be_read_beside_notebooks_is_named(taken):
    notes = taken(work() | {"more.zip": b"no zip"}).notes
    assert has(Code.FILES_REFUSED, notes) and "more.zip" in names(notes)


def header(name, size, kind=b"0"):
    """One header of a tar, with any size."""
    block = bytearray(tarfile.TarInfo(name).tobuf(tarfile.GNU_FORMAT))
    block[124:136], block[156:157] = tarfile.itn(size, 12, tarfile.GNU_FORMAT), kind
    block[148:155] = b"%06o\0" % tarfile.calc_chksums(bytes(block))[0]
    return bytes(block)


@pytest.mark.parametrize(
    "tar",
    [
        header("a", 0) + header("b", -512) + bytes(1024),  # the next header is this one again, for ever
        header("p", 8192, b"x") + b"1" * 8192 + header("a", 0) + bytes(1024),
        header("p", 8192, b"g") + b"9 a=1\n" * 1365 + b"\n\n" + header("a", 0) + bytes(1024),
        b"".join(header("p", 4096, b"x") + b"1" * 4096 for _ in range(100)),
        gzip.compress(b"") * 1000,
    ],
    ids=["a size below 0", "a long header", "a long header for all", "many headers", "a thousand pieces"],
)
def test_a_tar_that_would_take_for_ever_is_refused(tmp_path, tar):
    lay(tmp_path, {"ada.tar": tar, "bob.zip": zipped(work("bob") | {"x.tar": tar})})
    found = intake.find(tmp_path, [StudentRecord("ada"), StudentRecord("bob")])
    ada, bob = found.submissions
    (trouble,), refused = ada.pieces[0].trouble, bob.pieces[0].refused["x.tar"]
    assert trouble.code is refused.code and trouble.code in (Code.UNUSUAL_HEADERS, Code.SEVERAL_PIECES)
