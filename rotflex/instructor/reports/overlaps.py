"""What is the same in two students' texts, and in hardly anybody else's.

Texts come as tokens, the words of a language or of a program. Each run of so many tokens is a fingerprint (as in
Schleimer, Wilkerson and Aiken, "Winnowing", 2003; here all of them are kept, for a class is small). What was handed out
says nothing, and neither does what several students have: most right answers are written alike. Names that students
chose are compared by where they come again, so that another name is no other text.

Of what is left, two honest students have short pieces in common, here and there. So a pair is told where texts are the
same as a whole, or where most of what is rare in all that either wrote is the other's, too.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

MOST_ALIKE = 5  #: students who may have the same, and it says something still
ALL_BUT = 0.9  #: of what is rare in a text; then it is another's as a whole
MOST_OF_IT = 0.4  #: of what is rare in all that somebody wrote; then all of it may be another's
_UNUSUAL = 100  # of so many pairs, one may well have more in common than all others
_FEWEST_UNUSUAL = 10  # pairs; of a small class
_FACTOR = 1.5  # how much more than what is usual in a class is told
_LONGEST_EXCERPT = 160  # characters
_OWN = "\0"  # before the number of a name that a student chose


@dataclass(frozen=True, slots=True)
class Token:
    """A word of a text.

    Attributes
    ----------
    text : as it is compared
    start, end : where it stands
    own : whether it is a name that the writer chose
    """

    text: str
    start: int
    end: int
    own: bool = False


@dataclass(frozen=True)
class Piece:
    """A text, as a cell of a notebook.

    Attributes
    ----------
    place : where it stands, for people
    text : of it
    tokens : in order
    """

    place: str
    text: str
    tokens: tuple[Token, ...]


@dataclass(frozen=True)
class Author:
    """A student, and what they wrote.

    Attributes
    ----------
    student : the ID
    group : the same for all who work together
    pieces : what they wrote
    """

    student: str
    group: str
    pieces: tuple[Piece, ...]


@dataclass(frozen=True)
class Overlap:
    """What two students have in common, and hardly anybody else.

    Attributes
    ----------
    students : both, by ID
    tokens : that are the same, of the one who has fewer of them
    places : where they stand
    excerpt : the beginning of the longest run of them, as the first of the two wrote it
    """

    students: tuple[str, str]
    tokens: int
    places: tuple[str, ...]
    excerpt: str


Print = int  # a hash: of two runs of tokens that differ, it is the same once in 10¹⁹ times


def overlaps(
    everybody: Sequence[Author], handed_out: Iterable[Sequence[Token]], window: int, fewest: int
) -> list[Overlap]:
    """What pairs of students have in common, the most first.

    Parameters
    ----------
    everybody : of the class
    handed_out : what says nothing
    window : tokens of a fingerprint
    fewest : tokens in common that are told; in a class that writes much alike, more are needed
    """
    known = {one for tokens in handed_out for one in prints(tokens, window)}
    having: dict[Print, list[int]] = {}
    placed = [_placed(author, window, known) for author in everybody]
    for number, one in enumerate(placed):
        for each in one:
            having.setdefault(each, []).append(number)
    groups = [author.group for author in everybody]
    rare = {each for each, those in having.items() if len({groups[one] for one in those}) <= MOST_ALIKE}
    shared: dict[tuple[int, int], list[Print]] = {}
    for each in rare:
        for pair in combinations(having[each], 2):
            if groups[pair[0]] != groups[pair[1]]:
                shared.setdefault(pair, []).append(each)
    prepared = [_Rare(author, window, one, rare) for author, one in zip(everybody, placed, strict=True)]
    pairs = [_Pair(prepared[one], prepared[other], same) for (one, other), same in shared.items()]
    enough = max(fewest, _FACTOR * _usual([one.whole for one in pairs], len(everybody)))
    told = [one.overlap() for one in pairs if one.whole >= enough or (one.share >= MOST_OF_IT and one.tokens >= fewest)]
    return sorted(told, key=lambda one: (-one.tokens, one.students))


def _usual(tokens: Sequence[int], size: int) -> int:
    """What a pair of a class of this size may have in common by chance: what all pairs have but a few.

    Should students of a class write much alike, for they were shown how, none of them is told for it.
    """
    place = max(_FEWEST_UNUSUAL, size * (size - 1) // 2 // _UNUSUAL)
    return sorted(tokens, reverse=True)[place] if place < len(tokens) else 0


def prints(tokens: Sequence[Token], window: int) -> Iterator[Print]:
    """The fingerprints of a text, in order: the first begins at its first token, the second at its second."""
    for start in range(len(tokens) - window + 1):
        numbers: dict[str, str] = {}
        run = tokens[start : start + window]
        yield hash(tuple(numbers.setdefault(one.text, f"{_OWN}{len(numbers)}") if one.own else one.text for one in run))


Places = Mapping[Print, Sequence[tuple[int, int]]]  # fingerprint → numbers of the piece, and of the token in it


def _placed(author: Author, window: int, known: Collection[Print]) -> Places:
    found: dict[Print, list[tuple[int, int]]] = {}
    for number, piece in enumerate(author.pieces):
        for start, one in enumerate(prints(piece.tokens, window)):
            if one not in known:
                found.setdefault(one, []).append((number, start))
    return found


class _Rare:
    """What is rare in a student's pieces; ``tokens`` is the number of the piece → how many tokens of it are."""

    def __init__(self, author: Author, window: int, places: Places, rare: Collection[Print]) -> None:
        self.author, self._window = author, window
        self._places = {each: found for each, found in places.items() if each in rare}
        self.tokens = self.covered(self.runs(self._places))

    def runs(self, some: Iterable[Print]) -> list[tuple[int, int, int]]:
        """Where fingerprints stand: number of the piece, first token, and the one after the last."""
        found: list[tuple[int, int, int]] = []
        for piece, start in sorted({place for one in some for place in self._places[one]}):
            if found and found[-1][0] == piece and start <= found[-1][2]:
                found[-1] = (piece, found[-1][1], start + self._window)
            else:
                found.append((piece, start, start + self._window))
        return found

    @staticmethod
    def covered(runs: Iterable[tuple[int, int, int]]) -> dict[int, int]:
        """Number of the piece → how many of its tokens are in some runs."""
        found: dict[int, int] = {}
        for piece, start, end in runs:
            found[piece] = found.get(piece, 0) + end - start
        return found


