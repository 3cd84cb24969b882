"""Start the scoring page: which site it is, who is let in, the addresses that scorers open, and what listens."""

from __future__ import annotations

import ipaddress
import re
import socket
import ssl
import sys
import webbrowser
from pathlib import Path
from typing import Any

import typer
import uvicorn
from starlette.types import ASGIApp
from uvicorn.protocols.http.h11_impl import H11Protocol

from labcourse.errors import GradingError
from labcourse.grading.course import Course
from labcourse.grading.gradebook import Gradebook
from labcourse.grading.gradebook.records import TOKEN_LASTS
from labcourse.grading.scoring.desk import Desk
from labcourse.grading.scoring.guards import LOOPBACK, PORTS, Find, Scorer, Site, ip_of, while_it_runs
from labcourse.grading.scoring.server import ClassPage, application
from labcourse.safe_text import say

IDLE = 30.0  #: s in which a client has to send a whole request; then its connection is closed
_URL = re.compile(
    r"(?P<scheme>https?)://(?P<host>[a-z0-9][a-z0-9.-]*|\[[0-9a-f:]+\])(:(?P<port>[1-9]\d{0,4}))?/?",
    re.ASCII | re.IGNORECASE,
)


def find_site(
    url: str | None, proxy: str | None, certificate: Path | None, private_key: Path | None, *, only_address: bool
) -> Site | None:
    """Return the site that other computers reach; None without --url.

    Raises
    ------
    GradingError
        If options are missing that belong to those given, or as :func:`at` does.
    """
    if private_key is not None and certificate is None:
        raise GradingError("--private-key belongs to a certificate: name it, too, by --certificate.")
    if url is not None:
        return at(url, proxy, None if only_address else certificate is not None)
    if proxy is not None or certificate is not None:
        raise GradingError("Say by --url which address the page has for other computers.")
    return None


def on_loopback(port: int) -> Site:
    """Return the site on this computer only."""
    return Site("http", f"127.0.0.1:{port}")


def at(url: str, proxy: str | None, encrypts: bool | None) -> Site:
    """Return the site of an address.

    Parameters
    ----------
    url : as "https://marks.school.edu"
    proxy : IP address of the reverse proxy
    encrypts : whether this server has a certificate; None if nothing is served

    Raises
    ------
    GradingError
        If it is no such address, or nothing encrypts what other computers send.
    """
    match = _URL.fullmatch(url)
    if match is None:
        raise GradingError(
            f"--url {url}: give an address without a path, as https://marks.school.edu. The page needs a host of its "
            "own: any other page at that address could score in an assistant's name."
        )
    scheme, port = match["scheme"].lower(), int(match["port"] or 0)
    host = match["host"].lower() + ("" if port in (0, PORTS[scheme]) else f":{port}")
    own = None if proxy is None else ip_of(proxy)
    if proxy is not None and own is None:
        raise GradingError(f"--proxy {proxy}: give the proxy's IP address, as 127.0.0.1.")
    site = Site(scheme, host, own)
    if not site.is_secure and (not LOOPBACK.fullmatch(host) or encrypts or own):
        raise GradingError(
            f"--url {url}: http:// is not encrypted. It is for localhost only, without --proxy and --certificate. "
            f"Other computers need https://."
        )
    if site.is_secure and encrypts is False and (own is None or not ipaddress.ip_address(own).is_loopback):
        raise GradingError(
            f"--url {url}: say who encrypts: --proxy 127.0.0.1 if a proxy on this computer does, or --certificate. "
            "A proxy on another computer needs both: its address, and a certificate here."
        )
    return site


def change_tokens(book: Gradebook, site: Site | None, new_token: str | None, revoke: str | None) -> None:
    """Revoke the address of a scorer; make a new one, and print it. A server that runs knows it at once.

    Raises
    ------
    GradingError
        If a new address is for nobody, or there is no site for it. Then nothing is revoked either.
    GradebookError
        If the scorer to revoke has no address. Then none is made either.
    """
    if new_token is not None and (site is None or not new_token):
        raise GradingError("Name the assistant for whom the address is, and give the page's address by --url.")
    if revoke is not None:
        book.tokens.revoke(revoke.strip())
        say(f"{revoke.strip()}'s address has ended. A page that is open with it does nothing more.")
    if new_token is not None and site is not None:
        _make_tokens(book, site, [new_token])


def _make_tokens(book: Gradebook, site: Site, names: list[str]) -> None:
    """Make a new address for each name in place of the former one, and print it."""
    for scorer in map(Scorer, names):
        book.tokens.replace(scorer.name, scorer.digest)
        say(f"{scorer.name}: {site.address(scorer.token)}")
    if names:
        typer.echo(f"A new address is shown only this once. It opens the page for {TOKEN_LASTS.days} days.")


