"""Check the page's scripts by oxlint, the explorers' as the one module that a page gets (rules: .oxlintrc.json).

    python tools/check_scripts.py

Each script uses what the others define: apart, every such name would look as if it were defined nowhere, or used
nowhere. What is found is told by script and line.
"""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
import sysconfig
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
RULES = ROOT / ".oxlintrc.json"


@dataclass(frozen=True)
class Finding:
    """What is wrong, and where; line and column count from 1."""

    script: str
    line: int
    column: int
    message: str
    rule: str

    def __str__(self) -> str:
        return f"{self.script}:{self.line}:{self.column}: {self.message} [{self.rule}]"


def findings(scripts: Sequence[Path]) -> list[Finding]:
    """What oxlint finds in scripts that are joined, in this order, by a new line between each two.

    Raises
    ------
    RuntimeError
        If oxlint is not installed or does not work; the message is its own.
    """
    oxlint = shutil.which("oxlint", path=sysconfig.get_path("scripts")) or shutil.which("oxlint")
    if oxlint is None:
        raise RuntimeError("oxlint is not installed: pip install oxlint")
    texts = [script.read_text(encoding="utf-8") for script in scripts]
    with tempfile.TemporaryDirectory() as folder:
        joined = Path(folder, "joined.js")
        joined.write_text("\n".join(texts), encoding="utf-8")
        command = [oxlint, "--config", str(RULES), "--format", "json", str(joined)]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
    try:
        told = json.loads(done.stdout)
    except ValueError:
        raise RuntimeError(f"oxlint did not work: {done.stdout}{done.stderr}") from None
    if told["number_of_files"] != 1:
        raise RuntimeError("oxlint has not looked at the scripts.")
    starts = [0]  # lines before each script
    for text in texts:
        starts.append(starts[-1] + text.count("\n") + 1)
    return sorted(
        (_finding(one, scripts, starts) for one in told["diagnostics"]), key=lambda one: (one.script, one.line)
    )


def _finding(told: dict, scripts: Sequence[Path], starts: list[int]) -> Finding:
    where = told["labels"][0]["span"] if told["labels"] else {"line": 1, "column": 1}
    number = max(i for i, start in enumerate(starts[:-1]) if start < where["line"])
    script = scripts[number].resolve()
    name = str(script.relative_to(ROOT)) if script.is_relative_to(ROOT) else str(script)
    return Finding(name, where["line"] - starts[number], where["column"], told["message"], told.get("code", "syntax"))


def main() -> int:
    """Tell what is found; 0 if nothing is."""
    from labcourse.files import LAB_EXTENSIONS
    from labcourse.scene import live

    modules = [live._SCRIPTS, ("course_bar.js",)]
    modules = [[Path(live.__file__).with_name(name) for name in names] for names in modules]
    pages = [[path] for path in sorted((ROOT / "tools" / "website" / "page").glob("*.js"))]
    found = [one for scripts in (*modules, [*LAB_EXTENSIONS.rglob("*.js")], *pages) for one in findings(scripts)]
    for one in found:
        print(one)
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
