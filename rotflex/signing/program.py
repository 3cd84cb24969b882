"""The program: a request comes in on standard input, a signature goes out, and all else is said on standard error."""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
from collections.abc import Sequence
from pathlib import Path

from rotflex.courseware import signed_files
from rotflex.courseware.messages import _
from rotflex.errors import RotflexError, SignatureError
from rotflex.signing.signer import MOST_BYTES, Signer
from rotflex.signing.signer_settings import read

_LONGEST_LINE = 10_000
REFUSED = 3  #: the program's exit code where it does not sign


def main(words: Sequence[str] | None = None) -> int:
    """Run the program with its words, and return its exit code."""
    parser = argparse.ArgumentParser(prog="python -m rotflex.signing", description=_("Sign recordings of a bench."))
    commands = parser.add_subparsers(dest="command", required=True)
    commands.add_parser("key", help=_("make a key, and print the public one")).add_argument("file", type=Path)
    commands.add_parser("sign", help=_("sign what comes on standard input")).add_argument("settings", type=Path)
    asked = parser.parse_args(words)
    try:
        if asked.command == "key":
            print(_make_key(asked.file))
        else:
            sys.stdout.buffer.write(_sign(asked.settings))
            sys.stdout.buffer.flush()
    except RotflexError as error:
        print(error, file=sys.stderr)
        return REFUSED
    return 0


def _make_key(file: Path) -> str:
    """The public key of a new one, whose file only its owner may read."""
    private, public = signed_files.new_key()
    try:
        descriptor = os.open(file, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
    except OSError as error:
        raise SignatureError(
            _("The key {file} cannot be made: {why}. A key that is there is never written over.").format(
                file=file, why=error.strerror
            )
        ) from None
    with os.fdopen(descriptor, "wb") as opened:
        opened.write(private)
    return public


def _sign(settings: Path) -> bytes:
    line = sys.stdin.buffer.readline(_LONGEST_LINE)
    try:
        asked = json.loads(line)
        student, size = asked["student"], asked["bytes"]
        if not isinstance(student, str) or type(size) is not int or not 0 < size <= MOST_BYTES:
            raise ValueError(size)
    except (ValueError, TypeError, KeyError, RecursionError):
        raise SignatureError(_("The request is not understood; nothing is signed.")) from None
    content = sys.stdin.buffer.read(size)
    if len(content) != size:
        raise SignatureError(_("The request was broken off; nothing is signed."))
    return Signer(read(settings), time.time).sign(student, content)
