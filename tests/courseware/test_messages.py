"""Messages are looked up when they are said, in the language of the moment."""

from __future__ import annotations

import json
import pickle
import subprocess
import sys

import pytest
from babel.messages.catalog import Catalog
from messages import as_mo
from pseudo import folder_of_catalogues

from rotflex.courseware import messages
from rotflex.courseware.messages import N_, _, listed, plural

TITLE = N_("Stability of it")
MADE = N_("Overshoot of {whose}, {percent:g} %", whose=N_("the arm"), percent=4.0)


@pytest.fixture(autouse=True)
def words(tmp_path):
    """A language of a few words, and one with other plurals."""
    small = Catalog("de", fuzzy=False)
    for english, german in {
        "Stability of it": "Stabilität davon",
        "Overshoot of {whose}, {percent:g} %": "{percent:g} % Überschwingen: {whose}",
        "the arm": "der Arm",
        "Not {what}.": "Nicht {what}.",
        "{some} and {count} more": "{some} und {count} weitere",
        ("{count} hit", "{count} hits"): ("{count} Treffer", "{count} Treffer (mehrere)"),
    }.items():
        small.add(english, german)
    (tmp_path / "xx.mo").write_bytes(as_mo(small))
    polish = Catalog("pl", fuzzy=False)
    polish.add(("{count} hit", "{count} hits"), ("{count} a", "{count} b", "{count} c"))
    (tmp_path / "pl.mo").write_bytes(as_mo(polish))
    with folder_of_catalogues(tmp_path):
        yield


def test_a_message_is_said_in_the_language_of_the_moment():
    assert (_(TITLE), messages.spoken()) == ("Stability of it", "en")
    messages.speak("xx")
    assert (_(TITLE), _("Stability of it"), messages.spoken()) == ("Stabilität davon", "Stabilität davon", "xx")
    messages.speak("en")
    assert _(TITLE) == "Stability of it"


def test_what_no_catalogue_has_is_said_in_english():
    messages.speak("xx")
    assert (_("No such message."), _("")) == ("No such message.", "")
    assert plural(2, "{count} page of it", "{count} pages of it") == "2 pages of it"


def test_names_are_put_in_in_the_order_of_the_language_and_are_said_in_it():
    assert _(MADE) == "Overshoot of the arm, 4 %"
    messages.speak("xx")
    assert _(MADE) == "4 % Überschwingen: der Arm"
    assert _("Not {what}.").format(what=MADE) == "Nicht 4 % Überschwingen: der Arm."


def test_a_message_that_is_not_said_yet_is_its_english_text():
    messages.speak("xx")
    assert (MADE == "Overshoot of the arm, 4 %", json.dumps(MADE)) == (True, '"Overshoot of the arm, 4 %"')
    assert ({MADE: 1}["Overshoot of the arm, 4 %"], str(MADE)) == (1, "Overshoot of the arm, 4 %")
    assert _(pickle.loads(pickle.dumps(MADE))) == "4 % Überschwingen: der Arm"


def test_counts_have_the_forms_of_the_language():
    forms = [plural(count, "{count} hit", "{count} hits") for count in (0, 1, 2)]
    assert forms == ["0 hits", "1 hit", "2 hits"]
    messages.speak("xx")
    assert plural(1, "{count} hit", "{count} hits") == "1 Treffer"
    assert listed(["a", "b", "c"], 2) == "a, b und 1 weitere"
    messages.speak("pl")
    forms = [plural(count, "{count} hit", "{count} hits") for count in (1, 3, 5)]
    assert forms == ["1 a", "3 b", "5 c"]


def test_of_a_country_without_catalogue_the_language_is_spoken():
    messages.speak("xx_YY")
    assert messages.spoken() == "xx"
    messages.speak("xx-YY")
    assert messages.spoken() == "xx"


@pytest.mark.parametrize("language", ["../xx", "qq", "", "xx/../xx"])
def test_a_language_that_is_not_there_is_english(language):
    messages.speak(language)
    assert messages.spoken() == "en"


def test_the_readers_choice_comes_before_the_courses(monkeypatch):
    assert messages.speak_to_reader("xx") == ""
    assert messages.spoken() == "xx"
    monkeypatch.setenv(messages.SETTING, "en")
    assert messages.speak_to_reader("xx") == ""
    assert messages.spoken() == "en"


def test_a_reader_is_told_that_a_language_is_not_there(monkeypatch):
    monkeypatch.setenv(messages.SETTING, "qq")
    told = messages.speak_to_reader("xx")
    assert "'qq'" in told and "xx" in told
    assert messages.spoken() == "en"


def test_a_catalogue_that_comes_later_is_looked_into(tmp_path):
    messages.speak("xx")
    later = Catalog("de", fuzzy=False)
    later.add("No such message.", "Keine.")
    (tmp_path / "more").mkdir()
    (tmp_path / "more" / "xx.mo").write_bytes(as_mo(later))
    messages.add(tmp_path / "more")
    assert (_("No such message."), _(TITLE)) == ("Keine.", "Stabilität davon")
    messages.add(tmp_path / "nothing")
    assert _(TITLE) == "Stabilität davon"


def test_english_loads_no_catalogue_and_no_gettext():
    code = (
        "import sys; before = set(sys.modules); from rotflex.courseware.messages import _; _('All'); "
        "print('gettext' in set(sys.modules) - before)"
    )
    said = subprocess.run([sys.executable, "-S", "-c", code], check=True, capture_output=True, text=True).stdout
    assert said == "False\n"
