"""``python -m rotflex``, where the command is not on the path."""

from rotflex.cli import app

if __name__ == "__main__":
    app(prog_name="rotflex")
