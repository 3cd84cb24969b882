"""Decide who is let in to the scoring page, and set what its answers tell a browser.

A :class:`Site` is where browsers find it: the loopback interface, or an address that other computers reach by TLS.

Each scorer has an address of their own. It ends in a token, which stands behind a ``#``: a browser sends that part to
nobody, so the token is in no log and in no referrer. The page ``enter`` exchanges it for a cookie. A request has to
name this very host (else another site could be made to look like it).

A browser sends a cookie to every port of its host. So the cookie is the digest of the token, not the token, and opens
pages only. An act has to come from a page of this very origin, with the token in a header: ``enter`` stores the token
where pages of this origin alone can read it.
"""

from __future__ import annotations

import hashlib
import ipaddress
import logging
import math
import re
import secrets
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from starlette.concurrency import run_in_threadpool
from starlette.datastructures import MutableHeaders
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import FileResponse, JSONResponse, PlainTextResponse, Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from labcourse import clock
from labcourse.errors import GradebookError
from labcourse.grading.gradebook import Token
from labcourse.grading.gradebook.records import TOKEN_LASTS

TOKEN_HEADER = "x-labcourse-token"  #: of each act, and of the request that exchanges a token for a cookie
ACTOR = "labcourse.actor"  #: in a request's scope: the :class:`Scorer`
MOST_BYTES = 64_000  #: of an act; a remark and fifty answers' keys, ten times
MOST_WRONG = 10  #: wrong tokens from one address in a minute, before it is asked to wait
MOST_ADDRESSES = 1000  #: of which wrong tokens are counted
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
_MINUTE = 60.0  # s
_ENTER = "/enter"
_PAGE = Path(__file__).parent / "page"
_OPEN = {_ENTER: _PAGE / "enter.html", "/enter.js": _PAGE / "enter.js"}  # without a cookie
_CLOSED = (
    "This page opens by your own address only, the newest one that the command score printed. Open that address again; "
    "what was scored before is kept."
)
_ENDED = (
    "Your address has ended: it was revoked or replaced, or it is older than {} days. Ask the instructor for a new "
    "one. What you scored before is kept."
)
LOOPBACK = re.compile(r"(localhost|127\.0\.0\.1|\[::1\])(:[1-9]\d{0,4})?", re.ASCII)  #: a host
PORTS = {"http": 80, "https": 443}  #: of an address that names none
Find = Callable[[str], Token | None]  #: the token of a digest


@dataclass(frozen=True)
class Site:
    """Where browsers find the page.

    Attributes
    ----------
    scheme : "https"; or "http", then any name and port of the loopback interface will do: a tunnel has its own port
    host : of the address, with its port unless that is the scheme's
    proxy : address of the only computer that may connect, and that is believed about who asks; None without a proxy
    """

    scheme: str
    host: str
    proxy: str | None = None

    @property
    def url(self) -> str:
        """The address, without a slash at its end."""
        return f"{self.scheme}://{self.host}"

    @property
    def is_secure(self) -> bool:
        """Whether browsers reach it by TLS."""
        return self.scheme == "https"

    @property
    def port(self) -> int:
        """The port of the address."""
        port = re.search(r":(\d+)$", self.host)
        return int(port[1]) if port else PORTS[self.scheme]

    def address(self, token: str) -> str:
        """Return the address where the owner of a token begins."""
        return f"{self.url}/enter#{token}"

    def cookie(self, request: Request) -> str:
        """Return the name of the cookie. A browser does not tell ports apart."""
        name = f"labcourse-score-{Site(self.scheme, request.headers['host']).port}"
        return f"__Host-{name}" if self.is_secure else name

    def check_host(self, request: Request) -> None:
        """Raise HTTPException: 403 if a request does not come by the site's proxy, 421 if it names another host."""
        if self.proxy is not None and ip_of(request.client.host if request.client else "") != self.proxy:
            raise HTTPException(403, "This server answers to its proxy only.")
        hosts = request.headers.getlist("host")
        if len(hosts) != 1 or not (hosts[0] == self.host if self.is_secure else LOOPBACK.fullmatch(hosts[0])):
            names = self.host if self.is_secure else "127.0.0.1, localhost and [::1]"
            raise HTTPException(421, f"This server answers to {names} only.")

    def check_origin(self, request: Request) -> None:
        """Raise HTTPException (403) if a page of another origin sends or opens this; another port is another origin."""
        if request.method == "POST":
            is_own = request.headers.getlist("origin") == [f"{self.scheme}://{request.headers['host']}"]
        else:  # "none": the person typed it; a browser of before 2023 says nothing
            is_own = request.headers.get("sec-fetch-site", "none") in ("none", "same-origin")
        if not is_own:
            raise HTTPException(403, "This came from another site. Nothing was done. Open your own address again.")

    def sender(self, request: Request) -> str:
        """Return the address of the computer that sends a request; a proxy adds it at the end of a header."""
        peer = request.client.host if request.client else ""
        given = request.headers.getlist("x-forwarded-for") if self.proxy is not None else []
        return ip_of(",".join(given).rpartition(",")[2].strip()) or peer


def ip_of(text: str) -> str | None:
    """Return an IP address in its usual form; None for any other text."""
    try:
        address = ipaddress.ip_address(text)
    except ValueError:
        return None
    return str(getattr(address, "ipv4_mapped", None) or address)


