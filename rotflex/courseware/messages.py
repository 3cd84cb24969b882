"""The one place through which messages for people go."""


def _(text: str) -> str:
    return text
