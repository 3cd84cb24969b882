"""What students read goes through gettext: nothing in the source, in a page or in a script says it by itself."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

import messages
import pytest
import unsaid
from checkout import ROOT

SCRIPTS = sorted((ROOT / "rotflex" / "courseware" / "scene").glob("*.js"))
PAGES = sorted(path for domain in messages.DOMAINS for path in domain.files() if path.suffix == ".html")
MODULES = sorted(path for domain in messages.DOMAINS for path in domain.files() if path.suffix == ".py")

#: What is no message though it has words: where (a file, or a folder) → texts, and why.
NO_MESSAGES = {
    "rotflex": r"rotflex:? ?\{.*|<[A-Z]\w+: .*>",  # the program's name before a version or a message; a repr
    "rotflex/__init__.py": "module .*",  # as Python itself says it
    "rotflex/courseware/catalogue.py": ".*, as a whole",  # a number of what is judged: marks are known by it
    "rotflex/courseware/figure_words.py": "GREEK .*",  # a name in Unicode
    "rotflex/courseware/kinds/values.py": "your (answer|text) here",  # what a notebook may leave
    "rotflex/courseware/pictures.py": "DejaVu Sans",
    "rotflex/courseware/jupyterlab.py": "token .*",  # of a web request
    "rotflex/courseware/report/attaching.py": "%pip install .*",
    "rotflex/courseware/report/composing.py": "Figure {}",  # what a caption may be written behind, in any language
    "rotflex/courseware/report/dress.py": r"\\quad ",  # LaTeX
    "rotflex/courseware/report/entries.py": r"\{\} \\cdot .*|GREEK .*",  # LaTeX; a name in Unicode
    "rotflex/courseware/report/writing.py": "#let .*",  # typst
    "rotflex/courseware/report_files.py": r"\[PDF: .*",  # by which a mark knows it
    "rotflex/courseware/reports.py": r"\*not written yet\*",  # by which a mark knows it
    "rotflex/courseware/run/alignment.py": "of another kind",  # a value
    "rotflex/courseware/run/check.py": "import .*|in a PDF",  # code; a value
    "rotflex/courseware/run/execute.py": r"timed out|#.*|def .*|del .*| +.*",  # a value; code
    "rotflex/courseware/run/update.py": "# Your code here.",  # of a notebook
    "rotflex/courseware/tables.py": "(text-align|font-family): .*",
    "rotflex/experiments.py": "free decay",  # what a recording says of itself
    "rotflex/figures": "offset points|axes fraction|_the same",
    "rotflex/hil/kinds.py": "(Quanser|NI) .*|serial board",  # names of products
    "rotflex/hil/loop.py": "virtual bench",  # what a recording says of itself
    "rotflex/hil/replay.py": "the recording",  # a name in an identity, which answers are held against
    "rotflex/hil/student_benches.py": "rotflex bench: .*",  # what a bench is drawn from
    # Numbers and choices, by which answers are known.
    "rotflex/workbook": "Table [23]|(Modeling|Control) report|marginally stable|about (the same|as long)|less long",
    "rotflex/workbook/probes.py": "compound sines|plant parameters",  # names of probes
    "rotflex/workbook/questions.py": "[a-z -]+",  # what outcomes mean, for instructors
    "rotflex/workbook/reflection/model.py": "it runs away",  # nobody is told
    "rotflex/instructor/release/student_course.py": ".* = .*",  # TOML
    "rotflex/instructor/running/intake/finding.py": "Participant .*",  # as Moodle writes it
    "rotflex/instructor/running/page_counter.py": "pypdf is not installed",  # a value
    "rotflex/instructor/running/runner.py": "mkdir .*",
    "solutions": "Table [23]|marginally stable",  # values
}


@cache
def found_in(path: Path) -> tuple[unsaid.Found, ...]:
    return tuple(unsaid.found_in(path.read_text(encoding="utf-8")))


def is_no_message(path: str, text: str) -> bool:
    places = [path, *(str(folder) for folder in (ROOT / path).relative_to(ROOT).parents)]
    return any(re.fullmatch(NO_MESSAGES[place], text, re.DOTALL) for place in places if place in NO_MESSAGES)


@pytest.mark.parametrize("path", MODULES, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_a_module_says_everything_in_the_readers_language(path):
    name = path.relative_to(ROOT).as_posix()
    found = [one for one in found_in(path) if not is_no_message(name, one.text)]
    assert found == []


def test_what_is_no_message_is_there():
    """An exception that nothing needs is one for what comes."""
    sources = {place: [path for path in MODULES if _is_within(path, place)] for place in NO_MESSAGES}
    for place, paths in sources.items():
        texts = [one.text for path in paths for one in found_in(path)]
        assert any(re.fullmatch(NO_MESSAGES[place], text, re.DOTALL) for text in texts), place


def _is_within(path, place: str) -> bool:
    return path == ROOT / place or (ROOT / place) in path.parents


@pytest.mark.parametrize(
    ("source", "what"),
    [
        ('raise AnswerError("There is none.")', "is not translated"),
        ('raise AnswerError(f"There is no {name}.")', "is not translated"),
        ('def f():\n    return _(f"There is no {name}.")', "is made before it is looked up"),
        ('def f():\n    return _("There is no " + name)', "is made before it is looked up"),
        ('def f():\n    return _("There is no {n}.".format(n=n))', "is made before it is looked up"),
        ('def f():\n    return plural(n, f"{n} curve", "{count} curves")', "is made before it is looked up"),
        ('def f():\n    return _("There is none." if none else MANY)', "is not gathered"),
        ('def f():\n    return _(found or "none")', "is not gathered"),
        ('NONE = _("There is none.")', "is said while the module is imported"),
        ('def f(why=_("There is none.")):\n    pass', "is said while the module is imported"),
        ('NONE = N_("There is no {n}.")\ndef f():\n    return NONE.format(n=n)', "is marked, and not said"),
        ('Button("start", "Start")', "is shown by Button, and not translated"),
        ('axes.plot(x, y, label="measured")', "is shown by plot, and not translated"),
        ('axes.set_xlabel("time (s)")', "is not translated"),
        ('Row("state", ("stopped" if late else "connected",))', "is shown by Row, and not translated"),
        ('LOOKS = {"a": N_("all of it"), "b": "nothing"}', "stands among messages, and is none"),
        ('print("Stopped.")', "is shown by print, and not translated"),
        ('def f():\n    for _ in range(3):\n        g(_("There is none."))', "is said where _ is something else"),
    ],
)
def test_what_would_not_be_translated_is_found(source, what):
    assert what in {one.what for one in unsaid.found_in(source)}


@pytest.mark.parametrize(
    "source",
    [
        '"""A docstring with words."""',
        'def f():\n    return _("There is no {name}.").format(name=name)',
        'NONE = N_("There is none.")\ndef f():\n    return _(NONE)',
        'LINES = {"where there is none": N_("There is none.")}',
        'def f():\n    return plural(n, "{count} curve", "{count} curves")',
        'color = axes.plot(x, y, label=r"$\\theta$ (deg)")',
        'if "is not there" in told:\n    pass',
        'Slider("f", "θ", "deg")',
        'unit = f"{value:.3g} deg"',
        're.compile("one word after the other")',
        "markup = f'<th scope=\"col\">{name}</th>'",
    ],
)
def test_what_is_translated_or_no_text_for_people_is_not_found(source):
    assert list(unsaid.found_in(source)) == []


# --- pages ------------------------------------------------------------------------------------------------------------

_SAID_BY_PYTHON = re.compile(r"\{\{.*?\}\}|\{%.*?%\}|\{#.*?#\}", re.DOTALL)
_IN_ATTRIBUTES = re.compile(r'\b(?:title|alt|aria-label)="([^"]*)"')


def words_of(page: str) -> list[str]:
    """Words of a template that are no tag's, and not Python's."""
    own = _SAID_BY_PYTHON.sub("", page)
    shown = re.sub(r"<style>.*?</style>|<[^>]*>", "", own, flags=re.DOTALL)
    return re.findall(r"[^\W\d_]{2,}", " ".join([shown, *_IN_ATTRIBUTES.findall(own)]))


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_a_page_has_no_words_of_its_own(page):
    assert words_of(page.read_text(encoding="utf-8")) == []


def test_words_of_a_page_are_found():
    assert {"feedback.html", "head.html", "begin.html", "not_open_yet.html"} == {page.name for page in PAGES}
    assert words_of('<p class="a">{{ _("All") }} so far</p>') == ["so", "far"]
    assert words_of("<style>p { color: red }</style><p>x</p>") == []
    assert words_of('<img alt="A curve"><a href="#x">{{ name }}</a>') == ["curve"]


# --- scripts ----------------------------------------------------------------------------------------------------------

_TEXTS = re.compile(r'"((?:[^"\\\n]|\\.)*)"|`((?:[^`\\]|\\.)*)`')
_FOR_BROWSERS = re.compile(
    r"12px [\w, -]+|\(prefers-[a-z-]+: \w+\)|Escape|Arrow\w+|DETAILS|DIV|[a-z]\w*\(.*\)|\.jp-[\w-]+"
)


def words_in(script: str) -> list[str]:
    """Texts of a script that begin like a sentence, or have two words in a row."""
    code = re.sub(r"^\s*//.*$|(?<=[;{}]) // .*$", "", script, flags=re.MULTILINE)
    texts = [re.sub(r"\$\{[^}]*\}", "", "".join(found)) for found in _TEXTS.findall(code)]
    said = re.compile(r"[A-Z][a-z]{2,}|[^\W\d_]{2,}[,;:.]? [^\W\d_]{2,}")
    return [text for text in texts if said.search(text) and not _FOR_BROWSERS.fullmatch(text)]


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda script: script.name)
def test_a_script_has_no_words_of_its_own(script):
    assert words_in(script.read_text(encoding="utf-8")) == []


def test_words_of_a_script_are_found():
    assert words_in('this.say({ text: "Python does not answer." }); // a remark') == ["Python does not answer."]
    assert words_in('button.textContent = "▶ Play";\nknob.title = `${a}: drag it`;') == ["▶ Play", ": drag it"]
    assert words_in('make("button", "main", row); event.key === "Escape"') == []


def test_each_word_of_a_script_is_sent_to_it():
    from rotflex.courseware.scene import explorer

    asked = {name for script in SCRIPTS for name in re.findall(r"\bwords\.(\w+)", script.read_text(encoding="utf-8"))}
    assert asked == set(explorer.page_words())
