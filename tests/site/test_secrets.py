"""Which numbers of a text the public site must not tell, without the site."""

from website import secrets


def test_numbers_of_four_significant_digits_are_telling_and_years_are_not():
    text = "1.234 V at 0.05678 s, then -21.45 and 1.2345e4; not 3.14, 0.0123, 7777, 2026 or K_1234."
    assert list(secrets.numbers(text)) == ["1234", "5678", "2145", "12345"]
