"""Everything right, in the packings and under the names that platforms, systems and people give to it."""

from pathlib import Path

from honest_hand_in import Files, Ways, Work, as_folder, written, zipped

WAYS = Ways()
SECOND_HALF = ("05", "06", "07", "08", "09", "10")


def only(work: Work, *numbers: str) -> Files:
    """The files of a hand-in, without the notebooks whose names start with none of these numbers."""
    return {n: content for n, content in work.contents().items() if n.startswith(numbers) or not n.endswith(".ipynb")}


def notebooks_only(work: Work) -> Files:
    return {name: written(notebook) for name, notebook in work.notebooks.items()}


@WAYS.packed()
def zip_by_finder(folder: Path, work: Work) -> None:
    """Compressed by macOS: __MACOSX with a shadow of each file, .DS_Store, decomposed names."""
    files = {f"notebooks/{name}": content for name, content in work.contents().items()}
    shadows = {f"__MACOSX/notebooks/._{name}": b"\0\x05\x16\x07\0\x02\0\0Mac OS X" for name in work.contents()}
    named = {"notebooks/U\u0308bersicht.md": b"# mine", "notebooks/.DS_Store": b"\0\0\0\1Bud1"}
    (folder / f"{work.student}.zip").write_bytes(zipped({**files, **shadows, **named}))


@WAYS.packed()
def zip_with_backslashes(folder: Path, work: Work) -> None:
    """Compressed by an old program for Windows: backslashes in names, and names in the alphabet of DOS."""
    files = {f"Xbung\\{name}": content for name, content in work.contents().items()}
    files["Xbung\\Gr_sse.txt"] = b"3 kg"
    content = zipped(files).replace(b"Xbung\\", b"\x9abung\\").replace(b"Gr_sse", b"Gr\x94sse")
    (folder / f"{work.student}.zip").write_bytes(content)


@WAYS.packed()
def weeks_in_folders(folder: Path, work: Work) -> None:
    """Sorted the notebooks into folders, by weeks, each with a course.json."""
    weeks = {"week 1": ("00", "01"), "week 2": ("02", "03", "04"), "weeks 3+4/control": SECOND_HALF}
    files = {f"{week}/{name}": c for week, numbers in weeks.items() for name, c in only(work, *numbers).items()}
    as_folder(folder / work.student, files)
