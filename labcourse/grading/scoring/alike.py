"""Answers of a class that are nearly the same, so that they can be read together, and in what each of them differs.

Similarity alone puts opposites together: of two sentences that differ in "higher" and "lower", nine in ten letters are
the same. So a group needs the same telling words, in the same order: numbers with what stands after them, signs,
symbols, brackets, negations, and words that have an opposite. Each answer is held against the first of its group, never
against one that came by way of others: else a row of small steps would lead from one answer to its contrary.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Hashable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import groupby

SIMILAR = 88.0  #: % of similarity from which on two answers are nearly the same; a few words of forty are others
_CONTEXT = 8  # words that are shown on either side of a difference; half a line


def _words(lines: str) -> frozenset[str]:
    return frozenset(lines.split())


_GREEK = {unicodedata.name(chr(code)).split()[-1].lower() for code in range(0x3B1, 0x3CA)} | {"lambda"}
_NEGATIONS = _words("""
    no not never none nothing nobody nowhere neither nor without hardly barely scarcely cannot lack lacks lacking except
    unless instead fail fails failed isnt arent wasnt werent doesnt dont didnt cant couldnt wont wouldnt hasnt havent
    hadnt shouldnt
""")
_OPPOSITES = _words("""
    more most less least fewer fewest better best worse worst further farther increase decrease reduce reduction grow
    growth shrink raise rise rises rising rose fall falls falling fell drop drops dropped gain lose loss lost add remove
    begin end before after first second third last next previous left right above below over under up down top bottom
    inside outside inner outer input output forward forwards backward backwards clockwise anticlockwise counterclockwise
    max maximum maximal min minimum minimal positive negative plus minus odd even open opened closed real imaginary
    series parallel horizontal vertical stable unstable linear nonlinear damped undamped same different equal unequal
    like unlike always sometimes often rarely only all some any every each both half double twice true false yes wrong
    correct incorrect agree disagree agrees disagrees possible impossible with alone because although despite if one two
    three four five six seven eight nine ten zero infinite finite constant variable faster attract repel push pull on
    off start stop too enough ignore include exclude ignored included excluded accelerate decelerate amplify attenuate
    overestimate underestimate overshoot undershoot improve worsen
""")
#: Adjectives whose comparatives have an opposite: "high", "higher" and "highest".
_COMPARED = _words("""
    high low large small big great little long short fast slow quick strong weak stiff soft hard heavy light near far
    close early late wide narrow steep flat deep shallow thick thin hot cold warm cool bright dark rich poor old new
    safe loud quiet sharp smooth rough loose tight simple noisy
