"""Texts that a regular expression can read in very many ways: its own pieces, repeated.

And a limit on processor time.
"""

import os
import signal
import sys
import traceback
from re import _constants as kind
from re import _parser as parser

COMMON = " a1\t\n_=-+.,;:(){}[]<>\\$!\"'*#/A\xa0"
CATEGORIES = {kind.CATEGORY_DIGIT: "1", kind.CATEGORY_SPACE: " \n", kind.CATEGORY_WORD: "a1_"}
REPEATS = (kind.MAX_REPEAT, kind.MIN_REPEAT, kind.POSSESSIVE_REPEAT)
MOST = 5  # s of processor time of each pattern, and of each loop over a student's files


def _signs(items):
    """Characters of a set; of one that excludes, all common ones."""
    if items[0][0] is kind.NEGATE:
        return COMMON
    found = ""
    for what, value in items:
        found += chr(value) if what is kind.LITERAL else chr(value[0]) if what is kind.RANGE else ""
        found += CATEGORIES.get(value, COMMON) if what is kind.CATEGORY else ""
    return "".join(dict.fromkeys(found))


def _parts(what, value):
    """The sequences within a piece of a pattern."""
    if what in REPEATS:
        return [value[2]]
    if what is kind.SUBPATTERN:
        return [value[3]]
    if what is kind.BRANCH:
        return value[1]
    if what in (kind.ASSERT, kind.ASSERT_NOT):
        return [value[1]]
    return [value] if what is kind.ATOMIC_GROUP else []


def _sample(nodes):
    """A text that a sequence matches, or nearly so."""
    text = ""
    for what, value in nodes:
        if what is kind.LITERAL:
            text += chr(value)
        elif what is kind.IN:
            text += _signs(value)[0]
        elif what in (kind.ANY, kind.NOT_LITERAL):
            text += "a"
        elif what not in (kind.ASSERT, kind.ASSERT_NOT) and (parts := _parts(what, value)):
            text += _sample(parts[0]) * (max(value[0], 1) if what in REPEATS else 1)
    return text


def _pieces(nodes, before=""):
    """What can be repeated, and what stands before it."""
    for place, (what, value) in enumerate(nodes):
        for end in range(place + 1, min(len(nodes), place + 4) + 1):
            yield before, _sample(nodes[place:end])
        if what in (kind.IN, kind.ANY, kind.NOT_LITERAL):
            yield from ((before, sign) for sign in (_signs(value) if what is kind.IN else COMMON))
        for part in _parts(what, value):
            yield from _pieces(list(part), before)
        before += _sample([(what, value)])


def repeated(pattern):
    """(before, piece, after): texts for a pattern are ``before + piece * many + after``."""
    text = pattern.pattern if isinstance(pattern.pattern, str) else pattern.pattern.decode("latin-1")
    nodes = list(parser.parse(text, pattern.flags & ~256 if pattern.flags & 256 else pattern.flags))
    found = [(before, piece) for before, piece in _pieces(nodes) if piece]
    single = dict.fromkeys(piece for _before, piece in found if len(piece) == 1)
    found += [("", _sample(nodes) or " "), *(("", one + other) for one in [*single][:8] for other in [*single][:8])]
    starts = dict.fromkeys([*found, *(("", piece) for _before, piece in found), ("x", " "), ("x", "\n")])
    return [(*one, after) for one in starts for after in ("", "\x01")]


def within(act, seconds=MOST):
    """Run a function in a process of its own with a limit on its processor time; its errors are printed."""
    import resource

    sys.stdout.flush()
    process = os.fork()
    if process == 0:
        code = 1
        try:
            resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds))
            act()
            code = 0
        except BaseException:
            traceback.print_exc()
        finally:
            os._exit(code)
    status = os.waitpid(process, 0)[1]
    stopped = os.WIFSIGNALED(status) and os.WTERMSIG(status) in (signal.SIGXCPU, signal.SIGKILL)
    assert not stopped, f"it took more than {seconds} s of processor time"
    assert status == 0, "it failed; its error is printed above"
