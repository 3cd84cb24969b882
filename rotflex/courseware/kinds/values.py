"""Numbers, choices and prose."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from typing import Any

import numpy as np

from rotflex.courseware.expressions import is_symbolic
from rotflex.courseware.json_values import (
    FormError,
    NotAnswered,
    clean,
    read_dict,
    read_number,
    read_text,
    show_number,
)
from rotflex.courseware.messages import N_, _, plural
from rotflex.courseware.parts import YES_NO, Part
from rotflex.errors import AnswerError
from rotflex.units import DEG, REV, RPM

LONGEST_PROSE = 5000  #: characters
#: What a notebook may leave where a text is to be written.
STUBS = ("", "...", "your answer here", "your text here")

_FEWEST_WORDS, _SHORT = 3, 30  # of an explanation: with fewer, and as few characters, it is asked whether that is all
_LEAST_PERCENTAGE = 0.06  # below, and above 0, a fraction is likelier; a coarse encoder gives a tenth of a per cent
#: What a number out of range may have been given in: the factor that leads to the part's unit, and its name.
_SLIPS = {
    "rad/s": ((REV, N_("in hertz")), (DEG, N_("in degrees per second")), (RPM, N_("in revolutions per minute"))),
    "rad": ((DEG, N_("in degrees")), (REV, N_("in revolutions"))),
    "deg": ((1 / DEG, N_("in radians")), (360.0, N_("in revolutions"))),
    "N·m/rad": ((1 / DEG, N_("per degree")), (REV**2, N_("computed from a frequency in hertz"))),
    "kg·m²": ((1e-3, N_("in grams")), (1e-4, N_("in square centimetres")), (1e-6, N_("in square millimetres"))),
    "s": ((1e-3, N_("in milliseconds")),),
    "V/rad": ((1 / DEG, N_("per degree")),),
}
_ANGLE_SLIPS = (
    *((factor, N_("off by 180/pi, as between degrees and radians")) for factor in (DEG, 1 / DEG)),
    *((factor, N_("off by 2 pi, as between hertz and rad/s")) for factor in (REV, 1 / REV)),
)
_THOUSAND = tuple((factor, N_("off by a factor of 1000 (milli, kilo)")) for factor in (1e-3, 1e3))


def real_number(value: Any) -> float:
    """One real number from whatever a student may have it in.

    Raises
    ------
    NotAnswered
        If it is None or ``...``.
    FormError
        If it is not one real, finite number.
    """
    number = complex_number(value)
    if abs(number.imag) > 1e-9 * abs(number):
        raise FormError(_("it is complex; a real number is asked for"))
    return number.real


def complex_number(value: Any) -> complex:
    """One number, real or complex, from whatever a student may have it in.

    Raises
    ------
    NotAnswered
        If it is None or ``...``.
    FormError
        If it is not one finite number.
    """
    if value is None or value is Ellipsis:
        raise NotAnswered(_("nothing yet"))
    if isinstance(value, bool | np.bool_):
        raise FormError(_("it is True or False, not a number"))
    if isinstance(value, str | bytes):
        raise FormError(_("it is text; leave out the quotes"))
    if is_symbolic(value) and getattr(value, "free_symbols", None):
        left = ", ".join(sorted(str(symbol) for symbol in value.free_symbols))
        raise FormError(_("it still contains {left}: substitute numbers for them").format(left=left))
    if callable(value):
        raise FormError(_("it is a function: call it, and give the result"))
    if not is_symbolic(value) or hasattr(value, "shape"):
        try:
            array = np.asarray(value)
        except ValueError:
            raise FormError(_("it is not one number")) from None
        if array.size != 1:
            raise FormError(_("one number is asked for; this has {size} values").format(size=array.size))
        value = array.item()
        if isinstance(value, bool | str | bytes | None | type(Ellipsis)):
            return complex_number(value)
    try:
        number = complex(value)
    except (TypeError, ValueError, OverflowError):
        raise FormError(_("it is a {type_name}, not a number").format(type_name=type(value).__name__)) from None
    if not (math.isfinite(number.real) and math.isfinite(number.imag)):
        raise FormError(
            _("it is not finite (NaN or infinite): look for a division by zero or a missing sample before it")
        )
    return number


def encode_number(part: Part, value: Any) -> tuple[dict[str, Any], list[str]]:
    number = real_number(value)
    return {"value": number}, _plausibility(part, number)


def _plausibility(part: Part, number: float) -> list[str]:
    """A hint where a number is outside the plausible range: a likely slip of units, or just unusual."""
    if part.unit == "%" and 0 < number < _LEAST_PERCENTAGE:
        return [_("it looks like it is a fraction; give {unit}, unless it is really that small").format(unit=part.unit)]
    if part.plausible is None:
        return []
    lowest, highest = part.plausible
    if lowest <= number <= highest:
        return []
    if lowest <= -number <= highest and number:
        return [_("it is negative: check the sign")]
    angular = _ANGLE_SLIPS if "rad" in part.unit or "deg" in part.unit else ()
    return [
        of_slip(number, part.plausible, part.unit, (_SLIPS.get(part.unit, ()), angular, _THOUSAND))
        or _("unusually {size} for this plant: check").format(size=_("large") if number > highest else _("small"))
    ]


def of_slip(
    number: float,
    plausible: tuple[float, float],
    unit: str,
    possible: Iterable[Iterable[tuple[float, str]]] | None = None,
) -> str:
    """A hint at the slip of units that would explain a number out of range; "" if none would.

    Parameters
    ----------
    number, plausible : in ``unit``
    unit : that is asked for
    possible : slips as (factor, name), the likeliest first; those of the unit itself unless given
    """
    lowest, highest = plausible
    for candidates in (_SLIPS.get(unit, ()),) if possible is None else possible:
        slips = [_(name) for factor, name in candidates if lowest <= number * factor <= highest]
        if slips and not unit:
            return _("it looks like it is {slips}").format(slips=_(" or ").join(slips))
        if slips:
            return _("it looks like it is {slips}; give {unit}").format(slips=_(" or ").join(slips), unit=unit)
    return ""


def decode_number(part: Part, content: Any) -> float:
    return read_number(part.name, read_dict(part.name, content, {"kind", "value"})["value"])


def show_number_answer(part: Part, content: dict[str, Any]) -> str:
    return f" = {show_number(content['value'])} {part.unit}".rstrip()


# --- choice ----------------------------------------------------------------------------------------------------------


def _plain_word(text: str) -> str:
    return re.sub(r"[\s_-]+", " ", text.strip().casefold()).rstrip(".")


def encode_choice(part: Part, value: Any) -> tuple[dict[str, Any], list[str]]:
    if value is None or value is Ellipsis:
        raise NotAnswered(_("nothing yet"))
    if isinstance(value, bool | np.bool_) and part.choices == YES_NO:
        value = "yes" if value else "no"
    listed = ", ".join(repr(allowed) for allowed in part.choices)
    if not isinstance(value, str):
        raise FormError(
            _("it is a {type_name}; give one of {listed}").format(type_name=type(value).__name__, listed=listed)
        )
    if _plain_word(value) in STUBS:
        raise NotAnswered(_("nothing yet"))
    for allowed in part.choices:
        if _plain_word(value) == _plain_word(allowed):
            return {"value": allowed}, []
    raise FormError(_("it is none of {listed}").format(listed=listed))


def decode_choice(part: Part, content: Any) -> str:
    value = read_dict(part.name, content, {"kind", "value"})["value"]
    if value not in part.choices:
        raise AnswerError(
            _("{name} should be one of {choices}.").format(name=part.name, choices=", ".join(part.choices))
        )
    return str(value)


def show_choice(part: Part, content: dict[str, Any]) -> str:
    return f" = {content['value']}"


# --- prose -----------------------------------------------------------------------------------------------------------


def encode_prose(part: Part, value: Any) -> tuple[dict[str, Any], list[str]]:
    if value is None or value is Ellipsis:
        raise NotAnswered(_("nothing yet"))
    if not isinstance(value, str):
        raise FormError(_("it is a {type_name}; write text in quotes").format(type_name=type(value).__name__))
    text = clean(value).strip()
    if text.casefold().rstrip(".") in STUBS or text in STUBS:
        raise NotAnswered(_("nothing yet"))
    if len(text) > LONGEST_PROSE:
        raise FormError(
            _("it has {count} characters; {longest_prose} at most are kept, so shorten it").format(
                count=len(text), longest_prose=LONGEST_PROSE
            )
        )
    return {"value": text}, [hint for hint in [of_few_words(text)] if hint]


def of_few_words(text: str) -> str:
    """A question about an explanation of a word or two; "" for one that is longer, or has a formula or a picture."""
    count = len(text.split())
    if count >= _FEWEST_WORDS or len(text) > _SHORT or re.search(r"[$=]|!\[|\\\(|\\\[", text):
        return ""
    return _("it is {words} long: is that all that you want to say? A person reads it").format(
        words=plural(count, "{count} word", "{count} words")
    )


def decode_prose(part: Part, content: Any) -> str:
    return read_text(part.name, read_dict(part.name, content, {"kind", "value"})["value"], LONGEST_PROSE)


def show_prose(part: Part, content: dict[str, Any]) -> str:
    return f": {plural(len(content['value'].split()), '{count} word', '{count} words')}"