def serve(
    desk: Desk,
    names: list[str],
    site: Site | None,
    port: int,
    browser: bool,
    course: Course,
    class_page: ClassPage,
    results: Path | None,
    certificate: Path | None,
    private_key: Path | None,
) -> None:
    """Let scorers in, print their addresses, and serve the page until it is interrupted.

    Parameters
    ----------
    desk, course, class_page : what is scored, its course, and the page of the class
    results : the folder of results; None if it is not known
    names : of the scorers
    site : that other computers reach; None for this computer alone
    port, browser : where to listen, 0 for any free port; whether to open a browser for the first scorer
    certificate, private_key : to encrypt with; None if a proxy does, or for this computer alone

    Raises
    ------
    GradingError
        If the certificate or the port cannot be used, nobody has an address, or the site's host is not confirmed.
    """
    if certificate is not None:
        check_certificate(certificate, private_key)
    own_tls = certificate is not None
    with listening(site.port if site and own_tls and not port else port, own_tls) as listener:
        port = listener.getsockname()[1]
        if site is None:
            site, find = _let_in_here(names, port, browser)
        else:
            find = _let_in(desk.book, site, names)
            where = "all interfaces" if own_tls else "127.0.0.1"
            typer.echo(f"The page is {site.url}/. The program listens on {where}, port {port}. Ctrl-C ends it.")
        run(application(desk, site, find, course, class_page, results), listener, certificate, private_key)


def _let_in_here(names: list[str], port: int, browser: bool) -> tuple[Site, Find]:
    """Print addresses on this computer, which are valid while the server runs; return who is let in."""
    site, scorers = on_loopback(port), [Scorer(name) for name in names]
    say(*(f"{scorer.name}: {site.address(scorer.token)}" for scorer in scorers))
    typer.echo("Each opens their own address, in a browser on this computer. Ctrl-C ends it; nothing is lost.")
    if browser:
        webbrowser.open(site.address(scorers[0].token))
    return site, while_it_runs(scorers)


def _confirm_own_host(site: Site) -> None:
    """Ask whether the site's host serves nothing else. Raises GradingError unless the answer is yes."""
    typer.echo(
        "A browser hardly keeps services of one host apart. Another one there, or whoever breaks into it, could read "
        "students' work or score in an assistant's name.\n"
        f"If the host of {site.url} serves nothing but this page, at any port, type yes:",
        err=True,
    )
    if sys.stdin.readline().strip().lower() != "yes":
        raise GradingError("Nothing was served. Give the page a host of its own, or use ssh -L, without --url.")


def _let_in(book: Gradebook, site: Site, names: list[str]) -> Find:
    """Print a new address for each name without a valid one; return who is let in: all with a valid one.

    Raises GradingError if nobody is named or has one, or if the site's host is not confirmed to serve nothing else.
    """
    former = book.tokens.valid()
    known = {token.actor.casefold() for token in former}
    if not names and not former:
        raise GradingError("Nobody has an address yet. Say who scores: --by NAME, once for each.")
    if site.is_secure:
        _confirm_own_host(site)
    _make_tokens(book, site, [name for name in names if name.casefold() not in known])
    for token in former:
        say(f"{token.actor} has an address, made on {token.made:%Y-%m-%d}. --new-token makes another.")
    return book.tokens.find


# --- the program that listens -----------------------------------------------------------------------------------------


def listening(port: int, everywhere: bool = False) -> socket.socket:
    """Return a socket of the loopback interface, or of all interfaces.

    Raises
    ------
    GradingError
        If the port is taken, or cannot be used.
    """
    both = everywhere and socket.has_dualstack_ipv6()
    host, family = ("" if everywhere else "127.0.0.1"), socket.AF_INET6 if both else socket.AF_INET
    try:
        return socket.create_server((host, port), family=family, dualstack_ipv6=both)
    except OSError as error:
        raise GradingError(f"Port {port} cannot be used: {error.strerror}. Name another one by --port.") from None


def check_certificate(certificate: Path, private_key: Path | None) -> None:
    """Raise GradingError if a certificate cannot be used."""
    try:
        ssl.create_default_context(ssl.Purpose.CLIENT_AUTH).load_cert_chain(certificate, private_key)
    except OSError as error:
        raise GradingError(f"The certificate {certificate} or its private key cannot be used: {error}.") from None


class _Connection(H11Protocol):
    """A connection that is closed if its client does not send a whole request within ``IDLE`` s."""

    def connection_made(self, transport: Any) -> None:
        super().connection_made(transport)
        self._wait()

    def on_response_complete(self) -> None:
        self._wait()
        super().on_response_complete()

    def _wait(self) -> None:
        self._answered = self.cycle  # the request before the one that is to come; None before the first
        self.loop.call_later(IDLE, self._close_if_idle, self.cycle)

    def _close_if_idle(self, answered: Any) -> None:
        is_idle = answered is self._answered and (self.cycle is answered or self.cycle.more_body)
        if is_idle and not self.transport.is_closing():  # else the end of an answer is still on its way
            self.transport.abort()


def run(
    app: ASGIApp, listener: socket.socket, certificate: Path | None = None, private_key: Path | None = None
) -> None:
    """Serve until it is interrupted; by TLS if there is a certificate."""
    # No log of requests: what is read would be in it. Whom to believe about who asks, the site decides.
    config = uvicorn.Config(
        app,
        http=_Connection,
        log_level="error",
        access_log=False,
        server_header=False,
        proxy_headers=False,
        lifespan="off",
        ws="none",
        workers=1,
        ssl_certfile=certificate,
        ssl_keyfile=private_key,
    )
    uvicorn.Server(config).run(sockets=[listener])