""")
#: What two words may differ in and say the contrary: "damped" and "undamped", "overdamped" and "underdamped".
_BEGINNINGS = (
    *(("", prefix) for prefix in ("un", "in", "im", "il", "ir", "non", "dis", "de", "anti", "counter", "mis")),
    *(("over", "under"), ("in", "out"), ("up", "down"), ("pre", "post"), ("in", "de"), ("max", "min"), ("in", "ex")),
)
_ENDINGS = (("ful", "less"), ("er", "est"))

_PLAIN = str.maketrans({"\u2212": "-", "\u2013": "-", "\u2014": "-", "\u2018": "'", "\u2019": "'", "\u00b7": "*"})


def _set(how: str) -> re.Pattern[str]:
    chars = (chr(code) for code in range(0x3000))
    return re.compile("[" + "".join(one for one in chars if unicodedata.decomposition(one).startswith(how)) + "]+")


_RAISED, _LOWERED = _set("<super>"), _set("<sub>")
_TOKEN = re.compile(
    r"(?P<number>(?:\d+(?:[.,]\d+)*|\.\d+)(?:e[-+]?\d+)?(?P<unit>\s*(?:[%°‰]|\\?[^\W\d_]+(?:[/^]-?\w+)*))?)"
    r"|(?P<symbol>\\[a-z]+|[^\W\d_]+_\{?\w+\}?|[^\W\d_]\d+)"
    r"|(?P<word>[^\W\d_]+(?:'[^\W\d_]+)?)"
    r"|(?P<sign>(?<![^\W\d_])-|-(?![^\W\d_])|(?<=\b[^\W\d_])'+|[^\w\s'-])"
)
#: Unicode's signs of mathematics and others, as arrows; brackets; and what stands above a letter, as a dot.
_OF_SIGNS = frozenset(("Sm", "So", "Ps", "Pe", "Mn", "Me"))
_SIGNS = "-^/*!‖′'"  # of other categories
_PIECE = re.compile(r"\s+|\w+|[^\w\s]")


@dataclass(frozen=True)
class Piece:
    """A stretch of a text that is held against another: ``kind`` is "same", "gone" (only in the other) or "new"."""

    kind: str
    text: str


def normal(text: str) -> str:
    """Text without what does not count when answers are compared: capitals, and how much white space there is."""
    text = _LOWERED.sub(r"_\g<0>", _RAISED.sub(r"^\g<0>", text))  # else x² and x₂ were both x2
    return " ".join(unicodedata.normalize("NFKC", text).translate(_PLAIN).casefold().split())


def telling(text: str) -> tuple[str, ...]:
    """The words, numbers and signs that decide what a text says, in their order."""
    return tuple(token for token, tells in _tokens(normal(text)) if tells)


def groups(texts: Sequence[str], besides: Sequence[Hashable] = ()) -> list[tuple[int, ...]]:
    """Texts that are nearly the same, together.

    Parameters
    ----------
    texts : the answers
    besides : what else has to be equal within a group, for each text; as the pictures that came along

    Returns
    -------
    list of tuple of int
        Places in ``texts``; each is in one group, alone if no other is like it. The first of a group is the one that
        the others were compared with. Groups are in the order of their first, members in the order of the texts.
    """
    from rapidfuzz import fuzz

    found: list[list[int]] = []
    same_words: dict[Hashable, list[list[int]]] = {}
    plain = [normal(text) for text in texts]
    for place, text in enumerate(plain):
        key = (telling(text), besides[place] if besides else None)
        candidates = same_words.setdefault(key, [])
        for group in candidates:
            first = plain[group[0]]
            if first == text or (
                text and fuzz.ratio(first, text, score_cutoff=SIMILAR) >= SIMILAR and not _contrary(first, text)
            ):
                group.append(place)
                break
        else:
            candidates.append([place])
            found.append(candidates[-1])
    return [tuple(group) for group in found]


def difference(first: str, other: str) -> list[Piece]:
    """How a text differs from the first of its group, word by word; what is the same at length is cut short.

    Parameters
    ----------
    first : the text that it is compared with
    other : the text

    Returns
    -------
    list of Piece
        All of ``other``, and between it what it lacks of ``first``; stretches that are the same are shown by some
        words at either end, with "…" between. Empty if they differ in white space at most.
    """
    from rapidfuzz.distance import Indel

    one, two = (_PIECE.findall(" ".join(text.split())) for text in (first, other))
    if one == two:
        return []
    pieces: list[Piece] = []
    for equal, run in groupby(Indel.opcodes(one, two), key=lambda step: step.tag == "equal"):
        steps = list(run)
        gone = "".join(one[steps[0].src_start : steps[-1].src_end])
        new = "".join(two[steps[0].dest_start : steps[-1].dest_end])
        changed = [Piece(kind, text) for kind, text in (("gone", gone), ("new", new)) if text]
        pieces += [Piece("same", gone)] if equal else changed
    last = len(pieces) - 1
    return [
        Piece("same", _shortened(piece.text, place > 0, place < last)) if piece.kind == "same" else piece
        for place, piece in enumerate(pieces)
    ]


def _shortened(text: str, after: bool, before: bool) -> str:
    """A stretch that is the same, with the words next to the differences after or before which it stands."""
    words = re.findall(r"\s*\S+\s*", text)
    if len(words) <= _CONTEXT * (after + before) + 1:
        return text
    return "".join(words[: _CONTEXT * after]) + " … " + "".join(words[len(words) - _CONTEXT * before :])


# --- telling words ----------------------------------------------------------------------------------------------------


def _tokens(text: str) -> Iterator[tuple[str, bool]]:
    """Words, numbers and signs of a normal text, and whether each tells by itself."""
    for match in _TOKEN.finditer(text):
        token = match[0]
        if match["number"]:
            yield "".join(token.split()), True
        elif match["symbol"]:
            yield token, True
        elif match["sign"]:
            yield token, token[0] in _SIGNS or unicodedata.category(token) in _OF_SIGNS
        else:
            yield _word(token)


def _word(token: str) -> tuple[str, bool]:
    if token.endswith("n't"):
        return "not", True
    if token in _NEGATIONS or token in _with_opposite() or token in _GREEK:
        return token, True
    # A letter alone is a symbol, but for those that are English words.
    return token, len(token) == 1 and token not in "ai"


@cache
def _with_opposite() -> frozenset[str]:
    forms = {form for word in _COMPARED for form in _forms(word)}
    verbs = {word + ending for word in _OPPOSITES for ending in ("s", "d", "ed")}
    verbs |= {word.removesuffix("e") + "ing" for word in _OPPOSITES}
    return frozenset(forms | verbs | _OPPOSITES)


def _forms(word: str) -> Iterator[str]:
    """An adjective and its comparatives, in all ways of spelling them."""
    stem = word.removesuffix("e")
    yield word
    yield f"{word}ly"
    for ending in ("er", "est"):
        yield f"{stem}{ending}"
        yield f"{stem}{stem[-1]}{ending}"
        if word.endswith("y"):
            yield f"{word[:-1]}i{ending}"


def _contrary(one: str, other: str) -> bool:
    """Whether words that are each other's contrary by how they begin or end stand in them in another order."""
    first, second = ([token for token, _tells in _tokens(text)] for text in (one, other))
    pairs = _pairs(set(first) | set(second))
    return [word for word in first if word in pairs] != [word for word in second if word in pairs]


def _pairs(words: set[str]) -> set[str]:
    """Those of some words whose contrary is among them, too."""
    found: set[str] = set()
    for word in words:
        for this, that in _BEGINNINGS:
            partner = that + word[len(this) :]
            if word.startswith(this) and len(word) > len(this) + 1 and partner in words and partner != word:
                found |= {word, partner}
        for this, that in _ENDINGS:
            partner = word.removesuffix(this) + that
            if word.endswith(this) and partner in words:
                found |= {word, partner}
    return found
