"""What axe-core finds on a page that keeps somebody from using it."""

from importlib import resources
from typing import Any

_RUN = "async () => (await axe.run(document)).violations.filter((one) => ['serious', 'critical'].includes(one.impact))"


def findings(page: Any) -> list[tuple[str, list[str]]]:
    """Serious and critical findings on a page of playwright's, as it is now: what, and where."""
    page.evaluate(resources.files("axe_playwright_python").joinpath("axe.min.js").read_text(encoding="utf-8"))
    return [(one["id"], [node["html"] for node in one["nodes"]]) for one in page.evaluate(_RUN)]
