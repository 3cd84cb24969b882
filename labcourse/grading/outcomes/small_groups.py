"""Figures of small groups are not shown, nor what they could be worked out from."""

from __future__ import annotations

from collections.abc import Mapping


def withheld(sizes: Mapping[str, int], fewest: int) -> frozenset[str]:
    """The groups whose figures must not be shown, where those of all groups together are.

    Groups of too few; and, since what all groups have in common less what is shown is what is not shown, the next
    smallest ones, until those withheld have enough students between them: so there are at least two.

    Parameters
    ----------
    sizes : group → number of its students; each student is in one group. A group of none has nothing to show
    fewest : students of the smallest group that may be shown
    """
    there = sorted((size, name) for name, size in sizes.items() if size)
    hidden = [one for one in there if one[0] < fewest]
    others = there[len(hidden) :]
    while hidden and others and sum(size for size, _name in hidden) < fewest:
        hidden.append(others.pop(0))
    return frozenset(name for _size, name in hidden)
