"""Files that a laboratory's machine has signed, and what is found of those that it has not."""

from __future__ import annotations

import base64
import json
import sys

import pytest

from rotflex.courseware import signed_files
from rotflex.errors import ConfigurationError, SignatureError

CONTENT = b"what was measured"
ABOUT = {"bench": "north", "student": "zoë", "number": 3}


@pytest.fixture(scope="module")
def keys(tmp_path_factory):
    """Two keys: each the private one, and the public one as settings have it."""
    made = []
    for name in ("one", "two"):
        file = tmp_path_factory.mktemp("keys") / name
        private, public = signed_files.new_key()
        file.write_bytes(private)
        made.append((signed_files.private_key(file), public))
    return made


def test_what_was_signed_is_said_of_the_file_with_the_key_that_signed_it(keys):
    (one, public), (_, other) = keys
    said = signed_files.verified(CONTENT, signed_files.signed(CONTENT, ABOUT, one), [other, public])
    assert (said.key, said.text("student"), said.about["number"]) == (public, "zoë", 3)
    assert said.text("number") == said.text("nothing") == ""
    assert signed_files.public_of(one) == public and len(public) == 44


def test_how_the_json_is_laid_out_does_not_matter(keys):
    one, public = keys[0]
    beside = json.dumps(json.loads(signed_files.signed(CONTENT, ABOUT, one)), indent=4).replace("\n", "\r\n")
    assert signed_files.verified(CONTENT, beside.encode(), [public]).about["bench"] == "north"


def changed(beside: bytes, **entries: object) -> bytes:
    return json.dumps({**json.loads(beside), **entries}).encode()


@pytest.mark.parametrize(
    ("forge", "told"),
    [
        (lambda file, beside: (file + b" ", beside), "changed after it was signed"),
        (lambda file, beside: (file, beside.replace(b"north", b"south")), "the statement was changed"),
        (lambda file, beside: (file, changed(beside, statement="{}")), "the statement was changed"),
        (lambda file, beside: (file, changed(beside, statement="\udc00")), "the statement was changed"),
        (lambda file, beside: (file, changed(beside, signature=base64.b64encode(bytes(64)).decode())), "the statement"),
        (lambda file, beside: (file, changed(beside, signature="AAAA")), "the statement was changed"),
        (lambda file, beside: (file, changed(beside, signature="ä")), "no signature that can be read"),
        (lambda file, beside: (file, changed(beside, signature=None)), "no signature that can be read"),
        (lambda file, beside: (file, changed(beside, format=2)), "no signature that can be read"),
        (lambda file, beside: (file, changed(beside, statement=["x"])), "no signature that can be read"),
        (lambda file, beside: (file, b""), "no signature that can be read"),
        (lambda file, beside: (file, b"\xff"), "no signature that can be read"),
        (lambda file, beside: (file, b"[" * 10_000), "no signature that can be read"),
        (lambda file, beside: (file, beside + b" " * signed_files.MOST_BYTES), "no signature that can be read"),
    ],
)
def test_what_was_changed_is_found(keys, forge, told):
    one, public = keys[0]
    with pytest.raises(SignatureError, match=told):
        signed_files.verified(*forge(CONTENT, signed_files.signed(CONTENT, ABOUT, one)), [public])


def test_another_key_is_none_of_the_laboratorys(keys):
    (one, _), (_, other) = keys
    for known in ([other], []):
        with pytest.raises(SignatureError, match="or another key was used"):
            signed_files.verified(CONTENT, signed_files.signed(CONTENT, ABOUT, one), known)


@pytest.mark.parametrize("text", ["[1]", '"x"', "{}", "nothing"])
def test_a_signed_text_that_is_no_statement_says_of_no_file(keys, text):
    one, public = keys[0]
    signature = base64.b64encode(one.sign(text.encode())).decode()
    beside = json.dumps({"format": 1, "statement": text, "signature": signature}).encode()
    with pytest.raises(SignatureError, match="says of no file"):
        signed_files.verified(CONTENT, beside, [public])


@pytest.mark.parametrize("text", ["", "north", "AAAA", "é" * 44])
def test_what_is_no_public_key_is_told(text):
    with pytest.raises(ConfigurationError, match="is no public key: it should be the 44 characters"):
        signed_files.public_key(text)


def test_what_is_no_private_key_is_told(tmp_path):
    with pytest.raises(ConfigurationError, match="cannot be read: No such file"):
        signed_files.private_key(tmp_path / "none")
    (tmp_path / "text").write_text("text", encoding="ascii")
    with pytest.raises(ConfigurationError, match="text holds no key"):
        signed_files.private_key(tmp_path / "text")


def test_without_the_package_it_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "cryptography", None)
    with pytest.raises(ConfigurationError, match=r"need the package cryptography: python -m pip install"):
        signed_files.new_key()
