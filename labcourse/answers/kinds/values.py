"""Numbers, choices and prose."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable
from typing import Any

import numpy as np

from labcourse.answers.expressions import is_symbolic
from labcourse.answers.json_values import (
    FormError,
    NotAnswered,
    clean,
    read_dict,
    read_number,
    read_text,
    show_number,
)
from labcourse.answers.parts import YES_NO, Part
from labcourse.errors import AnswerError
from labcourse.messages import plural

LONGEST_PROSE = 5000  #: characters; two pages
#: What a notebook may leave where a text is to be written.
STUBS = ("", "...", "your answer here", "your text here")

_NUMBER_AND_UNIT = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(?![eE][-+]?\d|j\s*$)[^\W\d_].*")
_FEWEST_WORDS, _SHORT = 3, 30  # of an explanation: with fewer, and as few characters, it is asked whether that is all
_LEAST_PERCENTAGE = 0.06  # below, and above 0, a fraction is likelier; a coarse encoder gives a tenth of a per cent
DEG, REV = math.pi / 180, 2 * math.pi  # rad per degree, rad per revolution
RPM = REV / 60  # rad/s per revolution per minute
#: What a number out of range may have been given in: the factor that leads to the part's unit, and its name.
_SLIPS = {
    "rad/s": ((REV, "in hertz"), (DEG, "in degrees per second"), (RPM, "in revolutions per minute")),
    "rad": ((DEG, "in degrees"), (REV, "in revolutions")),
    "deg": ((1 / DEG, "in radians"), (360.0, "in revolutions")),
    "N·m/rad": ((1 / DEG, "per degree"), (REV**2, "computed from a frequency in hertz")),
    "kg·m²": ((1e-3, "in grams"), (1e-4, "in square centimetres"), (1e-6, "in square millimetres")),
    "s": ((1e-3, "in milliseconds"),),
    "V/rad": ((1 / DEG, "per degree"),),
}
_ANGLE_SLIPS = (
    *((factor, "off by 180/pi, as between degrees and radians") for factor in (DEG, 1 / DEG)),
    *((factor, "off by 2 pi, as between hertz and rad/s") for factor in (REV, 1 / REV)),
)
_THOUSAND = tuple((factor, "off by a factor of 1000 (milli, kilo)") for factor in (1e-3, 1e3))


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
        raise FormError("it is complex; a real number is asked for")
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
        raise NotAnswered("nothing yet")
    if isinstance(value, bool | np.bool_):
        raise FormError("it is True or False, not a number")
    if isinstance(value, str | bytes):
        found = _NUMBER_AND_UNIT.fullmatch(str(value))
        how = f"write the number alone, without quotes and unit: {found[1]}" if found else "leave out the quotes"
        raise FormError(f"it is text; {how}")
    if is_symbolic(value) and getattr(value, "free_symbols", None):
        left = ", ".join(sorted(str(symbol) for symbol in value.free_symbols))
        raise FormError(f"it still contains {left}: substitute numbers for them")
    if callable(value):
        raise FormError("it is a function: call it, and give the result")
    if not is_symbolic(value) or hasattr(value, "shape"):
        try:
            array = np.asarray(value)
        except ValueError:
            raise FormError("it is not one number") from None
        if array.size != 1:
            raise FormError(f"one number is asked for; this has {array.size} values")
        value = array.item()
        if isinstance(value, bool | str | bytes | None | type(Ellipsis)):
            return complex_number(value)
    try:
        number = complex(value)
    except (TypeError, ValueError, OverflowError):
        raise FormError(f"it is a {type(value).__name__}, not a number") from None
    if not (math.isfinite(number.real) and math.isfinite(number.imag)):
        raise FormError("it is not finite (NaN or infinite): look for a division by zero or a missing sample before it")
    return number


def encode_number(part: Part, value: Any) -> tuple[dict[str, Any], list[str]]:
    number = real_number(value)
    return {"value": number}, _plausibility(part, number)


def _plausibility(part: Part, number: float) -> list[str]:
    """A hint where a number is outside the plausible range: a likely slip of units, or just unusual."""
    if part.unit == "%" and 0 < number < _LEAST_PERCENTAGE:
        return [f"it looks like it is a fraction; give {part.unit}, unless it is really that small"]
    if part.plausible is None:
        return []
    lowest, highest = part.plausible
    if lowest <= number <= highest:
        return []
    if lowest <= -number <= highest and number:
        return ["it is negative: check the sign"]
    angular = _ANGLE_SLIPS if "rad" in part.unit or "deg" in part.unit else ()
    return [
        of_slip(number, part.plausible, part.unit, (_SLIPS.get(part.unit, ()), angular, _THOUSAND))
        or f"unusually {'large' if number > highest else 'small'} for this plant: check"
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
        slips = [name for factor, name in candidates if lowest <= number * factor <= highest]
        if slips and not unit:
            return f"it looks like it is {' or '.join(slips)}"
        if slips:
            return f"it looks like it is {' or '.join(slips)}; give {unit}"
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
        raise NotAnswered("nothing yet")
    if isinstance(value, bool | np.bool_) and part.choices == YES_NO:
        value = "yes" if value else "no"
    listed = ", ".join(repr(allowed) for allowed in part.choices)
    if not isinstance(value, str):
        raise FormError(f"it is a {type(value).__name__}; give one of {listed}")
    if _plain_word(value) in STUBS:
        raise NotAnswered("nothing yet")
    for allowed in part.choices:
        if _plain_word(value) == _plain_word(allowed):
            return {"value": allowed}, []
    raise FormError(f"it is none of {listed}")


def decode_choice(part: Part, content: Any) -> str:
    value = read_dict(part.name, content, {"kind", "value"})["value"]
    if value not in part.choices:
        raise AnswerError(f"{part.name} should be one of {', '.join(part.choices)}.")
    return str(value)


def show_choice(part: Part, content: dict[str, Any]) -> str:
    return f" = {content['value']}"


# --- prose -----------------------------------------------------------------------------------------------------------


def encode_prose(part: Part, value: Any) -> tuple[dict[str, Any], list[str]]:
    if value is None or value is Ellipsis:
        raise NotAnswered("nothing yet")
    if not isinstance(value, str):
        raise FormError(f"it is a {type(value).__name__}; write text in quotes")
    text = clean(value).strip()
    if text.casefold().rstrip(".") in STUBS or text in STUBS:
        raise NotAnswered("nothing yet")
    if len(text) > LONGEST_PROSE:
        raise FormError(f"it has {len(text)} characters; {LONGEST_PROSE} at most are kept, so shorten it")
    return {"value": text}, [hint for hint in [of_few_words(text)] if hint]


def of_few_words(text: str) -> str:
    """A question about an explanation of a word or two; "" for one that is longer, or has a formula or a picture."""
    count = len(text.split())
    if count >= _FEWEST_WORDS or len(text) > _SHORT or re.search(r"[$=]|!\[|\\\(|\\\[", text):
        return ""
    return (
        f"it is {plural(count, '{count} word', '{count} words')} long: is that all that you want to say? A "
        "person reads it"
    )


def decode_prose(part: Part, content: Any) -> str:
    return read_text(part.name, read_dict(part.name, content, {"kind", "value"})["value"], LONGEST_PROSE)


def show_prose(part: Part, content: dict[str, Any]) -> str:
    return f": {plural(len(content['value'].split()), '{count} word', '{count} words')}"
