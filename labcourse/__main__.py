"""``python -m labcourse``: the command."""

from labcourse.command_line import run

run()
