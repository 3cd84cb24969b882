"""The command ``rotflex``, as a person types it."""

from typing import Any

from click.testing import Result
from typer.testing import CliRunner

from rotflex.cli import app


def rotflex(*words: object, **how: Any) -> Result:
    """Run the command with these words, in a terminal of 200 columns."""
    return CliRunner().invoke(app, [str(word) for word in words], env={"COLUMNS": "200"}, **how)


def said(done: Result) -> str:
    """What a command said, in one line."""
    return " ".join(done.output.split())
