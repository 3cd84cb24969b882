"""Ask the rig's server by HTTPS, with a token. The standard library is enough."""

from __future__ import annotations

import os
import re
import urllib.error
import urllib.request
from pathlib import Path
from urllib.parse import urlsplit

from rotflex import files
from rotflex.errors import BenchError

TOKEN_VARIABLE = "ROTFLEX_RIG_TOKEN"  #: environment variable: a token, in place of the file
UNKNOWN = 401  #: status of an answer to a token that nobody has
_TIMEOUT = 20.0  # s, of one request
_LOOPBACK = ("localhost", "127.0.0.1", "::1")


class NoAnswer(OSError):
    """The server cannot be reached now, or has trouble of its own: the same request may work later."""


class _Unmoved(urllib.request.HTTPRedirectHandler):
    """Follows no redirection: the token would go with it."""

    def redirect_request(self, *_: object) -> None:
        return None


_OPENER = urllib.request.build_opener(_Unmoved)


def checked(url: str) -> str:
    """Return the address of a rig, without a slash at its end.

    Raises
    ------
    BenchError
        If it is none, or if it is not encrypted and of another computer.
    """
    parts = urlsplit(url)
    if parts.scheme not in ("http", "https") or not parts.hostname or parts.query or parts.fragment or parts.username:
        raise BenchError(f"{url!r} is no address of a rig, as https://rig.school.edu is: ask your instructor for it.")
    if parts.scheme == "http" and parts.hostname not in _LOOPBACK:
        raise BenchError(f"{url} is not encrypted, and everybody on the way could read your token: use https://.")
    return url.rstrip("/")


def ask(url: str, method: str = "GET", body: bytes | None = None, token: str | None = None) -> bytes:
    """Send a request, and return the answer.

    Raises
    ------
    BenchError
        If the server refuses it, with the server's reason.
    NoAnswer
        If nobody answers.
    """
    token = (token_for(url) if token is None else token).strip()
    if not re.fullmatch(r"[\w-]+", token, re.ASCII):
        raise BenchError("This is no token: it has letters, digits, - and _ only. Copy it again.")
    headers = {"Authorization": f"Bearer {token}", "Content-Type": "application/octet-stream"}
    try:
        with _OPENER.open(urllib.request.Request(url, body, headers, method=method), timeout=_TIMEOUT) as answer:
            return bytes(answer.read())
    except urllib.error.HTTPError as error:
        text = error.read(2000).decode(errors="replace")
        if error.code >= 500:
            raise NoAnswer(text or str(error)) from None
        of_variable = f" Yours is that of the variable {TOKEN_VARIABLE}." if os.environ.get(TOKEN_VARIABLE) else ""
        raise BenchError(f"{text or error}{of_variable if error.code == UNKNOWN else ''}") from None
    except OSError as error:  # also URLError, and a connection that breaks
        raise NoAnswer(str(getattr(error, "reason", error))) from None


# --- tokens -----------------------------------------------------------------------------------------------------------


def token_for(url: str) -> str:
    """Return the user's token for a rig.

    Raises
    ------
    BenchError
        If there is none.
    """
    if token := os.environ.get(TOKEN_VARIABLE):
        return token
    try:
        return _path(url).read_text(encoding="utf-8")
    except OSError:
        parts = urlsplit(url)
    raise BenchError(
        "There is no token of yours for this rig. Run this once, in a cell that you delete afterwards: "
        f'import rotflex_rig; rotflex_rig.login("{parts.scheme}://{parts.netloc}"). It asks for the token that your '
        "instructor gave you."
    )


def keep_token(url: str, token: str) -> Path:
    """Keep a token in a file that only the user reads, and return the file."""
    path = _path(url)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.touch(0o600)
    path.write_text(token, encoding="utf-8")
    return path


def _path(url: str) -> Path:
    return files.settings() / "rig-tokens" / urlsplit(url).netloc.replace(":", "-")
