"""LaTeX that cannot be set as it was meant, and formulas that are no LaTeX."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from difflib import get_close_matches

from rotflex.courseware.messages import _
from rotflex.courseware.report.checks.faults import Fault
from rotflex.courseware.report.checks.prose import FORMULA, GREEK, Reading

_COMMAND = re.compile(r"\\([A-Za-z]+)")
_BRACE = re.compile(r"(?<!\\)(?:\\\\)*([{}])")
_ENVIRONMENT = re.compile(r"\\(begin|end)\s*\{([^{}]*)\}")
_LONGEST = 40  # characters of a formula that a message repeats
_FEWEST_LETTERS = 4  # of a command; shorter ones are too near to each other
#: As for a program: a name, "=", and an operator that no text has.
_TYPED = re.compile(r"(?<![\w/.])[A-Za-z]\w{0,12}\s*=\s*[\w.()+\- /]{0,30}?[\w)]\s*(?:\*\*?|\^)\s*[\w(][^,;\s]{0,20}")
#: Commands that are often used. Another is taken for a slip only if it is nearly one of these.
_OTHERS = """
    frac dfrac tfrac sqrt cdot cdots ldots dots vdots ddots times div pm mp approx sim simeq cong equiv propto neq
    ne leq le geq ge ll gg infty partial nabla int iint oint sum prod lim limits nolimits sin cos tan cot sec csc
    arcsin arccos arctan sinh cosh tanh log ln lg exp det dim rank ker min max sup inf arg Re Im hat bar tilde dot
    ddot dddot vec check breve acute grave widehat widetilde overline underline overbrace underbrace overset
    underset stackrel left right middle big Big bigg Bigg bigl bigr Bigl Bigr biggl biggr langle rangle lfloor
    rfloor lceil rceil lvert rvert lVert rVert vert Vert mid parallel perp angle triangle circ degree prime ast
    star bullet oplus otimes cup cap subset subseteq supset in notin ni forall exists neg lnot land lor wedge vee
    to gets rightarrow leftarrow Rightarrow Leftarrow leftrightarrow Leftrightarrow longrightarrow Longrightarrow
    mapsto implies iff uparrow downarrow begin end matrix pmatrix bmatrix vmatrix cases align aligned equation
    array text textrm textbf textit mathrm mathbf mathit mathsf mathtt mathcal mathbb mathfrak boldsymbol
    operatorname label tag ref eqref nonumber notag quad qquad hspace vspace phantom mathop displaystyle textstyle
    scriptstyle binom choose mod bmod pmod not because therefore hbar ell wp aleph emptyset setminus top bot
    dagger ddagger colon si unit qty SI num kilo milli micro
    """
_KNOWN = frozenset(
    {
        *_OTHERS.split(),
        *GREEK.values(),
        *(name.title() for name in GREEK.values()),
        *(f"var{name}" for name in GREEK.values()),
    }
)


def faults(readings: Sequence[Reading]) -> Iterator[Fault]:
    """What is wrong with the formulas of each text."""
    for reading in readings:
        if reading.unclosed:
            yield _fault(
                reading,
                "latex",
                _("{where}: a formula is opened with “$” and not closed.").format(where=reading.where),
                _("Put a “$” before and after each formula."),
            )
        for formula in reading.formulas:
            for wrong in _wrong(formula.latex):
                shown = " ".join(formula.latex.split())
                shown = shown if len(shown) <= _LONGEST else f"{shown[:_LONGEST]}…"
                yield _fault(
                    reading,
                    "latex",
                    _("{where}: a formula cannot be set: {wrong}, in {formula}.").format(
                        where=reading.where, formula=f"`{shown}`", wrong=wrong
                    ),
                    _("Correct it, and run the cell: a formula that is all right is shown as one."),
                )
        if typed := _TYPED.search(reading.bare.replace(FORMULA, " ; ")):
            yield Fault(
                "typed",
                _("{where}: “{formula}” is typed as for a program.").format(where=reading.where, formula=typed[0]),
                _("A reader has to take stars and hats apart in their head."),
                _("Write it between “$” signs, as in $a = b\\,c^2$."),
                reading.place,
            )


def _fault(reading: Reading, kind: str, what: str, advice: str) -> Fault:
    return Fault(kind, what, _("A reader sees signs in place of the formula, or none at all."), advice, reading.place)


def _wrong(latex: str) -> Iterator[str]:
    depth = lowest = 0
    for brace in _BRACE.findall(latex):
        depth += 1 if brace == "{" else -1
        lowest = min(lowest, depth)
    if depth > 0:
        yield _("a “{open}” is not closed").format(open="{")
    elif depth < 0 or lowest < 0:
        yield _("a “{close}” has no “{open}” before it").format(close="}", open="{")
    commands = _COMMAND.findall(latex)
    if commands.count("left") != commands.count("right"):
        yield _(r"\left and \right do not go in pairs")
    opened = [name for what, name in _ENVIRONMENT.findall(latex) if what == "begin"]
    closed = [name for what, name in _ENVIRONMENT.findall(latex) if what == "end"]
    if sorted(opened) != sorted(closed):
        yield _(r"\begin and \end do not go in pairs")
    for command in dict.fromkeys(commands):
        if command not in _KNOWN and len(command) >= _FEWEST_LETTERS:
            near = get_close_matches(command, _KNOWN, n=1, cutoff=0.8)
            if near:
                yield _("there is no command {command} (there is {near})").format(
                    command=f"\\{command}", near=f"\\{near[0]}"
                )
