"""docs/platforms.md says what holds."""

from __future__ import annotations

import re
from decimal import Decimal
from fractions import Fraction

import pytest
import typer
from checkout import ROOT
from their_exports import FILES

from rotflex import cli
from rotflex.instructor.platforms import filled, rules
from rotflex.instructor.platforms.their_file import read

TEXT = (ROOT / "docs" / "platforms.md").read_text(encoding="utf-8")


def test_each_option_that_it_names_is_there_and_each_that_is_there_is_named():
    command = typer.main.get_command(cli.app).commands["export"]
    there = {name for option in command.params for name in option.opts if name.startswith("--")}
    named = set(re.findall(r"(?<![\w-])--[a-z][a-z-]+", TEXT))
    assert named <= there and there - named <= {"--course", "--help"}


def test_each_platform_has_its_steps():
    headings = set(re.findall(r"^## (.+)$", TEXT, re.MULTILINE))
    assert {platform.split("'")[0] for platform in FILES} <= headings


def test_the_example_of_scaling_is_calculated():
    earned, out_of, mark, most = map(
        Decimal, re.search(r"(\d+) of (\d+) is (\d+) in a column out of (\d+)", TEXT).groups()
    )
    assert filled.rounded(Fraction(earned) / Fraction(out_of) * Fraction(most), 2) == mark


@pytest.mark.parametrize("platform", ["Canvas", "Moodle", "Blackboard"])
def test_the_columns_of_its_commands_are_names_that_are_understood(platform):
    section = TEXT.split(f"## {platform}\n")[1].split("\n## ")[0]
    (asked, *others) = re.findall(r'--column "([^"]+)"', section)
    export = rules.recognised(read(FILES[platform]))
    assert all(export.column(one).place == export.column("Lab 3").place for one in (asked, *others))
