"""The catalogues of messages are those of the source, whole, and each in its own package."""

from __future__ import annotations

import re
import string

import messages
import pytest
from babel.messages.catalog import Catalog
from checkout import ROOT

from rotflex.instructor.marking.marking import KEY_FAILED
from rotflex.instructor.running.intake import reading

FILES = [path for domain in messages.DOMAINS for path in messages.languages(domain)]


def name_of(path) -> str:
    return path.relative_to(ROOT).as_posix()


@pytest.fixture(scope="module")
def wanted():
    return dict(messages.wanted())


def test_each_catalogue_is_up_to_date(wanted):
    """Template, each language's translations, and what gettext reads of them."""
    stale = [name_of(path) for path, content in wanted.items() if not path.exists() or path.read_bytes() != content]
    assert not stale, "say: python tools/messages.py"
    there = {path for domain in messages.DOMAINS for path in domain.locale.iterdir() if path.is_file()}
    assert there == set(wanted)


def test_each_language_has_all_catalogues():
    languages = [{path.stem for path in messages.languages(domain)} for domain in messages.DOMAINS]
    assert languages[0] and all(one == languages[0] for one in languages)


@pytest.mark.parametrize("path", FILES, ids=name_of)
def test_a_language_says_everything(path):
    assert list(messages.faults(messages.read(path))) == []


def names_in(text: str) -> set[str]:
    """The names that are put into a message, with the form in which each is."""
    parts = string.Formatter().parse(text)
    return {f"{name}{'!' + how if how else ''}:{form}" for _text, name, form, how in parts if name is not None}


@pytest.mark.parametrize("path", FILES, ids=name_of)
def test_a_translation_puts_in_what_its_message_does(path):
    for message in messages.read(path):
        if message.id:
            several = isinstance(message.id, tuple)
            wanted = names_in(message.id[1] if several else message.id)
            for translation in message.string if several else [message.string]:
                assert not translation or names_in(translation) == wanted, message.id


_TEX = re.compile(r"(?<![“„])\$[^$]*\$")  # and no “$” that is spoken of
_EDGE = re.compile(r"^\s*|\s*$")


def edges(text: str) -> list[str]:
    """The spaces at both ends. Several of them fill a column, to the width that the words leave."""
    return [re.sub("  +", "  ", edge) for edge in _EDGE.findall(text)]


@pytest.mark.parametrize("path", FILES, ids=name_of)
def test_a_translation_has_the_formulas_and_edges_of_its_message(path):
    """Parts of a sentence are put one behind the other: a space at the end is part of them."""
    for message in messages.read(path):
        if isinstance(message.id, str) and message.id and message.string:
            assert sorted(_TEX.findall(message.string)) == sorted(_TEX.findall(message.id)), message.id
            assert edges(message.string) == edges(message.id), message.id


@pytest.mark.parametrize(
    "source",
    [
        """f"<summary>{_('The figure in words')}</summary>\"""",
        """f": {plural(len(curves), 'The figure in words', '{count} figures')}\"""",
        """_(KINDS.get(kind, N_('The figure in words')))""",
        """N_('{what}.', what=N_('The figure in words'))""",
        """table(_(\n    'The figure '\n    'in words'\n))""",
        """messages._('The figure in words')""",
    ],
)
def test_a_message_is_gathered_wherever_it_stands(source, tmp_path, monkeypatch):
    """Also inside an f-string, or another call."""
    monkeypatch.setattr(messages, "ROOT", tmp_path)
    (tmp_path / "module.py").write_text(source, encoding="utf-8")
    catalog = messages.gathered(messages.Domain("rotflex", "rotflex", ("module.py",)))
    assert "The figure in words" in catalog


def test_what_is_known_by_its_beginning_or_end_has_it_in_each_language():
    """Problems and notes that were said are found again by the words before what was put in, or behind it."""
    ends = {KEY_FAILED: "{fault}", reading._UNREAD: "{error}", "Question {number} {unmarked}": "{unmarked}"}
    found = [one for path in FILES for one in messages.read(path) if one.id in ends]
    assert len(found) >= len(ends) and all(one.string.endswith(ends[one.id]) for one in found)


def test_a_message_that_is_missing_is_found(tmp_path, wanted):
    """What the source says, and a catalogue has not, is told."""
    domain = messages.DOMAINS[2]
    template = messages.gathered(domain)
    path = tmp_path / "de.po"
    path.write_bytes(messages.as_po(messages.updated(path, domain, template)))
    template.add("Something that is said from today on.")
    assert messages.as_po(messages.updated(path, domain, template)) != path.read_bytes()


def test_no_translation_is_lost_when_its_message_changes(tmp_path):
    domain = messages.DOMAINS[2]
    before, after = Catalog(), Catalog()
    before.add("What was said.")
    after.add("What is said.")
    path = tmp_path / "de.po"
    catalog = messages.updated(path, domain, before)
    catalog["What was said."].string = "Was gesagt wurde."
    path.write_bytes(messages.as_po(catalog))
    for _again in range(2):
        path.write_bytes(messages.as_po(messages.updated(path, domain, after)))
        text = path.read_text(encoding="utf-8")
        assert '#~ msgstr "Was gesagt wurde."' in text and 'msgid "What is said."' in text
    path.write_bytes(messages.as_po(messages.updated(path, domain, before)))
    assert messages.read(path)["What was said."].string == "Was gesagt wurde."


def test_faults_of_a_catalogue_are_named():
    catalog = Catalog("de", fuzzy=False)
    catalog.add("whole", "ganz")
    catalog.add("empty", "")
    catalog.add("guessed", "geraten", flags=["fuzzy"])
    catalog.add(("{count} one", "{count} many"), ("{count} eins", ""))
    assert list(messages.faults(catalog)) == [
        "not translated: 'empty'",
        "fuzzy: 'guessed'",
        "not translated: '{count} one'",
    ]


def test_what_is_the_instructors_stands_in_no_catalogue_of_students():
    """Neither reasons of the key, nor what marking says; nor, in any catalogue, what instructors alone read."""
    students, instructors, key = ({one.id for one in catalog} for _domain, catalog in messages.templates())
    assert not students & instructors - {""} and not students & key - {""}
    assert "look at the factor in front" in key and "What went wrong" in instructors and "Potential energy" in students
    read = {path for domain in messages.DOMAINS for path in domain.files()}
    for folder in ("commands", "course_check", "gradebook", "outcomes", "overview", "platforms", "scoring", "settings"):
        assert not any(path.is_relative_to(ROOT / "rotflex" / "instructor" / folder) for path in read)
