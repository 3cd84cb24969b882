"""Decide who is let in to the scoring page, and set what its answers tell a browser.

The server listens on the loopback interface only. Each scorer has an address of their own; it is exchanged for a cookie
at once. A request has to name this very host and port (else another site could be made to look like it). An act has
to come from this very page, with a header that only the page knows.
"""

from __future__ import annotations

import secrets
from collections.abc import Sequence
from dataclasses import dataclass, field

from starlette.datastructures import MutableHeaders
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import JSONResponse, PlainTextResponse, RedirectResponse, Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

HEADER = "x-labcourse-page"  #: of each act: the secret that its page was given
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
_CLOSED = (
    "This page opens by the address that the command score printed when it was started last. Open that address again; "
    "what was scored before is kept."
)


def _secret() -> str:
    return secrets.token_urlsafe(32)


@dataclass(frozen=True)
class Scorer:
    """Somebody who scores: the name in the gradebook, and a secret each of their address, browser and pages."""

    name: str
    token: str = field(default_factory=_secret, repr=False)
    session: str = field(default_factory=_secret, repr=False)
    page: str = field(default_factory=_secret, repr=False)

    def address(self, port: int) -> str:
        """Return the address where they begin."""
        return f"http://127.0.0.1:{port}{_ENTER}{self.token}"


class Guard:
    """Middleware that lets in only what belongs here, and tells the application who asks.

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

        async def guarded(message: Message) -> None:
            if message["type"] == "http.response.start":
                headers = MutableHeaders(scope=message)
                for name, value in _HEADERS.items():
                    headers.setdefault(name, value)  # a stranger's file has a stricter policy
            await send(message)

        request = Request(scope, receive)
        try:
            answer = self._admit(request)
        except HTTPException as refused:
            answer = refusal(request, refused)
        await (answer or self._app)(scope, receive, guarded)

    def _admit(self, request: Request) -> Response | None:
        """Sign in a scorer who opens their own link, and return the redirect; else check who sends the request.

        Returns None if the request may go on; its scope names the scorer then. Raises HTTPException if it may not.
        """
        if request.headers.get("host") not in self._hosts:
            raise HTTPException(421, "This server answers to 127.0.0.1 and localhost only.")
        path = request.scope["path"]
        if path.startswith(_ENTER) and request.method == "GET":
            scorer = self._scorer("token", path.removeprefix(_ENTER))
            response = RedirectResponse("/", 303)
            response.set_cookie(self._cookie, scorer.session, httponly=True, samesite="strict")
            return response
        scorer = self._scorer("session", request.cookies.get(self._cookie, ""))
        if request.method == "POST":
            _check_post(scorer, request)
        elif request.method not in ("GET", "HEAD"):
            raise HTTPException(405, "Method not allowed.")
        request.scope[ACTOR] = scorer
        return None

    def _scorer(self, secret: str, given: str) -> Scorer:
        for scorer in self._scorers:
            if _same(getattr(scorer, secret), given):
                return scorer
        raise HTTPException(403, _CLOSED)


def _check_post(scorer: Scorer, request: Request) -> None:
    """Refuse an act that does not come from a page of this scorer's."""
    headers = request.headers
    if headers.get("origin") != f"http://{headers['host']}":
        raise HTTPException(403, "This was sent by another site. Nothing was done.")
    if not _same(scorer.page, headers.get(HEADER, "")):
        raise HTTPException(
            403,
            f"This page belongs to another scorer or to an earlier start: this browser is {scorer.name}'s now. "
            "Nothing was done. Open your own address again, in a browser of your own.",
        )
    if headers.get("content-type", "").partition(";")[0].strip() != "application/json":
        raise HTTPException(415, "An act is sent as JSON. Nothing was done.")
    length = headers.get("content-length", "")
    if not (length.isascii() and length.isdigit()) or int(length) > MOST_BYTES:
        raise HTTPException(413, f"That is too long: {MOST_BYTES} bytes at most. Nothing was done.")


def _same(secret: str, given: str) -> bool:
    return secrets.compare_digest(secret.encode(), given.encode("utf-8", "replace"))


def refusal(request: Request, refused: Exception) -> Response:
    """Answer a request that is refused with the reason; JSON for an act."""
    assert isinstance(refused, HTTPException)
    if request.method == "POST":
        return JSONResponse({"problem": refused.detail}, refused.status_code)
    return PlainTextResponse(refused.detail + "\n", refused.status_code)
