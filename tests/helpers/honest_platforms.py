"""Everything right, as learning platforms hand it over: their names, and several hand-ins of the same student."""

from pathlib import Path

from honest_hand_in import Row, Ways, Work, as_folder, as_zip
from honest_packings import SECOND_HALF, half_done, notebooks_only, only

WAYS = Ways()
EARLY, LATE = (2026, 2, 14, 9, 30, 0), (2026, 3, 2, 12, 0, 0)


def row(student: str, name: str, number: str, login: str = "") -> tuple[Row, ...]:
    return (Row(student, name, f"{student}@example.edu", number, login or student),)


@WAYS.packed(roster=row("moodle-folders", "Ada Lovelace", "1234567"))
def moodle_folders(folder: Path, work: Work) -> None:
    """Moodle, in folders: the name, its own number, and the zip in it; beside it the text that was typed online."""
    place = folder / "Ada Lovelace_1234567_assignsubmission_file_"
    as_zip(place / "notebooks.zip", work.contents(), within="notebooks")
    online = folder / "Ada Lovelace_1234567_assignsubmission_onlinetext_"
    as_folder(online, {"onlinetext.html": b"<p>Here is my work. Sorry for the delay!</p>"})


@WAYS.packed(roster=row("moodle-newer", "Jürgen Groß-Weiß", "1234568"))
def moodle_newer(folder: Path, work: Work) -> None:
    """A newer Moodle, without the underscore at the end; loose notebooks in the folder; a name with umlauts."""
    as_folder(folder / "Jürgen Groß-Weiß_1234568_assignsubmission_file", work.contents())


@WAYS.packed(roster=row("moodle-flat", "Lucía Gómez Ibáñez", "1234569"))
def moodle_flat(folder: Path, work: Work) -> None:
    """Moodle without folders: all files of all students in one place, the name and number before each."""
    files = work.contents()
    as_folder(
        folder, {f"Lucía Gómez Ibáñez_1234569_assignsubmission_file_{name}": content for name, content in files.items()}
    )


@WAYS.packed(roster=row("moodle-anonymous", "Kim Roe", "88112"))
def moodle_anonymous(folder: Path, work: Work) -> None:
    """Moodle with blind marking: a participant's number only; the ID is in course.json."""
    as_zip(folder / "Participant_88112_assignsubmission_file_" / "rotflex.zip", work.contents())


@WAYS.packed(roster=row("canvas-zip", "Bob Stone", "51234"))
def canvas_zip(folder: Path, work: Work) -> None:
    """Canvas: the name in small letters, late, its numbers, and what the file was called."""
    as_zip(folder / "stonebob_LATE_51234_8899001_notebooks.zip", work.contents(), within="notebooks")


@WAYS.packed(roster=row("canvas-loose", "Anne-Marie O'Neil", "51235"))
def canvas_loose(folder: Path, work: Work) -> None:
    """Canvas with loose notebooks, handed in for the third time: -2 after each name."""
    files = {name.replace(".", "-2."): content for name, content in work.contents().items()}
    as_folder(folder, {f"oneilannemarie_51235_88990{n:02}_{name}": c for n, (name, c) in enumerate(files.items())})


@WAYS.packed(roster=row("canvas-notebooks-only", "Ole Holm", "51236"))
def canvas_notebooks_only(folder: Path, work: Work) -> None:
    """Canvas with loose notebooks and nothing else: the ID is known from the roster's number only."""
    files = notebooks_only(work)
    as_folder(folder, {f"holmole_51236_77{n:02}_{name}": content for n, (name, content) in enumerate(files.items())})


@WAYS.packed(roster=row("blackboard-zip", "Chen Wei", "", "cwei3"))
def blackboard_zip(folder: Path, work: Work) -> None:
    """Blackboard: assignment, user name, time of the attempt; with a text of its own beside the zip."""
    stem = "Lab report 1_cwei3_attempt_2026-03-02-12-00-00"
    as_zip(folder / f"{stem}_notebooks.zip", work.contents(), within="notebooks")
    as_folder(folder, {f"{stem}.txt": b"Name: Chen Wei (cwei3)\r\nAssignment: Lab report 1\r\n"})


@WAYS.packed(roster=row("blackboard-twice", "Dana Fox", "", "dfox"))
def blackboard_twice(folder: Path, work: Work) -> None:
    """Blackboard, two attempts: the whole course half done, then only the notebooks of the second half."""
    stem = "Lab_Course_dfox_attempt_"
    as_zip(folder / f"{stem}2026-02-14-09-30-00_notebooks.zip", half_done(work), "notebooks", EARLY)
    as_zip(folder / f"{stem}2026-03-02-12-00-00_rest.zip", only(work, *SECOND_HALF), "notebooks", LATE)
    for time in ("2026-02-14-09-30-00", "2026-03-02-12-00-00"):
        as_folder(folder, {f"{stem}{time}.txt": b"Name: Dana Fox (dfox)\r\n"})


@WAYS.packed(roster=row("brightspace", "Eva Nowak", "40123"))
def brightspace(folder: Path, work: Work) -> None:
    """Brightspace: numbers, name and time in the folder's name; an index beside."""
    as_zip(folder / "40123-778899 - Eva Nowak - Mar 2, 2026 1200 PM" / "my notebooks.zip", work.contents())
    as_folder(folder, {"index.html": b"<html><body>Eva Nowak</body></html>"})


@WAYS.packed(roster=row("brightspace-twice", "Finn Berg", "40124"))
def brightspace_twice(folder: Path, work: Work) -> None:
    """Brightspace, two hand-ins: the first half on time, the second half later, no notebook twice."""
    first, second = "Feb 14, 2026 930 AM", "Mar 2, 2026 1200 PM"
    place = "40124-778899 - Finn Berg - {}"
    as_folder(folder / place.format(first), only(work, "00", "01", "02", "03", "04"))
    as_zip(folder / place.format(second) / "control.zip", only(work, *SECOND_HALF), "notebooks", LATE)


@WAYS.packed(roster=row("moodle-twice", "Gita Rao", "1234570"))
def moodle_twice(folder: Path, work: Work) -> None:
    """Moodle keeps all files of a student: the early zip, and later the corrected notebooks loose beside it."""
    place = folder / "Gita Rao_1234570_assignsubmission_file_"
    as_zip(place / "all notebooks.zip", half_done(work), "notebooks", EARLY)
    as_zip(place / "corrected.zip", only(work, *SECOND_HALF), "", LATE)


@WAYS.packed(roster=row("one-notebook-again", "Hal Ito", "51237"))
def one_notebook_again(folder: Path, work: Work) -> None:
    """Canvas: the zip of the half-done course, and each notebook of the second half later, on its own, as name-1."""
    as_zip(folder / "itohal_51237_100_notebooks.zip", half_done(work), "notebooks", EARLY)
    late = {n.replace(".ipynb", "-1.ipynb"): c for n, c in only(work, *SECOND_HALF).items() if n.endswith(".ipynb")}
    as_folder(
        folder, {f"itohal_LATE_51237_{200 + n}_{name}": content for n, (name, content) in enumerate(late.items())}
    )