@dataclass(frozen=True)
class Scorer:
    """Somebody who scores: the name in the gradebook, and the token of their address; "" where only a page is read."""

    name: str
    token: str = field(default_factory=secrets.token_urlsafe, repr=False)

    @property
    def digest(self) -> str:
        """What is stored of the token, and is the cookie: it opens pages, and nobody can enter or act by it."""
        return hashlib.sha256(self.token.encode()).hexdigest()


def while_it_runs(scorers: Sequence[Scorer]) -> Find:
    """Return who is let in while this server runs."""
    return {one.digest: Token(one.name, one.digest, clock.now()) for one in scorers}.get


class WrongTokens:
    """Count wrong tokens by the address that sends them. A right token is let in from any address.

    Parameters
    ----------
    clock : of seconds
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._counts: dict[str, tuple[float, int]] = {}  # address → begin of its minute, wrong tokens since

    def wait(self, address: str) -> int:
        """Count a wrong token; return for how many seconds its sender has to wait."""
        now = self._clock()
        begin, count = self._counts.pop(address, (now, 0))
        if now - begin >= _MINUTE:
            begin, count = now, 0
        if len(self._counts) >= MOST_ADDRESSES:
            del self._counts[next(iter(self._counts))]  # the one that was silent for longest
        self._counts[address] = begin, count + 1
        if count == MOST_WRONG:
            logging.getLogger(__name__).warning("More than %s wrong tokens in a minute from %s.", MOST_WRONG, address)
        return math.ceil(begin + _MINUTE - now) if count >= MOST_WRONG else 0


class Guard:
    """Middleware that lets in only what belongs here, and tells the application who asks.

    Parameters
    ----------
    app : the application
    site : where browsers find the page
    find : who is let in
    """

    def __init__(self, app: ASGIApp, site: Site, find: Find) -> None:
        self._app, self._site, self._find = app, site, find
        self._wrong = WrongTokens()

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
            response = await self._admit(request)
        except (HTTPException, GradebookError) as refused:
            response = refusal(request, refused)
        await (response or self._app)(scope, receive, guarded)

    async def _admit(self, request: Request) -> Response | None:
        """Check who sends a request; return the response if it is not for the application.

        Returns None if the request may go on; its scope names the scorer then. Raises HTTPException if it may not, and
        GradebookError if the gradebook cannot be read.
        """
        if request.method not in ("GET", "HEAD", "POST"):
            raise HTTPException(405, "Method not allowed.")
        self._site.check_host(request)
        path = request.scope["path"]
        if request.method != "POST" and path in _OPEN:
            return FileResponse(_OPEN[path])
        self._site.check_origin(request)
        if path == _ENTER:
            return await self._enter(request)
        cookie = request.cookies.get(self._site.cookie(request), "")
        scorer = Scorer(await self._name(request, cookie), request.headers.get(TOKEN_HEADER, ""))
        if request.method == "POST":
            _check_act(scorer, cookie, request)
        request.scope[ACTOR] = scorer
        return None

    async def _enter(self, request: Request) -> Response:
        """Exchange the token in the header for a cookie. Raises HTTPException as :meth:`_name` does."""
        token = request.headers.get(TOKEN_HEADER, "")
        digest = Scorer("", token).digest if token else ""
        await self._name(request, digest)
        response = Response(status_code=204)
        name, secure = self._site.cookie(request), self._site.is_secure
        response.set_cookie(name, digest, httponly=True, samesite="strict", secure=secure)
        return response

    async def _name(self, request: Request, digest: str) -> str:
        """Return who has the token of a digest.

        Raises HTTPException: 403 if nobody has it, or has it no more; 429 if its sender had too many wrong ones.
        """
        if not digest:
            raise HTTPException(403, _CLOSED)
        found = await run_in_threadpool(self._find, digest)
        if found is None:
            if wait := self._wrong.wait(self._site.sender(request)):
                told = f"There were too many wrong addresses from this computer. Wait {wait} s. {_CLOSED}"
                raise HTTPException(429, told, {"retry-after": str(wait)})
            raise HTTPException(403, _CLOSED)
        if not found.is_valid:
            raise HTTPException(403, _ENDED.format(TOKEN_LASTS.days))
        return found.actor


def _check_act(scorer: Scorer, cookie: str, request: Request) -> None:
    """Refuse an act without the token of the cookie, and what no page sends.

    Raises
    ------
    HTTPException
        403 if the token in the header does not belong to the cookie; 415 if the body is not JSON; 413 if its length is
        missing, no number, too large, or not said because it is chunked.
    """
    headers = request.headers
    if not secrets.compare_digest(scorer.digest, cookie):
        raise HTTPException(
            403,
            f"This page did not send the token of {scorer.name}'s address, and this browser is {scorer.name}'s now. "
            "Nothing was done. Open your own address again, in a browser of your own.",
        )
    if headers.get("content-type", "").partition(";")[0].strip() != "application/json":
        raise HTTPException(415, "An act is sent as JSON. Nothing was done.")
    length = headers.get("content-length", "")
    chunked = "transfer-encoding" in headers  # then the length is not what is read
    if chunked or not (length.isascii() and length.isdigit()) or int(length) > MOST_BYTES:
        raise HTTPException(413, f"That is too long: {MOST_BYTES} bytes at most. Nothing was done.")


def refusal(request: Request, refused: Exception) -> Response:
    """Answer a request that is refused, or that the gradebook fails, with the reason; JSON for an act."""
    if not isinstance(refused, HTTPException):
        refused = HTTPException(503, str(refused))
    if request.method == "POST":
        return JSONResponse({"problem": refused.detail}, refused.status_code, refused.headers)
    return PlainTextResponse(refused.detail + "\n", refused.status_code, refused.headers)
