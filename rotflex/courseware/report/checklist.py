"""The format of a report held against a checklist: what a careful reader would write at the margin, before they do.

The list is the usual one for reports of laboratories: cover, all sections, numbered equations, figures and tables with
labels and captions, sources in order, one way of writing through all of it. What the texts are worth, it does not know.
"""

from __future__ import annotations

from collections.abc import Sequence

from rotflex.courseware.messages import _
from rotflex.courseware.report.checks import formulas, labels, languages, mentions, numbers, structure, wording
from rotflex.courseware.report.checks.faults import Fault, listed
from rotflex.courseware.report.checks.prose import Reading, read
from rotflex.courseware.report.document import Document, Prose

__all__ = ["LEFT_OUT", "PICTURE", "Fault", "faults", "listed", "not_looked_at"]

PICTURE = structure.PICTURE  #: the kind of a picture that is missing
LEFT_OUT = structure.LEFT_OUT  #: the kind of what could not be taken over from a text


def faults(document: Document, pages: int | None = None) -> list[Fault]:
    """What a reader would mind in the format of a report, in the order of its sections.

    What is told is meant to be certain; what can only be asked is put as a question. Nothing of it is a mark.

    Parameters
    ----------
    document : the report
    pages : that it has when it is set; None where that is not known
    """
    readings = _readings(document)
    language = languages.of([one.bare for one in readings], document.language)
    found = [
        *structure.faults(document, readings, pages),
        *labels.faults(document),
        *mentions.faults(document, readings, language is not None),
        *wording.faults(readings, language),
        *formulas.faults(readings),
        *numbers.faults(document, readings, language),
    ]
    order = {text.place: rank for rank, text in enumerate(document.texts, start=1)}
    return sorted(found, key=lambda fault: order.get(fault.place, 0))


def not_looked_at(document: Document) -> list[str]:
    """What no check is made of, in words: what needs a mind, and what needs a language that is not known here."""
    told = [_("Spelling and grammar, but for a few slips that many make: have somebody read the text.")]
    if languages.of([one.bare for one in _readings(document)], document.language) is None:
        told.append(
            _(
                "The texts are in no language that the checklist knows ({known}). So it has not looked for repeated "
                "words, "
                "misspelt words, interpretation among the results, sentences that break off, figures that no text "
                "refers "
                "to, and numbers in the text that are others than in a table."
            ).format(known=", ".join(one.name for one in languages.KNOWN.values()))
        )
    return told


def _readings(document: Document) -> Sequence[Reading]:
    return [
        read(block, section.number, section.heading)
        for section in document.sections
        for block in section.blocks
        if isinstance(block, Prose)
    ]
