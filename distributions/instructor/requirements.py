"""What the instructor's distribution needs: rotflex of its own version, and libraries."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from hatchling.metadata.plugin.interface import MetadataHookInterface

_VERSION = Path(__file__).resolve().parents[2] / "rotflex" / "__init__.py"

LIBRARIES = (
    "nbformat>=5.10",
    "nbclient>=0.10",
    "papermill>=2.6",
    "jinja2>=3.1",
    "psutil>=5.9",
    "markdown-it-py>=3.0",
    "latex2mathml>=3.77",  # students' formulas as MathML, which browsers show without a script
    "sqlalchemy>=2.0",
    "alembic>=1.13",
    # The page on which persons score: the lightest server there is, two packages beside what is installed already.
    "starlette>=0.40",
    "uvicorn>=0.30",
    "rapidfuzz>=3.9",  # answers in words that are nearly the same, found in a class at once
    "openpyxl>=3.1",  # scores out and in as a spreadsheet, for who has no network
    "pypdf>=5.0",  # how many pages a student's PDF has; pure Python, and run in a sandbox only
    "typst>=0.14",  # scoring sheets as PDF, without a TeX installation or a browser
    # A graded run replaces private interfaces of these. In other versions than those that were compared with a real
    # kernel they may be others, and an answer might come out differently. The versions stand in private_interfaces.py,
    # too, which looks at each interface before anything is run; to allow another, run the tests with it.
    "ipykernel>=7.1,<7.5",
    "ipython>=9.4,<9.19",
    "jupyter_client>=8.6,<8.11",
    "matplotlib>=3.10,<3.12",
    "scipy>=1.16,<1.19",
    "sympy>=1.13,<1.15",
)


class Requirements(MetadataHookInterface):
    """Fills in the dependencies."""

    def update(self, metadata: dict[str, Any]) -> None:
        """Pin rotflex to the version that this is built of."""
        version = re.search(r'^__version__ = "([^"]+)"', _VERSION.read_text(encoding="utf-8"), re.MULTILINE)
        if version is None:
            raise ValueError(f"There is no __version__ in {_VERSION}.")
        metadata["dependencies"] = [f"rotflex=={version[1]}", *LIBRARIES]
