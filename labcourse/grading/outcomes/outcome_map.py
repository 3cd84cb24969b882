"""The map from a course's codes to the outcomes of an accreditation: ``outcomes.toml`` in the course's folder.

It is data, to be edited: which scheme is in use, and which code gives evidence of what, differs from school to school
and from year to year. A course need not have one.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from labcourse.answers.catalogue import Catalogue
from labcourse.grading.course import OUTCOMES_FILE
from labcourse.grading.settings import are_texts, read_toml, refuse

_SECTIONS = ("scheme", "outcomes", "codes")


@dataclass(frozen=True)
class OutcomeMap:
    """Which codes give evidence of which outcomes.

    Attributes
    ----------
    scheme : name of what the outcomes are of, as of an accreditation and a year
    outcomes : key of an outcome, as "1" → its short name
    codes : code → keys of the outcomes that it gives evidence of
    """

    scheme: str
    outcomes: Mapping[str, str]
    codes: Mapping[str, tuple[str, ...]]

    def criteria(self) -> dict[str, frozenset[str]]:
        """Key of each outcome that has any → the codes that go to it, in the order of the file."""
        found = {
            outcome: frozenset(code for code, goes_to in self.codes.items() if outcome in goes_to)
            for outcome in self.outcomes
        }
        return {outcome: codes for outcome, codes in found.items() if codes}

    def notes(self, catalogue: Catalogue) -> list[str]:
        """What is worth knowing of what the map leaves out, in words; all of it may be meant."""
        without = [code for code in catalogue.outcomes if not self.codes.get(code)]
        unused = [outcome for outcome in self.outcomes if outcome not in self.criteria()]
        notes = []
        if without:
            notes.append(f"{', '.join(without)}: no outcome in {OUTCOMES_FILE}, so they are in no outcome's figures.")
        if unused:
            notes.append(
                "Of these outcomes the course gives no evidence: {outcomes}.".format(
                    outcomes="; ".join(f"{one} ({self.outcomes[one]})" for one in unused)
                )
            )
        return notes


def find(folder: Path, catalogue: Catalogue) -> OutcomeMap | None:
    """The map of the course in a folder; None if it has none.

    Its file is TOML: ``scheme``, a section ``[outcomes]`` (key = "short name"), and a section ``[codes]``
    (code = ["key", …]).

    Raises
    ------
    GradingError
        If there is one that cannot be used; the message tells each fault, and what to do.
    """
    file = folder / OUTCOMES_FILE
    try:
        found = read_toml(file)
    except FileNotFoundError:
        return None
    refuse(file, _misfits(found))
    refuse(file, _strangers(found, catalogue))
    codes = {code: tuple(dict.fromkeys(goes_to)) for code, goes_to in found["codes"].items()}
    return OutcomeMap(found["scheme"], dict(found["outcomes"]), codes)


def no_map(folder: Path) -> str:
    """What to say where levels in outcomes are asked for and the course has no map."""
    return (
        f"This course has no {OUTCOMES_FILE} in {folder}: its codes have levels, and outcomes of an "
        "accreditation have none."
    )


def listed(names: Collection[str]) -> str:
    """What there is, for who named something else."""
    return ", ".join(names) or "none"


def _misfits(found: Mapping[str, Any]) -> Iterator[str]:
    """What has another form than is expected."""
    for name in found:
        if name not in _SECTIONS:
            yield f"{name}: there is no such entry; there are {', '.join(_SECTIONS)}."
    if not _is_line(found.get("scheme")):
        yield 'scheme: it should name the scheme in a line, as in: scheme = "ABET 1–7, since 2019–20"'
    outcomes = found.get("outcomes")
    if not isinstance(outcomes, Mapping) or not outcomes or not all(map(_is_line, outcomes.values())):
        yield '[outcomes]: it should have a line for each outcome, its key and a short name, as in: 1 = "problems"'
    codes = found.get("codes")
    if not isinstance(codes, Mapping) or not all(map(are_texts, codes.values())):
        yield '[codes]: it should have a line for each code, with the keys of its outcomes, as in: A-1 = ["1"]'


def _is_line(value: object) -> bool:
    return isinstance(value, str) and bool(value.strip()) and value.isprintable()


def _strangers(found: Mapping[str, Any], catalogue: Catalogue) -> Iterator[str]:
    """Codes that the course does not have, and outcomes that the scheme does not have."""
    for code, goes_to in found["codes"].items():
        if code not in catalogue.outcomes:
            near = get_close_matches(code, catalogue.outcomes, n=1)
            meant = f" Did you mean {near[0]}?" if near else ""
            yield f"codes.{code}: the course has no such code; it has {listed(catalogue.outcomes)}.{meant}"
        for outcome in goes_to:
            if outcome not in found["outcomes"]:
                yield (
                    f"codes.{code}: there is no outcome {outcome!r} under [outcomes]; there are "
                    f"{listed(found['outcomes'])}."
                )