class _Pair:
    """Two students; each number is that of the one who has less.

    Attributes
    ----------
    tokens : in common
    whole : of these, in pieces that are the same as a whole
    share : how much the tokens are of all that is rare in what somebody wrote
    """

    def __init__(self, one: _Rare, other: _Rare, same: Sequence[Print]) -> None:
        self._one, self._other = one, other
        self._runs = one.runs(same)
        sides = [(each, each.covered(each.runs(same))) for each in (one, other)]
        self.tokens = min(sum(covered.values()) for _each, covered in sides)
        self.share = min(sum(covered.values()) / sum(each.tokens.values()) for each, covered in sides)
        self.whole = min(
            sum(tokens for piece, tokens in covered.items() if tokens >= ALL_BUT * each.tokens[piece])
            for each, covered in sides
        )

    def overlap(self) -> Overlap:
        """What there is to tell of it."""
        pieces = self._one.author.pieces
        number, start, end = max(self._runs, key=lambda run: run[2] - run[1])
        piece = pieces[number]
        words = " ".join(piece.text[piece.tokens[start].start : piece.tokens[end - 1].end].split())
        return Overlap(
            (self._one.author.student, self._other.author.student),
            self.tokens,
            tuple(dict.fromkeys(pieces[run[0]].place for run in self._runs)),
            words if len(words) <= _LONGEST_EXCERPT else f"{words[:_LONGEST_EXCERPT]}…",
        )
