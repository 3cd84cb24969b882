"""The public site, built once: no warning, no dead link, nothing of the solutions, and nothing from elsewhere."""

from __future__ import annotations

import functools
import http.server
import threading
from pathlib import Path
from urllib.parse import urlsplit

import pytest

pytest.importorskip("sphinx", reason="the site is built with the extra 'site'")

import make_site
from accessible import findings
from checkout import ROOT
from website import chapters, secrets, staging
from website.built import Built

pytestmark = pytest.mark.slow

CHROMIUM = Path("/usr/bin/chromium")
#: A page of each kind: front, door, chapter, guide with tables, reference, search.
KINDS = (
    "index.html",
    "student.html",
    "chapters/02_finding_stiffness.html",
    "class/platforms.html",
    "reference/experiments.html",
    "search.html",
)
MOST_CLICKS = 3


@pytest.fixture(scope="session")
def site(tmp_path_factory):
    """The folder of the public site. Building it fails on a warning, a dead link, and what is of the solutions."""
    folder = tmp_path_factory.mktemp("site")
    assert make_site.build(folder / "site", kept=folder / "notebooks") == 0
    return folder / "site"


@pytest.fixture(scope="session")
def built(site):
    return Built(site)


@pytest.fixture(scope="session")
def kept(site):
    """What may not be told, by a student's chapters as they were run for the site."""
    return secrets.Secrets.of_the_course(chapters.run_before_answers(site.parent / "notebooks").values())


@pytest.fixture(scope="session")
def address(site):
    class Quiet(http.server.SimpleHTTPRequestHandler):
        def log_message(self, *_arguments):
            pass

    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Quiet, directory=site)) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{server.server_port}/"
        server.shutdown()


@pytest.fixture(scope="module")
def browser():
    if not CHROMIUM.exists():
        pytest.skip(f"there is no {CHROMIUM}")
    sync_api = pytest.importorskip("playwright.sync_api")
    with sync_api.sync_playwright() as playwright:
        launched = playwright.chromium.launch(executable_path=str(CHROMIUM), args=["--no-sandbox"])
        yield launched
        launched.close()


@pytest.fixture
def visit(browser, address):
    """Opens a page, in a scheme of colours; what it asks of elsewhere, and what fails, is in the list ``wrong``."""
    contexts, wrong = [], []

    def opened(name, scheme="light"):
        context = browser.new_context(color_scheme=scheme, reduced_motion="reduce")
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
    def test_no_link_is_dead(self, built):
        assert not built.dead()
        assert sum(1 for page in built.pages for _link in built.targets(page)) > 1000

    def test_every_page_is_near_the_front(self, built):
        clicks = built.clicks()
        assert set(clicks) == set(built.pages)
        assert max(clicks.values()) <= MOST_CLICKS

    def test_every_page_of_the_documentation_is_there(self, built):
        """A page that somebody adds to docs/ appears, unless it is named as one for instructors."""
        for path in staging.DOCS.rglob("*.md"):
            name = path.relative_to(staging.DOCS).as_posix()
            if not staging.is_for_instructors(f"docs/{name}"):
                assert any(page.endswith(f"{path.stem}.html") for page in built.pages), name

    def test_every_notebook_is_a_chapter_with_pictures(self, site):
        for path in (ROOT / "notebooks").glob("*.ipynb"):
            page = (site / "chapters" / f"{path.stem}.html").read_text(encoding="utf-8")
            assert "Loading widget" not in page
            assert "widget-view" not in page
            assert page.count("<img") or path.stem.endswith("_results")

    def test_links_that_leave_are_few_and_known(self, built):
        hosts = {urlsplit(link).hostname for link in built.outside}
        assert hosts <= {"nbdime.readthedocs.io", "github.com", "pradyunsg.me", "www.sphinx-doc.org"}


class TestSecrets:
    def test_no_page_for_instructors_is_there(self, built):
        forbidden = ("derivation", "errata_answers", "reference/answers", "guide/", "solutions/", "chapters/9")
        assert not [page for page in built.pages if any(word in page for word in forbidden)]

    def test_nothing_of_the_solutions_is_told(self, site, kept):
        assert not kept.found_in(site)

    @pytest.mark.parametrize(
        "planted",
        [
            "A = sympy.Matrix([[0, 0, 1, 0]])  # of a solution",
            "first companion gain 480000",
        ],
    )
    def test_what_is_planted_is_found(self, planted, site, kept, tmp_path):
        """A line that is in a solution, and a number that a solution prints."""
        line = next(run for run in kept.runs if len(run.split()) < secrets.RUN)
        number = next(iter(kept.numbers))
        text = line if "sympy" in planted else f"the value is {number[0]}.{number[1:]}"
        (tmp_path / "page.html").write_text(f"<p>{text}</p>", encoding="utf-8")
        assert kept.found_in(tmp_path)
