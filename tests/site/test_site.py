"""The public site, built once: no warning, no dead link, nothing of the solutions, and nothing from elsewhere."""

import functools
import html
import http.server
import inspect
import json
import re
import threading

import pytest

pytest.importorskip("sphinx", reason="the site is built with the extra 'site'")

import make_site
from accessible import findings
from checkout import ROOT
from website import chapters, secrets, staging

from rotflex import model

pytestmark = pytest.mark.scheduled  # `make site` itself fails on a warning, a dead link, and a secret

#: A page of each kind: front, door, chapter, guide with tables, reference, search.
KINDS = (
    "docs/index.html",
    "docs/student.html",
    "notebooks/02_finding_stiffness.html",
    "docs/platforms.html",
    "docs/reference/experiments.html",
    "search.html",
)


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


@pytest.fixture(scope="module")
def address(site):
    class Quiet(http.server.SimpleHTTPRequestHandler):
        def log_message(self, *_arguments):
            pass

    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Quiet, directory=site)) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{server.server_port}/"
        server.shutdown()


@pytest.fixture
def visit(chromium, address):
    """Opens a page; what it asks of elsewhere, and what fails, is in the list ``wrong``."""
    contexts, wrong = [], []

    def opened(name):
        context = chromium.new_context(reduced_motion="reduce")
        contexts.append(context)
        context.route(lambda url: not url.startswith((address, "data:", "blob:")), lambda route: route.abort())
        page = context.new_page()
        page.on("request", lambda one: one.url.startswith((address, "data:", "blob:")) or wrong.append(one.url))
        page.on("response", lambda one: one.status < 400 or one.url.endswith("favicon.ico") or wrong.append(one.url))
        page.on("pageerror", lambda error: wrong.append(str(error)))
        page.goto(address + name)
        return page

    yield opened, wrong
    for context in contexts:
        context.close()


class TestPages:
    def test_every_page_of_the_documentation_is_there(self, site):
        for path in staging.DOCS.rglob("*.md"):
            name = path.relative_to(ROOT).as_posix()
            assert (site / name).with_suffix(".html").exists() != staging.is_for_instructors(name), name

    def test_every_notebook_is_a_chapter_with_pictures(self, site):
        pictures = 0
        for path in (ROOT / "notebooks").glob("*.ipynb"):
            page = (site / "notebooks" / f"{path.stem}.html").read_text(encoding="utf-8")
            assert "Loading widget" not in page
            assert "widget-view" not in page
            pictures += page.count("<img")
        assert pictures > 10


class TestSecrets:
    def test_no_page_for_instructors_is_there(self, site):
        forbidden = ("derivation", "errata_answers", "reference/answers", "guide/", "solutions/", "notebooks/9")
        paths = [path.relative_to(site).as_posix() for path in site.rglob("*")]
        assert not [path for path in paths if any(word in path for word in forbidden)]

    @pytest.mark.parametrize("planted", ["code", "words", "key", "tolerance", "rubric", "model", "errata", "number"])
    def test_what_is_planted_is_found(self, planted, site, kept, tmp_path):
        """Of each sort something that stands in the sources, in a page as Sphinx makes it: with tags, in entities."""
        text = re.sub(r"(\w+)", r"<span>\1</span>", html.escape(PLANTS[planted](kept)))
        page = (site / "docs" / "student.html").read_text(encoding="utf-8")
        (tmp_path / "student.html").write_text(page.replace("</article>", f"<p>{text}</p></article>"), encoding="utf-8")
        assert kept.found_in(tmp_path)


class TestInABrowser:
    def test_pages_are_accessible_and_ask_for_nothing_from_elsewhere(self, visit):
        opened, wrong = visit
        found = {}
        for name in KINDS:
            page = opened(name)
            page.wait_for_load_state("networkidle")
            found[name] = findings(page)
        assert found == {name: [] for name in KINDS}
        assert not wrong

    def test_formulas_are_drawn(self, visit):
        opened, wrong = visit
        for name, most in (("01_modeling_prelab", 150), ("06_control_design", 60)):
            page = opened(f"notebooks/{name}.html")
            page.wait_for_function("window.MathJax?.startup?.promise", timeout=60_000)
            page.evaluate("MathJax.startup.promise.then(() => 0)")
            assert page.locator("mjx-container svg").count() > most
            assert page.locator("[data-mml-node=merror]").count() == 0
        assert not wrong
