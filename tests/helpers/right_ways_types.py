"""What a way of answering is, and stand-ins for what other packages' tables and quantities are to numpy."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from working_through import Change, Where

#: (the usual answer, all usual answers) → another right one
Written = Callable[[Any, Mapping[Where, Any]], Any]


@dataclass(frozen=True)
class Way:
    """A way of answering that is right.

    Attributes
    ----------
    group, what : in words
    written : how some answers are given in place of the usual ones; nothing else changes
    carried : from a session, what is done otherwise, and carried on into all that builds on it
    """

    group: str
    what: str
    written: Mapping[Where, Written] = field(default_factory=dict)
    carried: Callable[[Any], Mapping[Where, Change]] | None = None

    def __str__(self) -> str:
        return f"{self.group}: {self.what}"


class Ways(list[Way]):
    """Ways of one group, as they are written down."""

    def __init__(self, group: str) -> None:
        super().__init__()
        self.group = group

    def add(self, what: str, written: Mapping[Where, Written]) -> None:
        self.append(Way(self.group, what, written))

    def each_of(self, wheres: Iterable[Where], changes: Mapping[str, Change]) -> None:
        """For each change, a way in which all of these answers are changed."""
        wheres = tuple(wheres)
        for what, change in changes.items():
            self.add(what, dict.fromkeys(wheres, lambda value, own, change=change: change(value)))

    def carry(self, what: str, carried: Callable[[Any], Mapping[Where, Change]]) -> None:
        self.append(Way(self.group, what, carried=carried))


class Frame:
    """As a table of pandas is to whoever does not know pandas: it goes through its columns' names, and is an array."""

    def __init__(self, values: Any) -> None:
        self._values = np.array(values)
        self.shape = self._values.shape

    def __len__(self) -> int:
        return int(self.shape[0])

    def __iter__(self) -> Any:
        return iter(f"column {i}" for i in range(self.shape[-1]))

    def __getitem__(self, name: Any) -> Any:
        raise KeyError(name)

    def __array__(self, dtype: Any = None, copy: Any = None) -> Any:
        return self._values.astype(dtype) if dtype is not None else self._values.copy()


class Quantity:
    """As a number with a unit of a package for units: an array of no dimension, no float."""

    def __init__(self, magnitude: float) -> None:
        self.magnitude = magnitude

    def __array__(self, dtype: Any = None, copy: Any = None) -> Any:
        return np.array(self.magnitude, dtype=dtype)
