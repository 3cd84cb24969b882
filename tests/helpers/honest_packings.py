"""Everything right, in the packings and under the names that platforms, systems and people give to it."""

import io
import zipfile
from pathlib import Path

from checkout import ROOT
from honest_files import without_release
from honest_hand_in import (
    WRITTEN,
    Files,
    Row,
    Ways,
    Work,
    as_folder,
    as_zip,
    composed,
    decomposed,
    released_notebooks,
    written,
    zipped,
)

WAYS = Ways()
SECOND_HALF = ("05", "06", "07", "08", "09", "10")


def only(work: Work, *numbers: str) -> Files:
    """The files of a hand-in, without the notebooks whose names start with none of these numbers."""
    return {n: content for n, content in work.contents().items() if n.startswith(numbers) or not n.endswith(".ipynb")}


def half_done(work: Work) -> Files:
    """The whole folder when only the first half was done: the notebooks of the second are as released."""
    released = {name: nb for name, nb in released_notebooks(ROOT).items() if name.startswith(SECOND_HALF)}
    return {**work.contents(), **{name: written(notebook) for name, notebook in released.items()}}


def notebooks_only(work: Work) -> Files:
    return {name: written(notebook) for name, notebook in work.notebooks.items()}


@WAYS.packed()
def zip_of_the_folder(folder: Path, work: Work) -> None:
    """A zip named by the ID, with the folder notebooks in it."""
    as_zip(folder / f"{work.student}.zip", work.contents(), within="notebooks")


@WAYS.packed()
def zip_of_the_files(folder: Path, work: Work) -> None:
    """A zip named by the ID in capitals with .ZIP, with the files right in it."""
    as_zip(folder / f"{work.student}.ZIP", work.contents())


@WAYS.packed()
def zip_in_a_folder(folder: Path, work: Work) -> None:
    """A zip inside the student's folder."""
    as_zip(folder / work.student / "notebooks.zip", work.contents(), within="notebooks")


@WAYS.packed()
def zip_in_a_zip(folder: Path, work: Work) -> None:
    """A zip of a zip, in several folders."""
    inner = {"homework.zip": zipped(work.contents(), within="Desktop/lab/rotflex-course/notebooks")}
    as_zip(folder / f"{work.student}.zip", inner, within="hand in")


@WAYS.packed()
def zip_by_finder(folder: Path, work: Work) -> None:
    """Compressed by macOS: __MACOSX with a shadow of each file, .DS_Store, decomposed names."""
    files = {f"notebooks/{decomposed(name)}": content for name, content in work.contents().items()}
    shadows = {f"__MACOSX/notebooks/._{name}": b"\0\x05\x16\x07\0\x02\0\0Mac OS X" for name in work.contents()}
    named = {"notebooks/" + decomposed("Übersicht.md"): b"# mine", "notebooks/.DS_Store": b"\0\0\0\1Bud1"}
    as_zip(folder / f"{work.student}.zip", {**files, **shadows, **named})


@WAYS.packed()
def zip_with_backslashes(folder: Path, work: Work) -> None:
    """Compressed by an old program for Windows: backslashes in names, and names in the alphabet of DOS."""
    files = {f"Xbung\\{name}": content for name, content in work.contents().items()}
    files["Xbung\\Gr_sse.txt"] = b"3 kg"
    content = zipped(files).replace(b"Xbung\\", b"\x9abung\\").replace(b"Gr_sse", b"Gr\x94sse")
    (folder / f"{work.student}.zip").write_bytes(content)


@WAYS.packed()
def zip_downloaded_twice(folder: Path, work: Work) -> None:
    """Handed in two zips, the second named (1) by the browser; the first was only half done."""
    as_zip(folder / work.student / "notebooks.zip", half_done(work), "notebooks", (2026, 2, 1, 12, 0, 0))
    as_zip(folder / work.student / "notebooks (1).zip", work.contents(), "notebooks", WRITTEN)


