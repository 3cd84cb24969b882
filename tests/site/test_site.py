"""The public site, built once: no warning, no dead link, and nothing of the solutions."""

import html
import inspect
import json
import re

import pytest

pytest.importorskip("sphinx", reason="the site is built with the extra 'site'")

import make_site
from checkout import ROOT
from website import chapters, secrets

from rotflex import model

pytestmark = pytest.mark.scheduled  # `make site` itself fails on a warning, a dead link, and a secret


def solution(notebook, sign):
    """A line with this sign of what students are to write."""
    cells = json.loads((ROOT / "solutions" / f"{notebook}.ipynb").read_text(encoding="utf-8"))["cells"]
    for cell in cells:
        _before, begun, rest = "".join(cell["source"]).partition("BEGIN SOLUTION")
        for line in rest.split("\n") if begun else ():
            if sign in line:
                return line.strip()
    raise AssertionError(f"no line of a solution in {notebook} has {sign}")


def line_of(path, sign):
    """A line of a file."""
    lines = (ROOT / path).read_text(encoding="utf-8").split("\n")
    return next(line for line in lines if sign in line)


#: Something of each sort that must not be told.
PLANTS = {
    "code": lambda _kept: solution("02_finding_stiffness", "arm.m_1 * arm.L_1**2"),
    "words": lambda _kept: solution("02_finding_stiffness", "The spectrum of"),
    "key": lambda _kept: line_of("solutions/loop_checks.py", "np.shape(reached) == "),
    "tolerance": lambda _kept: (ROOT / "solutions/tolerances.py").read_text(encoding="utf-8")[-400:],
    "rubric": lambda _kept: max((ROOT / "solutions/rubric.toml").read_text(encoding="utf-8").split("\n"), key=len),
    "model": lambda _kept: inspect.getsource(model.controllability),
    "errata": lambda _kept: (ROOT / "docs/errata_answers.md").read_text(encoding="utf-8"),
    "number": lambda kept: next(digits for digits, origin in kept.numbers.items() if "06_control" in origin),
}


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    return chapters.run_before_answers(tmp_path_factory.mktemp("notebooks") / "kept")


@pytest.fixture(scope="module")
def site(run, kept, tmp_path_factory):
    """The folder of the public site. Building it fails on a warning, a dead link, and what is of the solutions."""
    folder, held = tmp_path_factory.mktemp("site"), []

    class Watched:  # made once, and it is seen that the build asks
        def found_in(self, made):
            held.append(kept.found_in(made))
            return held[-1]

    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(make_site.secrets, "of_the_course", lambda _chapters: Watched())
        assert make_site.build(folder / "site", run) == 0
    assert held == [[]]
    return folder / "site"


@pytest.fixture(scope="module")
def kept(run):
    """What may not be told, by a student's chapters as they were run for the site."""
    return secrets.of_the_course(run.values())


def test_no_page_for_instructors_is_there(site):
    forbidden = ("derivation", "errata_answers", "reference/answers", "guide/", "solutions/", "notebooks/9")
    paths = [path.relative_to(site).as_posix() for path in site.rglob("*")]
    assert not [path for path in paths if any(word in path for word in forbidden)]


@pytest.mark.parametrize("planted", PLANTS)
def test_what_is_planted_is_found(planted, site, kept, tmp_path):
    """Of each sort something that stands in the sources, in a page as Sphinx makes it: with tags, in entities."""
    text = re.sub(r"(\w+)", r"<span>\1</span>", html.escape(PLANTS[planted](kept)))
    page = (site / "docs" / "student.html").read_text(encoding="utf-8")
    (tmp_path / "student.html").write_text(page.replace("</article>", f"<p>{text}</p></article>"), encoding="utf-8")
    assert kept.found_in(tmp_path)
