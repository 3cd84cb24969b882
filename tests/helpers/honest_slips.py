"""Something wrong, honestly: wrong numbers, and what was not handed in. ``told`` is what the student must read."""

from pathlib import Path

from checkout import ROOT
from honest_hand_in import Ways, Work, as_folder, released_notebooks, text_of, written
from honest_packings import notebooks_only
from honest_stops import AFTER_2_11

WAYS = Ways()
PRELAB = ("2.1", "2.2", "2.3", "2.4", "2.5", "2.6", "2.7", "2.8")
ALL_CODE = (*PRELAB, "2.9", "2.10", "2.11", "2.13", *AFTER_2_11)
ALL_WORDS = ("2.16", "2.17", "3.17", "Modeling report", "Control report")
AS_A_WHOLE = ("Modeling report, as a whole", "Control report, as a whole")
ALL = (*ALL_CODE, "3.1", "3.4", *ALL_WORDS, *AS_A_WHOLE)


@WAYS.changed(lost=("3.5",), told=(r"3\.5", r"open-loop polynomial less the desired one"))
def sign_of_the_gain(work: Work) -> None:
    """Took the open-loop polynomial minus the desired one: all gains have the wrong sign, and the servo runs away."""
    work.replace("q3-5", "(desired_polynomial - open_loop_polynomial)", "(open_loop_polynomial - desired_polynomial)")


@WAYS.changed(lost=("3.10",), told=(r"3\.10", r"empty|not answered|nothing|None"))
def another_name_assigned(work: Work) -> None:
    """Assigned K_Library and not K_library, and saw on the screen what they wanted to see."""
    work.replace("q3-10", "K_library = control", "K_Library = control")


@WAYS.changed(
    lost=("3.15", "3.16", "3.17", "Table 3"), told=(r"09_partial_state_feedback", r"missing|not handed in|no ")
)
def notebook_forgotten(work: Work) -> None:
    """Did not hand in 09."""
    del work.notebooks[work.name("09")]


@WAYS.changed(lost=PRELAB, told=(r"01_modeling_prelab", r"missing|not handed in|download"))
def notebook_in_the_cloud(work: Work) -> None:
    """iCloud had taken 01 off the disk: in its place is a small file that only stands for it."""
    work.files[f".{work.name('01')}.icloud"] = b"bplist00\xd3\x01\x02\x03"
    del work.notebooks[work.name("01")]


@WAYS.changed(lost=PRELAB, told=(r"01_modeling_prelab", r"<<<<<<<|merge|git|read|JSON"))
def notebook_with_conflicts(work: Work) -> None:
    """Git could not merge 01, and left its marks in it."""
    name = work.name("01")
    conflict = b'<<<<<<< HEAD\n "cells": [\n=======\n "cells" : [\n>>>>>>> main\n'
    work.files[name] = written(work.notebooks[name]).replace(b' "cells": [\n', conflict)


@WAYS.changed(lost=("2.11",), told=(r"2\.11", r"explanation", r"empty|not answered|no text|words"))
def words_in_a_code_cell(work: Work) -> None:
    """Wrote the explanation as comments and a string into the code cell, and left the text cell as it was."""
    words = text_of(work.cell("q2-11-explanation")).split("\n\n", 1)[1]
    released = {cell["id"]: cell for cell in released_notebooks(ROOT)[work.name("02")]["cells"]}
    work.write("q2-11-explanation", text_of(released["q2-11-explanation"]))
    work.write("q2-11", text_of(work.cell("q2-11")) + f'\nexplanation = r"""{words}"""\n')


@WAYS.packed(lost=ALL, told=(r"no notebook", r"pdf|html"))
def pages_instead_of_notebooks(folder: Path, work: Work) -> None:
    """Handed in the notebooks printed as pages."""
    stems = [name.removesuffix(".ipynb") for name in notebooks_only(work)]
    as_folder(
        folder / work.student, {f"{s}.html": b"<html><h1>done</h1></html>" for s in stems} | {"all.pdf": b"%PDF-1.7"}
    )


@WAYS.packed(
    student="someone.real",
    roster=("someone.real", "a.friend"),
    lost=ALL,
    told=(r"someone\.real", r"a\.friend"),
)
def another_ones_course_folder(folder: Path, work: Work) -> None:
    """Began in a copy of a friend's folder: course.json has the friend's ID, the hand-in's name has their own."""
    work.set_student("a.friend")
    as_folder(folder / "someone.real", work.contents())
