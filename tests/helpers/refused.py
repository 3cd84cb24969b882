"""Collect the messages with which bad inputs are refused, as one text for a snapshot."""

from collections.abc import Callable, Iterable
from typing import Any

import pytest


def refused(error: type[Exception], call: Callable[..., Any], cases: Iterable[Any], *machine_dependent: object) -> str:
    """Call with each case and return all messages, each on a line.

    A case is the tuple of arguments, or the only argument. It fails for a case that is not refused. What depends on
    this machine, as paths, is written as "…".
    """
    messages = []
    for case in cases:
        try:
            call(*(case if isinstance(case, tuple) else (case,)))
        except error as raised:
            messages.append(" ".join(str(raised).split()))
        else:
            pytest.fail(f"not refused: {case!r}")
    text = "\n".join(messages)
    for words in machine_dependent:
        text = text.replace(str(words), "…")
    return text