@WAYS.packed()
def zip_with_folders_of_its_own(folder: Path, work: Work) -> None:
    """A zip with entries for folders, a comment, stored without compression."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        archive.comment = "made with love ♥".encode()
        archive.writestr(zipfile.ZipInfo("notebooks/", WRITTEN), b"")
        archive.writestr(zipfile.ZipInfo("notebooks/.ipynb_checkpoints/", WRITTEN), b"")
        for name, content in work.contents().items():
            archive.writestr(zipfile.ZipInfo(f"notebooks/{name}", WRITTEN), content)
    (folder / f"{work.student}.zip").write_bytes(buffer.getvalue())


@WAYS.packed()
def names_by_browsers(folder: Path, work: Work) -> None:
    """Notebooks went through browsers and mail: (1), -1, Copy of, _1, .ipynb.txt, .ipynb.json, %20, capitals."""
    forms = ("{} (1).ipynb", "{}-1.ipynb", "Copy of {}.ipynb", "{}(2).ipynb", "{}.ipynb.txt", "{}_1.ipynb",
             "{}%20%281%29.ipynb", "Kopie von {}.ipynb", "{}-Copy1.ipynb", "{}.IPYNB", "{}.ipynb.json")  # fmt: skip
    files = {name: content for name, content in work.contents().items() if not name.endswith(".ipynb")}
    for form, (name, content) in zip(forms, notebooks_only(work).items(), strict=True):
        files[form.format(name.removesuffix(".ipynb"))] = content
    as_folder(folder / work.student, files)


@WAYS.packed()
def names_with_ones_own(folder: Path, work: Work) -> None:
    """Put their own name and a date into the name of each notebook."""
    files = {name: content for name, content in work.contents().items() if not name.endswith(".ipynb")}
    files |= {n.replace(".ipynb", "_Müller_final.ipynb"): content for n, content in notebooks_only(work).items()}
    as_folder(folder / work.student, files)


@WAYS.packed()
def copies_beside(folder: Path, work: Work) -> None:
    """Copies of OneDrive and JupyterLab, half done, stand beside the finished notebooks."""
    files = work.contents()
    for name, content in half_done(work).items():
        if name.startswith(SECOND_HALF):
            files[name.replace(".ipynb", "-DESKTOP-8KQ2L1P.ipynb")] = content
            files[name.replace(".ipynb", "-Copy1.ipynb")] = content
    as_folder(folder / work.student, files)


@WAYS.packed()
def weeks_in_folders(folder: Path, work: Work) -> None:
    """Sorted the notebooks into folders, by weeks, each with a course.json."""
    weeks = {"week 1": ("00", "01"), "week 2": ("02", "03", "04"), "weeks 3+4/control": SECOND_HALF}
    files = {f"{week}/{name}": c for week, numbers in weeks.items() for name, c in only(work, *numbers).items()}
    as_folder(folder / work.student, files)


@WAYS.packed()
def folder_in_folder(folder: Path, work: Work) -> None:
    """A folder in a folder in a folder, with long names, blanks and a dot at its end."""
    within = "My Documents/University of Somewhere/Laboratory of Control Engineering, Group 7/final (really)/notebooks."
    as_folder(folder / work.student / within, work.contents())


@WAYS.packed(student="id-typed-in-other-capitals")
def id_in_other_capitals(folder: Path, work: Work) -> None:
    """The folder has the ID as the instructor knows it, course.json has it in other capitals."""
    work.set_student("ID-Typed-In-OTHER-Capitals")
    as_folder(folder / work.student, work.contents())


@WAYS.packed(student="Zoë Brüggemann")
def id_decomposed(folder: Path, work: Work) -> None:
    """A Mac named the folder: its accents are decomposed, while course.json has them composed."""
    work.set_student(composed(work.student))
    as_folder(folder / decomposed(work.student), work.contents())


@WAYS.packed(student="Åsa Öberg")
def id_decomposed_in_the_course(folder: Path, work: Work) -> None:
    """The other way round: typed decomposed with blanks around it, and the zip's name is composed."""
    work.set_student(f" {decomposed(work.student)} ")
    as_zip(folder / f"{composed(work.student)}.zip", work.contents(), within="notebooks")


@WAYS.packed()
def id_in_the_first_cell(folder: Path, work: Work) -> None:
    """Typed the ID into each first cell; there is no course.json."""
    without_release(work)
    as_folder(folder / work.student, work.contents())


@WAYS.packed(roster=(Row("id-in-the-course", "Bo Li", "bo@example.edu"),), student="id-in-the-course")
def name_that_is_no_id(folder: Path, work: Work) -> None:
    """Came by mail in a zip with a name that says nothing; course.json has the ID."""
    as_zip(folder / "final hand-in (2).zip", work.contents(), within="rotflex-course/notebooks")


@WAYS.packed(student="pair.ada", others=("pair.grace",))
def pair(folder: Path, work: Work) -> None:
    """One hand-in of two, named so; the bench is that of the one whose ID is in course.json."""
    as_folder(folder / "pair.ada+pair.grace", work.contents())
