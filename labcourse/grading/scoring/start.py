"""Start the scoring page: which site it is, who is let in, and the addresses that scorers open."""

from __future__ import annotations

import sys
import webbrowser
from pathlib import Path

import typer

from labcourse.errors import GradingError
from labcourse.grading.course import Course
from labcourse.grading.gradebook import Gradebook
from labcourse.grading.gradebook.records import TOKEN_LASTS
from labcourse.grading.scoring import server
from labcourse.grading.scoring.desk import Desk
from labcourse.grading.scoring.guards import Find, Scorer, while_it_runs
from labcourse.grading.scoring.site import Site, at, on_loopback
from labcourse.safe_text import say


def find_site(
    url: str | None, proxy: str | None, certificate: Path | None, private_key: Path | None, *, only_address: bool
) -> Site | None:
    """Return the site that other computers reach; None without --url."""
    if private_key is not None and certificate is None:
        raise GradingError("--private-key belongs to a certificate: name it, too, by --certificate.")
    if url is not None:
        return at(url, proxy, None if only_address else certificate is not None)
    if proxy is not None or certificate is not None:
        raise GradingError("Say by --url which address the page has for other computers.")
    return None


def change_tokens(book: Gradebook, site: Site | None, new_token: str | None, revoke: str | None) -> None:
    """Revoke the address of a scorer; make a new one, and print it. A server that runs knows it at once."""
    if revoke is not None:
        book.tokens.revoke(revoke.strip())
        say(f"{revoke.strip()}'s address has ended. A page that is open with it does nothing more.")
    if new_token is not None:
        if site is None or not new_token:
            raise GradingError("Name the assistant for whom the address is, and give the page's address by --url.")
        _make_tokens(book, site, [new_token])


def _make_tokens(book: Gradebook, site: Site, names: list[str]) -> None:
    """Make a new address for each name, and print it."""
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
    class_page: server.ClassPage,
    certificate: Path | None,
    private_key: Path | None,
) -> None:
    """Let scorers in, print their addresses, and serve the page until it is interrupted.

    Parameters
    ----------
    desk, course, class_page : what is scored, its course, and the page of the class
    names : of the scorers
    site : that other computers reach; None for this computer alone
    port, browser : where to listen, 0 for any free port; whether to open a browser for the first scorer
    certificate, private_key : to encrypt with; None if a proxy does, or for this computer alone
    """
    if certificate is not None:
        server.check_certificate(certificate, private_key)
    own_tls = certificate is not None
    with server.listening(site.port if site and own_tls and not port else port, own_tls) as listener:
        port = listener.getsockname()[1]
        if site is None:
            site, find = _let_in_here(names, port, browser)
        else:
            find = _let_in(desk.book, site, names)
            where = "all interfaces" if own_tls else "127.0.0.1"
            typer.echo(f"The page is {site.url}/. The program listens on {where}, port {port}. Ctrl-C ends it.")
        made = server.application(desk, site, find, course, class_page)
        server.serve(made, listener, certificate, private_key)


def _let_in_here(names: list[str], port: int, browser: bool) -> tuple[Site, Find]:
    """Print addresses on this computer, which are valid while the server runs; return who is let in."""
    site, scorers = on_loopback(port), [Scorer(name) for name in names]
    addresses = [site.address(scorer.token) for scorer in scorers]
    say(*(f"{name}: {address}" for name, address in zip(names, addresses, strict=True)))
    typer.echo("Each opens their own address, in a browser on this computer. Ctrl-C ends it; nothing is lost.")
    if browser:
        webbrowser.open(addresses[0])
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
    """Print a new address for each name without a valid one; return who is let in: all with a valid one."""
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
