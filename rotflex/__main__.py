"""``python -P -m rotflex``, where the command is not on the path; without ``-P``, modules of the folder come first."""

from rotflex.cli import run

if __name__ == "__main__":
    run()
