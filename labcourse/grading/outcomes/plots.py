"""Plots of a class as SVG for a page: drawn by matplotlib, coloured by the page, so that they fit light and dark.

Colours are put in as the page's variables: those of levels are Okabe and Ito's, as in all of this project's pictures,
made darker or lighter where words stand in them. Each bar says its level and number in words as well, and the bars of
one criterion stand in the order of the levels, so that nothing is said by colour alone.
"""

from __future__ import annotations

import io
import re
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from markupsafe import Markup, escape

from labcourse.grading.outcomes.attainment import Attainment, Figures
from labcourse.safe_text import no_escapes

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_WIDTH, _ROW, _AROUND = 9.0, 0.36, 1.05  # inches: of a plot; of one bar, and of what is above and below all of them
_NARROW = 7.0  # % of a bar: below, its number does not fit into it, and stands in the table only
_MARKS = "osD^vP"  # of groups
#: Stand-ins for the page's colours, which matplotlib takes for colours.
_INK, _PAGE, _FAINT = "#010203", "#040506", "#070809"
_LEVELS = {4: "#0a0b01", 3: "#0a0b02", 2: "#0a0b03", 1: "#0a0b04", 0: "#0a0b05"}
_GROUPS = tuple(f"#0c0d0{number}" for number in range(len(_MARKS)))
_VARIABLES = {_INK: "--ink", _PAGE: "--page", _FAINT: "--faint"}
_VARIABLES |= {colour: f"--level{level}" for level, colour in _LEVELS.items()}
_VARIABLES |= {colour: f"--look{number}" for number, colour in enumerate(_GROUPS)}
_STYLE: Any = {
    "font.family": "DejaVu Sans",  # comes with matplotlib; a page without it has its own, which is narrower
    "font.size": 11,
    "svg.fonttype": "none",  # text stays text
    "text.color": _INK,
    "axes.labelcolor": _INK,
    "axes.edgecolor": _INK,
    "xtick.color": _INK,
    "ytick.color": _INK,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "text.parse_math": False,  # a group's name is text
}


def levels(found: Sequence[Attainment], names: Mapping[str, str], target: float, salt: str) -> Markup:
    """How many of a class are at each level: a bar for each criterion, and the target share as a line.

    A bar begins with the highest level, so the target is reached where the bars of what counts go beyond the line.

    Parameters
    ----------
    found : criteria; those whose figures are not shown are left out
    names : of the criteria, for people
    target : share of the students that should attain it, %
    salt : tells the ids in this picture from those of others on the page
    """
    shown = [(one.criterion, one.everybody.figures) for one in found if one.everybody.figures is not None]
    if not shown:
        return Markup("")

    def draw(axes: Axes) -> None:
        for row, (_criterion, figures) in enumerate(shown):
            start = 0.0
            for level in sorted(figures.levels, reverse=True):
                share = 100 * figures.levels[level] / figures.students
                axes.barh(row, share, left=start, height=0.72, color=_LEVELS[level], edgecolor=_PAGE, linewidth=1.5)
                if share >= _NARROW:
                    word = f"{level}: {figures.levels[level]}"
                    axes.text(start + share / 2, row, word, ha="center", va="center", color=_PAGE, fontsize=10)
                start += share
        axes.set_yticks(range(len(shown)), [criterion for criterion, _figures in shown])
        axes.set_ylim(len(shown) - 0.5, -0.5)
        axes.axvline(target, color=_INK, linestyle=(0, (4, 2)), linewidth=1.6)
        axes.text(target, -0.62, f"target {target:g} %", ha="center", va="bottom", fontsize=10)
        axes.set_xlim(0, 100)
        axes.set_xlabel("students (%), from the highest level on the left; in the bars, level: students")

    alt = "Levels of the class. {all}".format(
        all=" ".join(f"{name}, {names.get(name, name)}: {in_words(figures)}." for name, figures in shown)
    )
    return _svg(draw, len(shown), alt, salt)


