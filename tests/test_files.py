"""Files of the laboratory are written whole or not at all."""

import pytest

from rotflex import files


def test_a_file_is_replaced_whole_and_nothing_lies_beside_it(tmp_path):
    path = tmp_path / "mark.json"
    for content in ("ä\n", b"\x00", lambda scratch: scratch.write_bytes(b"by hand")):
        files.write(path, content)
    assert path.read_bytes() == b"by hand"

    def broken(scratch):
        scratch.write_bytes(b"half")
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        files.write(path, broken)
    assert path.read_bytes() == b"by hand" and list(tmp_path.iterdir()) == [path]


def test_what_another_program_has_open_on_windows_is_tried_again(monkeypatch):
    tried = []

    def act() -> None:
        tried.append(1)
        if len(tried) < 3:
            raise PermissionError

    with pytest.raises(PermissionError):  # elsewhere, what is refused stays refused
        files.patiently(act)
    monkeypatch.setattr(files, "_PATIENCE", 60.0)
    monkeypatch.setattr(files, "_PAUSE", 0.0)
    files.patiently(act)
    assert len(tried) == 3
