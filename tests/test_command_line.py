"""The tree of commands: the rules that all of them follow, and the same command line for another course."""

import subprocess
import sys

import typer.main

from rotflex import cli

PANELS = ["Student", "Course", "Class", "Person", "Bench"]
TOP = typer.main.get_command(cli.app)


def offered(command):
    """The commands that a person is to use: not those that only say what stands in the place of a former one."""
    return [(name, found) for name, found in command.commands.items() if not found.hidden]


def every(command, path=()):
    """(words that name it, panel, command) of each command and of those below it."""
    for name, found in offered(command):
        if hasattr(found, "commands"):
            yield from ((words, found.rich_help_panel, one) for words, _, one in every(found, (*path, name)))
        else:
            yield " ".join((*path, name)), found.rich_help_panel, found


EVERY = {words: (panel, command) for words, panel, command in every(TOP)}


def test_each_command_is_in_a_panel_and_the_panels_are_in_the_order_of_use():
    assert list(dict.fromkeys(command.rich_help_panel for _name, command in offered(TOP))) == PANELS


def test_a_command_of_a_class_or_person_takes_its_folder_first_and_all_call_it_the_same():
    without = {"doctor"}  # which looks at the computer
    for words, (panel, command) in EVERY.items():
        places = [place for place, one in enumerate(command.params) if one.metavar == "MARKS"]
        assert places == ([0] if panel in ("Class", "Person") and words not in without else []), words


def test_without_the_courses_machinery_there_are_the_commands_of_a_bench():
    code = "import sys; sys.modules['labcourse'] = None; from rotflex import cli; cli.run()"
    for words, status, shown in ((["doctor"], 2, "--bench"), (["bench", "--help"], 0, "fit")):
        done = subprocess.run([sys.executable, "-c", code, *words], capture_output=True, text=True, check=False)
        assert done.returncode == status and shown in done.stdout + done.stderr, done.stderr
