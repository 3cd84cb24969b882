"""Read a course's rubric: what to look for in each answer that a person reads, and what each level is like.

It is a file of the course's folder, ``rubric.toml``, with a table for each part that a person marks::

    ["1.4".why]
    look_for = "Names a loss that the model leaves out, and where it would be seen in the recording."
    4 = "Names the loss, says how it would show, and shows it in the student's own recording."
    3 = "Names the loss and says how it would show."
    2 = "Names a loss without saying what it does."
    1 = "Names none, or one that the model has."
    remarks = ["Look at the height of one swing after the next: what does it tell you?"]

Remarks are for students, and may be used again. A course need not have a rubric; one that has it has all of it.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationError

from labcourse.answers.catalogue import Catalogue
from labcourse.errors import GradingError
from labcourse.grading.course import RUBRIC_FILE
from labcourse.grading.settings import read_toml, refuse
from labcourse.problems import Where

RUBRIC_LEVELS = (4, 3, 2, 1)  #: exemplary, proficient, developing, beginning
LEVELS = (*RUBRIC_LEVELS, 0)  #: 0 is for what is of no worth, or missing
LONGEST = 500  #: characters of a text; five lines, read before each of eighty answers


def _one_line(text: str) -> str:
    """Join a text that was written over several lines. Raises ValueError if it is empty, too long or not printable."""
    line = " ".join(text.split())
    if not (1 <= len(line) <= LONGEST and line.isprintable()):
        raise ValueError(f"a text of 1 to {LONGEST} printable characters is expected")
    return line


_Text = Annotated[str, AfterValidator(_one_line)]


class RubricItem(BaseModel):
    """What a scorer sees when they read the answers to one part.

    Attributes
    ----------
    look_for : what has to be there
    level_4, level_3, level_2, level_1 : what an answer of each level is like
    remarks : to students, to be used again
    """

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    look_for: _Text
    level_4: _Text = Field(alias="4")
    level_3: _Text = Field(alias="3")
    level_2: _Text = Field(alias="2")
    level_1: _Text = Field(alias="1")
    remarks: Annotated[tuple[_Text, ...], Field(strict=False)] = ()

    @property
    def levels(self) -> dict[int, str]:
        """Level, from 4 to 1 → what an answer of that level is like."""
        return {4: self.level_4, 3: self.level_3, 2: self.level_2, 1: self.level_1}


def read(folder: Path, catalogue: Catalogue) -> Mapping[Where, RubricItem]:
    """Return the rubric of the course in a folder, in the catalogue's order; empty without a file.

    Parameters
    ----------
    folder : of the course
    catalogue : of its questions

    Raises
    ------
    GradingError
        If the file is not TOML, an entry is wrong, or a part that a person marks is missing. The message lists each
        fault.
    OSError
        If the file cannot be read.
    """
    items, faults = examine(folder, catalogue)
    refuse(folder / RUBRIC_FILE, faults)
    return items


def examine(folder: Path, catalogue: Catalogue) -> tuple[dict[Where, RubricItem], list[str]]:
    """Return the valid entries of a rubric, and a message on each fault; both are empty without a file.

    Parameters as for :func:`read`. Raises OSError if the file cannot be read.
    """
    try:
        content = read_toml(folder / RUBRIC_FILE)
    except FileNotFoundError:
        return {}, []
    except GradingError as error:
        return {}, [str(error)]
    tables = {number: parts if isinstance(parts, Mapping) else {"": parts} for number, parts in content.items()}
    entries = {(number, name): entry for number, parts in tables.items() for name, entry in parts.items()}
    wanted, known = for_a_person(catalogue), for_a_person(catalogue.whole)
    strange = [where for where in entries if where not in known]
    faults = [f"{_place(where)}: there is no such part that a person marks." for where in strange]
    items = {}
    for where in wanted:
        try:
            items[where] = _item(entries[where])
        except KeyError:
            faults.append(f"{_place(where)} is missing: a person marks it.")
        except ValidationError as error:
            faults += [_fault(where, details) for details in error.errors()]
        except ValueError as error:
            faults.append(f"{_place(where)}: {error}")
    return items, faults


def for_a_person(catalogue: Catalogue) -> list[Where]:
    """Return the parts that a person marks."""
    return [(q.number, part.name) for q in catalogue.marked.values() for part in q.parts if part.marked == "person"]


def _place(where: Where) -> str:
    """Write question and part as in the file."""
    return f'["{where[0]}".{where[1]}]'


def _fault(where: Where, details: Any) -> str:
    return f"{_place(where)}: {'.'.join(map(str, details['loc']))}: {details['msg']}."


def _item(content: Any) -> RubricItem:
    """Return an entry of the file. Raises ValueError, or its kind ValidationError, if it is not valid."""
    item = RubricItem.model_validate(content)
    if len({*item.levels.values()}) < len(item.levels):
        raise ValueError("two of its levels say the same, so nobody can tell them apart.")
    return item
