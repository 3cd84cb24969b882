"""Addresses of benches, as the console takes them: what a replay's address plays, a virtual bench in real time."""

from __future__ import annotations

from rotflex.recording import Recording


def replayed_at(address: str) -> Recording | None:
    """The recording of a replay's address."""
    if not address.startswith("replay:"):
        return None
    return Recording.load(address.removeprefix("replay:").partition("?")[0])


def in_real_time(address: str) -> str:
    """The address of a virtual bench on which time passes as it does for us."""
    if "clock=" in address or not address.startswith("virtual"):
        return address
    return f"{address}{'&' if '?' in address else ':?'}clock=wall"