def in_words(figures: Figures) -> str:
    """As "level 4: 3, level 3: 10 of 13 students"."""
    each = ", ".join(f"level {level}: {figures.levels[level]}" for level in sorted(figures.levels, reverse=True))
    return f"{each} of {figures.students} students"


def groups(found: Sequence[Attainment], target: float, salt: str) -> Markup:
    """The attainment of each group that is shown, a mark for each; nothing where there are fewer than two."""
    names = sorted({group for one in found for group, cell in one.groups.items() if cell.figures is not None})
    if len(names) < 2:
        return Markup("")
    rows = [one for one in found if any(cell.figures is not None for cell in one.groups.values())]

    def draw(axes: Axes) -> None:
        marks = []
        for number, name in enumerate(names):
            cells = [(row, one.groups[name].figures) for row, one in enumerate(rows) if name in one.groups]
            at = [(row, figures.attainment) for row, figures in cells if figures is not None]
            mark, colour = _look(number)
            marks += axes.plot(
                [share for _row, share in at],
                [row + 0.5 * ((number + 0.5) / len(names) - 0.5) for row, _share in at],
                mark,
                color=colour,
                markersize=8,
                clip_on=False,
            )
        axes.set_yticks(range(len(rows)), [one.criterion for one in rows])
        axes.set_ylim(len(rows) - 0.5, -0.5)
        axes.grid(axis="y", color=_FAINT)
        axes.set_axisbelow(True)
        axes.axvline(target, color=_INK, linestyle=(0, (4, 2)), linewidth=1.6)
        axes.text(target, -0.62, f"target {target:g} %", ha="center", va="bottom", fontsize=10)
        axes.set_xlim(-2, 102)  # so that a mark at 0 stands free of the axis
        axes.set_xlabel("students who attain it (%)")
        axes.legend(
            marks, [no_escapes(name) for name in names], loc="upper left", bbox_to_anchor=(1.02, 1), frameon=False
        )

    alt = (
        f"Attainment of the groups {no_escapes(', '.join(names))}, in each criterion; the table below has the numbers."
    )
    return _svg(draw, len(rows), alt, salt)


def _look(number: int) -> tuple[str, str]:
    """A group's mark and colour: no two groups have both in common, for as many as there are pairs of them."""
    turn, place = divmod(number, len(_GROUPS))
    return _MARKS[(place + turn) % len(_MARKS)], _GROUPS[place]


def _svg(draw: Any, rows: int, alt: str, salt: str) -> Markup:
    import matplotlib as mpl
    from matplotlib.figure import Figure

    with mpl.rc_context({**_STYLE, "svg.hashsalt": salt}):
        figure = Figure(figsize=(_WIDTH, _ROW * rows + _AROUND), layout="constrained")
        draw(figure.subplots())
        return _coloured(_saved(figure), alt)


def _saved(figure: Figure) -> str:
    buffer = io.StringIO()
    figure.savefig(buffer, format="svg", transparent=True, metadata={"Date": None, "Creator": None})
    return buffer.getvalue()


def _coloured(drawn: str, alt: str) -> Markup:
    """The SVG element alone, with the page's colours and a text for who cannot see it."""
    element = drawn[drawn.index("<svg") :]
    element = re.sub(r"<metadata>.*?</metadata>\s*", "", element, flags=re.DOTALL)
    for colour, variable in _VARIABLES.items():
        element = element.replace(colour, f"var({variable})")
    element = element.replace("'DejaVu Sans'", "'DejaVu Sans', system-ui, sans-serif")
    element = re.sub(r'(<svg[^>]*?) width="[^"]*"', r"\1", element, count=1)
    element = re.sub(r'(<svg[^>]*?) height="[^"]*"', r"\1", element, count=1)
    return Markup(element.replace("<svg", f'<svg class="plot" role="img" aria-label="{escape(alt)}"', 1))
