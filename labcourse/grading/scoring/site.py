"""Where browsers find the scoring page: the loopback interface, or an address that other computers reach by TLS."""

from __future__ import annotations

import ipaddress
import re
from dataclasses import dataclass

from starlette.exceptions import HTTPException
from starlette.requests import Request

from labcourse.errors import GradingError

_LOOPBACK = re.compile(r"(localhost|127\.0\.0\.1|\[::1\])(:[1-9]\d{0,4})?", re.ASCII)
_URL = re.compile(
    r"(?P<scheme>https?)://(?P<host>[a-z0-9][a-z0-9.-]*|\[[0-9a-f:]+\])(:(?P<port>[1-9]\d{0,4}))?/?",
    re.ASCII | re.IGNORECASE,
)
_PORTS = {"http": 80, "https": 443}


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
        return int(port[1]) if port else _PORTS[self.scheme]

    def address(self, token: str) -> str:
        """Return the address where the owner of a token begins."""
        return f"{self.url}/enter#{token}"

    def cookie(self, request: Request) -> str:
        """Return the name of the cookie. A browser does not tell ports apart."""
        name = f"labcourse-score-{Site(self.scheme, request.headers['host']).port}"
        return f"__Host-{name}" if self.is_secure else name

    def check_host(self, request: Request) -> None:
        """Refuse a request that is not for this site, or does not come through its proxy."""
        if self.proxy is not None and _ip(request.client.host if request.client else "") != self.proxy:
            raise HTTPException(403, "This server answers to its proxy only.")
        hosts = request.headers.getlist("host")
        if len(hosts) != 1 or not (hosts[0] == self.host if self.is_secure else _LOOPBACK.fullmatch(hosts[0])):
            names = self.host if self.is_secure else "127.0.0.1, localhost and [::1]"
            raise HTTPException(421, f"This server answers to {names} only.")

    def check_origin(self, request: Request) -> None:
        """Refuse what a page of another origin sends or opens, as one at another port of this host."""
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
        return _ip(",".join(given).rpartition(",")[2].strip()) or peer


def _ip(text: str) -> str | None:
    """Return an IP address in its usual form; None for any other text."""
    try:
        address = ipaddress.ip_address(text)
    except ValueError:
        return None
    return str(getattr(address, "ipv4_mapped", None) or address)


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
    host = match["host"].lower() + ("" if port in (0, _PORTS[scheme]) else f":{port}")
    own = None if proxy is None else _ip(proxy)
    if proxy is not None and own is None:
        raise GradingError(f"--proxy {proxy}: give the proxy's IP address, as 127.0.0.1.")
    site = Site(scheme, host, own)
    if not site.is_secure and (not _LOOPBACK.fullmatch(host) or encrypts or own):
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
