"""The rule of versions, in random terms: against a search of all folders, and as the sentences that follow from it."""

import random
from dataclasses import dataclass, replace
from datetime import UTC, datetime, timedelta
from fractions import Fraction

from hypothesis import given, settings
from hypothesis import strategies as st

from labcourse.grading.gradebook import Stored
from labcourse.grading.versions import Rules, Versions, in_order, run_what_may_count

START = datetime(2026, 11, 1, tzinfo=UTC)
NOTEBOOKS = ("01.ipynb", "02.ipynb", "03.ipynb")
POSSIBLE = 8  # points of a notebook


@dataclass(frozen=True)
class Came:
    """A hand-in: on which day, at which hour, and what is in it; "0" is a notebook as it was handed out."""

    day: int
    hour: int
    files: tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class Term:
    """What came, when notebooks are due, what a day costs and at most (%), and a seed of what versions are worth."""

    hand_ins: tuple[Came, ...]
    dues: tuple[int, ...]
    per_day: int
    cap: int
    seed: int

    def lost(self, notebook, hand_in):
        """The percentage that lateness costs."""
        days = max(0, hand_in.day - self.dues[NOTEBOOKS.index(notebook)])
        return min(self.cap, days * self.per_day)

    def value(self, notebook, needs):
        """What the run of a notebook with all that it needs is worth: looked up."""
        return random.Random(f"{self.seed} {notebook} {sorted(needs)}").randint(0, POSSIBLE)


FILES = st.dictionaries(st.sampled_from([*NOTEBOOKS, "tools.py"]), st.sampled_from("0123"), min_size=1)
CAME = st.builds(Came, st.integers(0, 9), st.integers(8, 20), FILES.map(lambda files: tuple(sorted(files.items()))))
TERMS = st.builds(
    Term,
    st.lists(CAME, min_size=1, max_size=6, unique_by=lambda came: (came.day, came.hour)).map(
        lambda came: tuple(sorted(came, key=lambda one: (one.day, one.hour)))
    ),
    st.tuples(*[st.integers(0, 6)] * 3),
    st.sampled_from([0, 10, 20]),
    st.sampled_from([0, 30, 50, 100]),
    st.integers(0, 10**6),
)

# --- the reference: all folders, by the words of the rule -------------------------------------------------------------


def folder(term, place):
    """Of each notebook the newest that is changed, else the untouched one; of each other file the newest."""
    files = {}
    for hand_in in term.hand_ins[: place + 1]:
        for name, content in hand_in.files:
            if name in NOTEBOOKS and content == "0" and files.get(name, "0") != "0":
                continue
            files[name] = content
    return files


def needed(files, notebook):
    """Itself, changed notebooks before it, and own files."""
    before = NOTEBOOKS[: NOTEBOOKS.index(notebook) + 1]
    return tuple(
        sorted(
            (name, content)
            for name, content in files.items()
            if name == "tools.py" or (name in before and content != "0")
        )
    )


def reference(term):
    """Notebook → points of the version that counts, lost percentage, and what it needs."""
    found = {}
    for notebook in NOTEBOOKS:
        last = {}
        for place, hand_in in enumerate(term.hand_ins):
            files = folder(term, place)
            if files.get(notebook, "0") != "0":
                last[term.lost(notebook, hand_in)] = needed(files, notebook)
        best, seen = None, set()
        for lost, needs in sorted(last.items()):
            points = Fraction(term.value(notebook, needs) * (100 - lost), 100)
            if needs not in seen and (best is None or points > best[0]):
                best = points, lost, needs
            seen.add(needs)
        if best is not None:
            found[notebook] = best
    return found


# --- the program ------------------------------------------------------------------------------------------------------


def rows(term):
    """What a gradebook stores of a term."""
    for hand_in in term.hand_ins:
        when = START + timedelta(days=hand_in.day, hours=hand_in.hour)
        for name, content in hand_in.files:
            yield Stored(name, content, when, f"{when:%m-%d %H}", "a list", "", "", 0, 0, when)


