"""Files written whole or not at all."""

import os
import subprocess
import sys

import pytest

from labcourse import files


@pytest.mark.parametrize(
    "content",
    ["grün\r\n\n", "grün\r\n\n".encode(), lambda path: path.write_bytes("grün\r\n\n".encode())],
    ids=["text", "bytes", "function"],
)
def test_a_file_is_written_in_place_of_an_earlier_one(tmp_path, content):
    target = tmp_path / "a.txt"
    for _ in range(2):
        written = files.write(target, content)
        assert target.read_bytes() == "grün\r\n\n".encode()  # line ends are as they were given
        assert written == files.version(target)
    assert os.listdir(tmp_path) == ["a.txt"]


def test_what_is_returned_is_of_what_was_written_and_not_of_what_came_after(tmp_path, monkeypatch):
    """Another program writes as soon as the file is there."""
    replace = os.replace

    def replace_and_be_replaced(scratch, target):
        replace(scratch, target)
        (tmp_path / "other").write_text("theirs, longer")
        replace(tmp_path / "other", target)

    monkeypatch.setattr(os, "replace", replace_and_be_replaced)
    written = files.write(tmp_path / "a.txt", "ours")
    assert len("ours") in written and written != files.version(tmp_path / "a.txt")


def half_way(error):
    def write(path):
        path.write_text("half")
        raise error

    return write


@pytest.mark.parametrize(
    ("write", "error"),
    [(half_way(error), type(error)) for error in (OSError(28, "No space left"), KeyboardInterrupt(), ValueError("bug"))]
    + [(lambda path: None, FileNotFoundError)],
    ids=["full", "stopped", "bug", "nothing written"],
)
@pytest.mark.parametrize("before", [b"old", None])
def test_what_goes_wrong_half_way_leaves_the_old_file_and_nothing_else(tmp_path, write, error, before):
    target = tmp_path / "a.txt"
    if before is not None:
        target.write_bytes(before)
    with pytest.raises(error):
        files.write(target, write)
    assert [path.read_bytes() for path in tmp_path.iterdir()] == [before] * (before is not None)


def test_a_rename_that_is_refused_leaves_nothing_behind(tmp_path):
    (tmp_path / "a.txt").mkdir()
    with pytest.raises(OSError, match="directory"):
        files.write(tmp_path / "a.txt", "new")
    assert os.listdir(tmp_path) == ["a.txt"] and not os.listdir(tmp_path / "a.txt")


def test_programs_that_write_the_same_file_never_mix(tmp_path):
    target = tmp_path / "a.txt"
    program = (
        "import sys\nfrom labcourse import files\n"
        "for _ in range(200):\n    files.write(sys.argv[1], sys.argv[2] * 100_000)"
    )
    writers = [subprocess.Popen([sys.executable, "-c", program, target, letter]) for letter in "abc"]
    seen = set()
    while any(writer.poll() is None for writer in writers):
        seen |= {target.read_text()} if target.exists() else set()
    assert [writer.returncode for writer in writers] == [0, 0, 0]
    assert seen | {target.read_text()} <= {letter * 100_000 for letter in "abc"}
    assert os.listdir(tmp_path) == ["a.txt"]
