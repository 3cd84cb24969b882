"""The program at the bench that signs: in a process of its own, with its journal and its clock."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import threading

import numpy as np
import pytest
from laboratory import laboratory

from rotflex.courseware import signed_files
from rotflex.errors import ConfigurationError, SignatureError, StudentIDError
from rotflex.recording import Recording
from rotflex.signing import program, signer_settings
from rotflex.signing.signer import MOST_BYTES, Signer


def file_of(folder, seconds=1.0) -> bytes:
    t = np.arange(0, seconds + 1e-9, 0.002)
    path = Recording.of(t, {"experiment": "watch"}, theta=0 * t, alpha=0 * t, vm=0 * t).save(folder / "some.mat")
    return path.read_bytes()


def run(command, given: bytes) -> subprocess.CompletedProcess[bytes]:
    return subprocess.run(command, input=given, capture_output=True, check=False, timeout=120)


def test_a_recording_is_signed_by_a_process_of_its_own_and_entered_in_the_journal(tmp_path):
    here = laboratory(tmp_path)
    content = file_of(tmp_path)
    done = run(here.command, signed_files.request("ada", content))
    assert (done.returncode, done.stderr) == (0, b"")
    said = signed_files.verified(content, done.stdout, [here.public])
    assert {name: said.about[name] for name in ("bench", "student", "number", "seconds", "real_time")} == {
        "bench": "north",
        "student": "ada",
        "number": 1,
        "seconds": 1.0,
        "real_time": False,
    }
    (line,) = (tmp_path / "north.jsonl").read_text(encoding="utf-8").splitlines()
    assert json.loads(line)["file"] == signed_files.digest(content)
    assert not (tmp_path / "north.jsonl.lock").exists()


@pytest.mark.parametrize(
    ("given", "told"),
    [
        (b"", "The request is not understood"),
        (b"[]\n", "The request is not understood"),
        (b'{"student": "ada", "bytes": true}\nx', "The request is not understood"),
        (b'{"student": "ada", "bytes": %d}\nx' % (MOST_BYTES + 1), "The request is not understood"),
        (b'{"student": "ada", "bytes": 9}\nx', "The request was broken off"),
        (b'{"student": "ada", "bytes": 1}\nx', "What came is no recording: recording.mat cannot be read"),
        (b'{"student": "../x", "bytes": 1}\nx', "../x"),
    ],
)
def test_what_cannot_be_signed_is_told_and_nothing_is_given(tmp_path, capsysbinary, monkeypatch, given, told):
    here = laboratory(tmp_path)

    class Given:
        import io

        buffer = io.BytesIO(given)

    monkeypatch.setattr(sys, "stdin", Given)
    assert program.main(["sign", str(here.settings)]) == program.REFUSED
    out, err = capsysbinary.readouterr()
    assert out == b"" and told.encode() in err
    assert not (tmp_path / "north.jsonl").exists()


def test_a_key_is_made_once_and_is_its_owners(tmp_path, capsys):
    assert program.main(["key", str(tmp_path / "a.key")]) == 0
    public = capsys.readouterr().out.strip()
    assert signed_files.public_of(signed_files.private_key(tmp_path / "a.key")) == public
    if os.name == "posix":
        assert (tmp_path / "a.key").stat().st_mode & 0o077 == 0
    assert program.main(["key", str(tmp_path / "a.key")]) == program.REFUSED
    assert "never written over" in capsys.readouterr().err


def test_no_more_seconds_are_signed_than_went_by(tmp_path):
    here = laboratory(tmp_path, real_time=True)
    now = [1000.0]
    signer = Signer(signer_settings.read(here.settings), lambda: now[0])
    content = file_of(tmp_path, seconds=10.0)
    signer.sign("ada", content)
    now[0] += 8.5
    with pytest.raises(SignatureError, match=r"of 10\.0 s, and only 8\.5 s have passed"):
        signer.sign("ada", content)
    now[0] += 0.6  # clocks differ by up to a second
    signer.sign("ada", content)
    now[0] -= 3600.0  # winter time, or a clock that was put right: nothing honest is refused
    assert b'number\\": 3' in signer.sign("ada", content)


def test_samples_that_were_signed_in_one_name_are_not_signed_in_another(tmp_path):
    here = laboratory(tmp_path, real_time=True)
    now = [1000.0]
    signer = Signer(signer_settings.read(here.settings), lambda: now[0])
    t = np.arange(0, 1.0, 0.002)
    for name, student in (("mine", "ada"), ("yours", "bob")):
        now[0] += 60.0
        one = Recording.of(t, {"note": name}, theta=np.sin(t), alpha=np.cos(t), vm=0 * t)
        content = one.save(tmp_path / f"{name}.mat").read_bytes()
        if student == "ada":
            signer.sign(student, content)
        else:
            with pytest.raises(SignatureError, match="The same samples were signed before, in the name of ada"):
                signer.sign(student, content)
    still = file_of(tmp_path)  # an arm that nobody moves is the same each time
    for _again in range(2):
        now[0] += 60.0
        signer.sign("bob", still)


def test_recordings_that_come_together_have_different_numbers(tmp_path):
    here = laboratory(tmp_path)
    signer = Signer(signer_settings.read(here.settings), lambda: 1000.0)
    content, made = file_of(tmp_path), []
    together = [threading.Thread(target=lambda: made.append(signer.sign("ada", content))) for _ in range(4)]
    for one in together:
        one.start()
    for one in together:
        one.join()
    numbers = [signed_files.verified(content, beside, [here.public]).about["number"] for beside in made]
    assert sorted(numbers) == [1, 2, 3, 4]


def test_without_its_journal_nothing_is_signed(tmp_path):
    here = laboratory(tmp_path)
    signer = Signer(signer_settings.read(here.settings), lambda: 1000.0)
    (tmp_path / "north.jsonl").write_text("half a li", encoding="utf-8")
    with pytest.raises(SignatureError, match="is damaged"):
        signer.sign("ada", file_of(tmp_path))
    (tmp_path / "north.jsonl").unlink()
    (tmp_path / "north.jsonl").mkdir()
    with pytest.raises(SignatureError, match=r"cannot be written.*Nothing is signed without it"):
        signer.sign("ada", file_of(tmp_path))


def test_a_lock_that_was_left_behind_is_told_of(tmp_path, monkeypatch):
    here = laboratory(tmp_path)
    monkeypatch.setattr("rotflex.signing.signer._PATIENCE", 0.1)
    (tmp_path / "north.jsonl.lock").touch()
    with pytest.raises(SignatureError, match=r"north\.jsonl\.lock was left behind"):
        Signer(signer_settings.read(here.settings), lambda: 1000.0).sign("ada", file_of(tmp_path))


def test_whose_it_is_has_to_be_an_id(tmp_path):
    here = laboratory(tmp_path)
    with pytest.raises(StudentIDError):
        Signer(signer_settings.read(here.settings), lambda: 1000.0).sign("a/b", file_of(tmp_path))


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ('bench = "north"\nkey = "k"\n', "does not say journal, as in: bench ="),
        ('bench = 3\nkey = "k"\njournal = "j"\n', "bench = 3 is not understood"),
        ('bank = "north"\n', "bank = 'north' is not understood. There are bench, key, journal, real_time"),
        ("[", "cannot be read"),
    ],
)
def test_settings_that_are_not_understood_are_told(tmp_path, text, told):
    (tmp_path / "s.toml").write_text(text, encoding="utf-8")
    with pytest.raises(ConfigurationError) as raised:
        signer_settings.read(tmp_path / "s.toml")
    assert told in str(raised.value)