def counting(term, stored=None):
    """The same as :func:`reference` by the program, and the folders that it ran."""
    hand_ins = in_order([*rows(term)] if stored is None else stored)
    came = {START + timedelta(days=one.day, hours=one.hour): one for one in term.hand_ins}
    rules = Rules(
        notebooks=NOTEBOOKS,
        reports={},
        is_changed=lambda name, digest: digest != "0",
        release_of=lambda digest: "",
        lateness=lambda name, hand_in: (False, Fraction(term.lost(name, came[hand_in.received]), 100)),
    )
    runs = []

    def run(folder):
        runs.append(folder)
        return folder.files

    versions = Versions("ada", {"ada": hand_ins}, rules)
    ran = run_what_may_count(
        versions,
        NOTEBOOKS,
        run,
        lambda files, one: term.value(one.notebook, needed(files, one.notebook)) * (1 - one.late[1]),
        dict.fromkeys(NOTEBOOKS, Fraction(POSSIBLE)),
    )
    found = {}
    for name, results in ran.items():
        # Of equals, the first.
        version, files = max(results, key=lambda one: term.value(name, needed(one[1], name)) * (1 - one[0].late[1]))
        lost, needs = version.late[1], needed(version.folder.files, name)
        assert needs == needed(files, name)
        found[name] = term.value(name, needs) * (1 - lost), 100 * lost, needs
    return found, runs


@settings(max_examples=400, deadline=None)
@given(TERMS)
def test_what_counts_is_what_a_search_of_all_folders_finds(term):
    assert counting(term)[0] == reference(term)


@settings(max_examples=200, deadline=None)
@given(TERMS, st.randoms(use_true_random=False))
def test_the_order_in_which_files_were_stored_changes_nothing(term, rng):
    stored = [*rows(term)]
    rng.shuffle(stored)
    assert counting(term, stored)[0] == counting(term)[0]


@settings(max_examples=400, deadline=None)
@given(TERMS, CAME)
def test_a_hand_in_on_another_day_never_lowers_a_mark(term, late):
    last = term.hand_ins[-1]
    more = replace(late, day=last.day + 1 + late.day)
    longer = replace(term, hand_ins=(*term.hand_ins, more))
    before, after = counting(term)[0], counting(longer)[0]
    for name, (points, *_about) in before.items():
        # Days that cost the same, as those beyond the cap, are one day.
        if term.lost(name, more) > term.lost(name, last):
            assert after[name][0] >= points


@settings(max_examples=200, deadline=None)
@given(TERMS)
def test_what_is_late_never_counts_as_in_time(term):
    for name, (_points, lost, needs) in counting(term)[0].items():
        there = [
            term.lost(name, hand_in)
            for place, hand_in in enumerate(term.hand_ins)
            if needed(folder(term, place), name) == needs
        ]
        assert lost in there


@settings(max_examples=200, deadline=None)
@given(TERMS)
def test_no_folder_is_run_twice(term):
    _found, runs = counting(term)
    assert len({id(run) for run in runs}) == len(runs) <= len(term.hand_ins)


def test_one_run_is_enough_for_weekly_folders_in_which_only_later_notebooks_change():
    done = [tuple((name, "1") for name in NOTEBOOKS[:week]) for week in (1, 2, 3)]
    weekly = [Came(7 * week, 10, files) for week, files in enumerate(done)]
    found, runs = counting(Term(tuple(weekly), (0, 7, 14), 10, 50, 1))
    assert [dict(run.files) for run in runs] == [dict(done[-1])]
    assert {lost for _points, lost, _needs in found.values()} == {0}


def test_a_late_version_that_cannot_win_is_not_run():
    term = Term((Came(0, 10, (("01.ipynb", "1"),)), Came(3, 10, (("01.ipynb", "2"),))), (0, 0, 0), 10, 50, 0)
    for seed in range(20):
        one = replace(term, seed=seed)
        _found, runs = counting(one)
        in_time = one.value("01.ipynb", (("01.ipynb", "1"),))
        assert len(runs) == (1 if in_time >= 0.7 * POSSIBLE else 2)
