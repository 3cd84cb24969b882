"""Decimal numbers as they are written: a tenth is a tenth, and what is done by hand comes out the same."""

from __future__ import annotations

from decimal import Decimal, localcontext
from fractions import Fraction

_DIGITS = 100  # of a number whose decimals end; points, weights and per cents have a dozen each at most
_SHOWN = 6  # decimals of a number whose do not


def exact(number: float) -> Fraction:
    """A number as it is written: 0.1 is a tenth."""
    return Fraction(str(number))


def half_up(number: Fraction, decimals: int) -> Fraction:
    """A number that is not negative, rounded; what is halfway goes up."""
    scale = 10**decimals
    return Fraction((number * scale + Fraction(1, 2)) // 1, scale)


def in_full(number: Fraction) -> str:
    """A number with all its decimals, as "2.25"; with the first few and "…" where they do not end."""
    rest = number.denominator
    for factor in (2, 5):
        while rest % factor == 0:
            rest //= factor
    if rest != 1:
        return f"{in_full(Fraction(number * 10**_SHOWN // 1, 10**_SHOWN))}…"
    with localcontext(prec=_DIGITS):
        text = f"{Decimal(number.numerator) / Decimal(number.denominator):f}"
    return text.rstrip("0").rstrip(".") if "." in text else text


def to_decimals(number: float, decimals: int) -> str:
    """A number that was rounded to so many decimals, with all of them, as "72.30"."""
    return f"{number:.{decimals}f}"
