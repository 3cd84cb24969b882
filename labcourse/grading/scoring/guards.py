"""Who is let in to the scoring page, and what its answers say to a browser.

The server listens on the loopback interface only. Each scorer has an address of their own; it is exchanged for a cookie
at once. A request has to name this very host and port (else another site could be made to look like it), an act has
to come from this very page, with a header that only the page knows.
"""

from __future__ import annotations

import json
import secrets
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from starlette.types import ASGIApp, Message, Receive, Scope, Send

HEADER = "x-labcourse-page"  #: of each act: the word that its page was given
ACTOR = "labcourse.actor"  #: in a request's scope: the :class:`Scorer`
MOST_BYTES = 64_000  #: of an act; a remark and fifty answers' keys, ten times
POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; connect-src 'self'; "
    "form-action 'self'; base-uri 'none'; frame-ancestors 'none'"
)
_HEADERS = {
    "content-security-policy": POLICY,
    "cache-control": "no-store",
    "referrer-policy": "no-referrer",
    "x-content-type-options": "nosniff",
    "cross-origin-opener-policy": "same-origin",
    "cross-origin-resource-policy": "same-origin",
}
_ENTER = "/enter/"


def _secret() -> str:
    return secrets.token_urlsafe(32)


@dataclass(frozen=True)
class Scorer:
    """Somebody who scores: the name in the gradebook; of their address, their browser and their pages a word each."""

    name: str
    token: str = field(default_factory=_secret, repr=False)
    session: str = field(default_factory=_secret, repr=False)
    page: str = field(default_factory=_secret, repr=False)

    def address(self, port: int) -> str:
        """Where they begin."""
        return f"http://127.0.0.1:{port}{_ENTER}{self.token}"


class Refused(Exception):
    """A request that is not let in: the status of the answer, and the reason in words."""

    def __init__(self, status: int, why: str) -> None:
        super().__init__(why)
        self.status, self.why = status, why


class Guard:
    """Lets in only what belongs here; the application behind it knows who asks.

    Parameters
    ----------
    app : the application
    scorers : who is let in
    port : where the server listens
    """

    def __init__(self, app: ASGIApp, scorers: Sequence[Scorer], port: int) -> None:
        self._app, self._scorers = app, tuple(scorers)
        self._hosts = {f"{name}:{port}" for name in ("127.0.0.1", "localhost")}
        self._cookie = f"labcourse-score-{port}"  # a browser does not tell ports apart

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Serve a request."""
        if scope["type"] != "http":
            return
        headers = {name.decode("latin-1"): value.decode("latin-1") for name, value in scope["headers"]}
        guarded = _with_headers(send)
        try:
            self._check_host(headers)
            entered = self._entering(scope)
            if entered is not None:
                await self._let_in(entered, guarded)
                return
            scorer = self._who(headers)
            if scope["method"] == "POST":
                _check_act(scorer, headers)
            elif scope["method"] not in ("GET", "HEAD"):
                raise Refused(405, "This is not done here.")
        except Refused as refused:
            await _refuse(refused, scope["method"], guarded)
            return
        await self._app({**scope, ACTOR: scorer}, receive, guarded)

    def _check_host(self, headers: Mapping[str, str]) -> None:
        if headers.get("host") not in self._hosts:
            raise Refused(421, "This server answers to 127.0.0.1 and localhost only.")

    def _entering(self, scope: Scope) -> Scorer | None:
        """Whose address this is; None if it is a page's."""
        path: str = scope["path"]
        if not path.startswith(_ENTER) or scope["method"] != "GET":
            return None
        for one in self._scorers:
            if _same(one.token, path.removeprefix(_ENTER)):
                return one
        raise Refused(403, _CLOSED)

    async def _let_in(self, scorer: Scorer, send: Send) -> None:
        cookie = f"{self._cookie}={scorer.session}; HttpOnly; SameSite=Strict; Path=/"
        headers = [(b"location", b"/"), (b"set-cookie", cookie.encode()), (b"content-length", b"0")]
        await send({"type": "http.response.start", "status": 303, "headers": headers})
        await send({"type": "http.response.body", "body": b""})

    def _who(self, headers: Mapping[str, str]) -> Scorer:
        from starlette.requests import cookie_parser

        # As browsers write them: the cookies of whatever else is served on this computer come along.
        given = cookie_parser(headers.get("cookie", "")).get(self._cookie, "")
        for one in self._scorers:
            if _same(one.session, given):
                return one
        raise Refused(403, _CLOSED)


_CLOSED = (
    "This page opens by the address that the command score printed when it was started last. Open that address again; "
    "what was scored before is kept."
)


def _check_act(scorer: Scorer, headers: Mapping[str, str]) -> None:
    """Refuse an act that does not come from a page of this scorer's."""
    if headers.get("origin") != f"http://{headers['host']}":
        raise Refused(403, "This was sent by another site. Nothing was done.")
    if not _same(scorer.page, headers.get(HEADER, "")):
        raise Refused(
            403,
            f"This page belongs to another scorer or to an earlier start: this browser is {scorer.name}'s now. "
            "Nothing was done. Open your own address again, in a browser of your own.",
        )
    if headers.get("content-type", "").partition(";")[0].strip() != "application/json":
        raise Refused(415, "An act is sent as JSON. Nothing was done.")
    length = headers.get("content-length", "")
    if not (length.isascii() and length.isdigit()) or int(length) > MOST_BYTES:
        raise Refused(413, f"That is too long: {MOST_BYTES} bytes at most. Nothing was done.")


def _same(secret: str, given: str) -> bool:
    return secrets.compare_digest(secret.encode(), given.encode("utf-8", "replace"))


def _with_headers(send: Send) -> Send:
    async def sending(message: Message) -> None:
        if message["type"] == "http.response.start":
            given = list(message.get("headers", ()))
            # What says more of itself, as a stranger's file does, keeps to that: two policies would both count.
            said = {name.lower() for name, _value in given}
            own = [(name.encode(), value.encode()) for name, value in _HEADERS.items() if name.encode() not in said]
            message = {**message, "headers": [*given, *own]}
        await send(message)

    return sending


async def _refuse(refused: Refused, method: str, send: Send) -> None:
    if method == "POST":
        kind, body = "application/json", json.dumps({"problem": refused.why})
    else:
        kind, body = "text/plain; charset=utf-8", refused.why + "\n"
    headers = [(b"content-type", kind.encode()), (b"content-length", str(len(body.encode())).encode())]
    await send({"type": "http.response.start", "status": refused.status, "headers": headers})
    await send({"type": "http.response.body", "body": b"" if method == "HEAD" else body.encode()})
