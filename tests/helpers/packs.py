"""Cases that touch different things are tried together; a pack that fails is taken apart, and names who is to blame."""

from collections.abc import Callable, Collection, Hashable, Iterable, Mapping
from typing import Any, TypeVar

import pytest

Case = TypeVar("Case")


def packed(cases: Iterable[Case], touched: Callable[[Case], Collection[Hashable]]) -> list[list[Case]]:
    """Put cases into few packs, in none of which two touch the same thing; those that touch most go first."""
    packs: list[tuple[list[Case], set[Hashable]]] = []
    for case in sorted(cases, key=lambda case: -len(touched(case))):
        wanted = set(touched(case))
        for pack, taken in packs:
            if not wanted & taken:
                pack.append(case)
                taken.update(wanted)
                break
        else:
            packs.append(([case], wanted))
    return [pack for pack, _ in packs]


def named(pack: list[Any]) -> str:
    """A pack's name: that of its first case, and how many others there are."""
    return f"{pack[0]} and {len(pack) - 1} more" if len(pack) > 1 else str(pack[0])


def assert_faultless(pack: list[Case], faults: Callable[[list[Case]], Mapping[str, Any]]) -> None:
    """Fail if a pack has faults, and name those of its cases that have them when they are tried alone."""
    together = faults(pack)
    if together:
        alone = {str(case): found for case in pack if (found := faults([case]))}
        pytest.fail("\n".join(f"{name}: {found}" for name, found in alone.items()) or f"only together: {together}")
