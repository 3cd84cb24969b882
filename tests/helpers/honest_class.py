"""The honest class: ways of handing in a solved course, thought up by someone who had not read the code.

The first lot is to have full marks, however it was written and packed. In the second something is wrong, honestly, and
``told`` is what has to be said to the student. `honest_hand_in` says what a way is; `solved_notebooks` makes what they
all begin with.
"""

import copy
from pathlib import Path

from checkout import ROOT
from honest_hand_in import (
    Files,
    Way,
    Ways,
    Work,
    as_folder,
    code,
    markdown,
    released_notebooks,
    solved_notebooks,
    text_of,
    written,
    zipped,
)

__all__ = ["RIGHT", "WAYS", "WRONG", "Way", "solved_notebooks"]

RIGHT, WRONG = Ways(), Ways()


# --- not cell for cell as it was handed out: added, split, merged, moved, deleted cells -------------------------------


@RIGHT.changed()
def plain(work: Work) -> None:
    """Nothing but the answers, in their cells."""


@RIGHT.changed()
def split_in_jupyterlab(work: Work) -> None:
    """Split an answer cell in JupyterLab: each piece has a new id, and all of them the metadata of the one."""
    cells, index = work.place("q3-7")
    old = cells[index]
    head, tail = text_of(old).split("W = T @", 1)
    pieces = [
        {**copy.deepcopy(code(text)), "metadata": copy.deepcopy(old["metadata"])} for text in (head, "W = T @" + tail)
    ]
    cells[index : index + 1] = pieces


@RIGHT.changed()
def merged_with_the_locked_cell(work: Work) -> None:
    """Merged an answer cell with the locked one that records it, in an editor that knows no locks."""
    work.write("q3-9", text_of(work.cell("q3-9")) + "\n" + text_of(work.delete("q3-9-answer")))


@RIGHT.changed()
def notes_added(work: Work) -> None:
    """Added headings, notes and to-do lists as text cells all over, some of them beside answers in words."""
    for notebook in work.notebooks.values():
        for number, index in enumerate(range(len(notebook["cells"]), 0, -3)):
            notebook["cells"].insert(
                index, markdown(f"### Note {number} ✎\n\n* [ ] ask in the *tutorial* about this, $x_{number}$")
            )


@RIGHT.changed()
def own_cells_first_and_last(work: Work) -> None:
    """Has a title and a cell of magics above the first cell, and a playground below the last."""
    for notebook in work.notebooks.values():
        first = [
            markdown("# My lab course, summer term"),
            code("%matplotlib inline\n%load_ext autoreload\n%autoreload 2"),
        ]
        notebook["cells"] = [*first, *notebook["cells"], code("print('done', lab.joint.arm_position)")]


@RIGHT.changed()
def answer_in_a_cell_below(work: Work) -> None:
    """Left answer cells as they were, and answered in cells added below them."""
    for cell in ("q3-1", "q3-10"):
        answer = text_of(work.cell(cell))
        head, _, own = answer.partition("\n")
        preset, own = own.split("\n", 1)
        work.write(cell, f"{head}\n{preset}\n# Your code here.")
        work.after(cell, code(own))


@RIGHT.changed()
def answer_below_the_locked_cell(work: Work) -> None:
    """Added a cell below the locked one, and called lab.answer in it again."""
    own = text_of(work.cell("q2-18"))
    work.write(
        "q2-18", "# ✎ Your answer: 2.18\npoles = None  # four numbers, complex where they are\n# Your code here."
    )
    work.after("q2-18-answer", code(own + '\nlab.answer("2.18", poles=poles)'))


@RIGHT.changed()
def scratch_that_fails(work: Work) -> None:
    """Left attempts of their own that stop with an error, which no answer uses."""
    work.before("q2-10", code("sweep.angle  # no such thing?"))
    work.before("q3-9", code("np.linalg.eig(A, B)"), code("this is not python, I only wanted to note something"))
    work.after("summary", code("1 / 0"), number="02")


# --- code as people write it: magics, prints, annotations, async, styles, names of their own --------------------------


_PEAK = "inside = (f_hz >= 1) & (f_hz <= 5)\nbest = f_hz[inside][np.argmax(amplitude_deg[inside])]\n"


@RIGHT.changed()
def magics(work: Work) -> None:
    """Times cells, asks for help and sets up matplotlib by magics, in own cells and within answers."""
    for number in ("02", "03", "07"):
        setting = '%matplotlib inline\n%config InlineBackend.figure_format = "retina"'
        work.after("setup", code(setting), number=number)
    work.write("q3-11", "%%time\n" + text_of(work.cell("q3-11")))
    work.after("q2-10", code("%timeit -n 2 -r 1 spectrum(sweep['alpha'], 0.002)"), code("np.fft.fft?"), code("%who"))
    work.write("q2-11", _PEAK + "%time omega_n = 2 * np.pi * best\n")


@RIGHT.changed()
def matplotlib_qt(work: Work) -> None:
    """Wants windows for the plots, which there are at home and not where grading runs."""
    for number in ("02", "03", "07", "08", "09"):
        work.after("setup", code("%matplotlib qt"), number=number)


@RIGHT.changed()
def star_imports(work: Work) -> None:
    """Imports everything from everywhere below the setup cell."""
    work.after("setup", code("from sympy import *"), number="01")
    work.after("setup", code("from numpy import *\nfrom math import *\nfrom matplotlib.pyplot import *"), number="02")
    work.after("setup", code("from pylab import *"), number="06")


# --- files of one's own beside the notebooks, or notebooks written by other programs ----------------------------------


@RIGHT.changed()
def own_package_in_subfolders(work: Work) -> None:
    """Has a package of their own in subfolders named tools and src, the latter by way of sys.path."""
    work.files |= {"tools/__init__.py": b"", "tools/arms/__init__.py": b"from .rods import rod\n"}
    work.files |= {"tools/arms/rods.py": b"def rod(m, L):\n    return m * L**2 / 3\n"}
    work.files["src/moved.py"] = b"def moved(m, L, d):\n    return m * (L**2 / 12 + d**2)\n"
    work.write(
        "q2-8",
        "import sys\n\nsys.path.insert(0, 'src')\nfrom moved import moved\nfrom tools.arms import rod\n\n"
        "J_link = rod(m_1, L_1) + moved(m_2, L_2, d_12)",
    )


@RIGHT.changed()
def own_file_between_notebooks(work: Work) -> None:
    """Hands numbers from one notebook to the next by a file that the first one writes."""
    work.after("q2-12-answer", code("np.savez('mine.npz', J_l=J_l, K_s=K_s)"))
    work.write(
        "q2-14",
        "mine = np.load('mine.npz')\n"
        "A, B, C, D = state_space(float(mine['K_s']), float(mine['J_l']), lab.servo.J_eq, lab.servo.B_eq)",
    )


@RIGHT.changed()
def everything_lost_as_by_kaggle(work: Work) -> None:
    """Saved by Kaggle: format 4.4, no ids, and its own metadata in place of all others."""
    for notebook in work.notebooks.values():
        notebook["nbformat_minor"] = 4
        notebook["metadata"]["kaggle"] = {
            "accelerator": "none",
            "isInternetEnabled": True,
            "dockerImageVersionId": 30698,
        }
        for cell in notebook["cells"]:
            del cell["id"]
            cell["metadata"] = {"trusted": True, "execution": {"iopub.status.busy": "2026-03-01T10:00:00.000Z"}}


@RIGHT.packed()
def written_otherwise(folder: Path, work: Work) -> None:
    """Notebooks' files as other programs write them: CRLF, a byte order mark, one line, letters escaped."""
    files = work.contents()
    options = [{}, {"ensure_ascii": True}, {"indent": None}, {"sort_keys": True}, {"indent": 4}]
    for number, (name, notebook) in enumerate(work.notebooks.items()):
        content = written(notebook, **options[number % len(options)])
        content = content.replace(b"\n", b"\r\n") if number % 2 else content
        files[name] = b"\xef\xbb\xbf" + content if number % 3 == 0 else content
    as_folder(folder / work.student, files)


@RIGHT.changed()
def exports_beside(work: Work) -> None:
    """Exported each notebook as a page, a script and a PDF, and left these beside, with notes and a picture."""
    for name in list(work.notebooks):
        stem = name.removesuffix(".ipynb")
        work.files |= {
            f"{stem}.html": b"<html></html>",
            f"{stem}.py": b"# coding: utf-8\nlab\n",
            f"{stem}.pdf": b"%PDF-1.7",
        }
    work.files |= {"notes.docx": b"PK\x03\x04", "Thumbs.db": b"\xd0\xcf\x11\xe0", "desktop.ini": b"[.ShellClassInfo]"}
    work.files |= {"~$notes.docx": b"\x05", ".DS_Store": b"\0\0\0\1Bud1", "figures/sweep.png": b"\x89PNG\r\n\x1a\n"}


# --- the packings and names that platforms, systems and people give to it ---------------------------------------------


def only(work: Work, *numbers: str) -> Files:
    """The files of a hand-in, with those notebooks only that have one of these numbers."""
    return {n: content for n, content in work.contents().items() if n.startswith(numbers) or not n.endswith(".ipynb")}


@RIGHT.packed()
def zip_with_backslashes(folder: Path, work: Work) -> None:
    """Compressed by an old program for Windows: backslashes in names, and names in the alphabet of DOS."""
    files = {f"Xbung\\{name}": content for name, content in work.contents().items()}
    files["Xbung\\Gr_sse.txt"] = b"3 kg"
    content = zipped(files).replace(b"Xbung\\", b"\x9abung\\").replace(b"Gr_sse", b"Gr\x94sse")
    (folder / f"{work.student}.zip").write_bytes(content)


@RIGHT.packed()
def weeks_in_folders(folder: Path, work: Work) -> None:
    """Sorted the notebooks into folders, by weeks, each with a course.json."""
    weeks = {"week 1": ("00", "01"), "week 2": ("02", "03", "04"), "weeks 3+4": ("05", "06", "07", "08", "09", "10")}
    files = {f"{week}/{name}": c for week, numbers in weeks.items() for name, c in only(work, *numbers).items()}
    as_folder(folder / work.student, files)


# --- something wrong: code that stops, or that works at home only -----------------------------------------------------


AFTER_2_11 = ("2.12", "2.14", "2.15", "2.18", "Table 2", "Table 3", *(f"3.{n}" for n in (2, 3, *range(5, 17))))


@WRONG.changed(lost=("2.11", *AFTER_2_11), told=(r"2\.11", r"NameError", r"omgea", r"line 3", r"2\.12", r"build"))
def name_error(work: Work) -> None:
    """Mistyped a name in 2.11; all that builds on it goes too, and no answer in words."""
    work.write("q2-11", _PEAK + "omega_n = 2 * np.pi * omgea")


@WRONG.changed(lost=("3.1",), told=(r"3\.1", r"NameError", r"verdict_of", r"further (down|below)|later|not defined"))
def run_out_of_order(work: Work) -> None:
    """Uses a name that is defined in a cell further down, and ran that one first at home."""
    work.write("q3-1", "stability = verdict_of(lab.value('2.18', 'poles'))")
    work.after("q3-5-answer", code("def verdict_of(poles):\n    return 'marginally stable'"))


# --- something wrong: numbers, and what was not handed in -------------------------------------------------------------


PRELAB = ("2.1", "2.2", "2.3", "2.4", "2.5", "2.6", "2.7", "2.8")
ALL = {*PRELAB, "2.9", "2.10", "2.11", "2.13", "2.16", "2.17", "3.1", "3.4", "3.17", *AFTER_2_11}
ALL |= {f"{report} report{whole}" for report in ("Modeling", "Control") for whole in ("", ", as a whole")}


@WRONG.changed(lost=("3.5",), told=(r"3\.5", r"open-loop polynomial less the desired one"))
def sign_of_the_gain(work: Work) -> None:
    """Took the open-loop polynomial minus the desired one: all gains have the wrong sign, and the servo runs away."""
    work.replace("q3-5", "(desired_polynomial - open_loop_polynomial)", "(open_loop_polynomial - desired_polynomial)")


@WRONG.changed(
    lost=("3.15", "3.16", "3.17", "Table 3"), told=(r"09_partial_state_feedback", r"missing|not handed in|no ")
)
def notebook_forgotten(work: Work) -> None:
    """Did not hand in 09."""
    del work.notebooks[work.name("09")]


@WRONG.changed(lost=PRELAB, told=(r"01_modeling_prelab", r"missing|not handed in|download"))
def notebook_in_the_cloud(work: Work) -> None:
    """iCloud had taken 01 off the disk: in its place is a small file that only stands for it."""
    work.files[f".{work.name('01')}.icloud"] = b"bplist00\xd3\x01\x02\x03"
    del work.notebooks[work.name("01")]


@WRONG.changed(lost=("2.11",), told=(r"2\.11", r"explanation", r"empty|not answered|no text|words"))
def words_in_a_code_cell(work: Work) -> None:
    """Wrote the explanation as comments and a string into the code cell, and left the text cell as it was."""
    words = text_of(work.cell("q2-11-explanation")).split("\n\n", 1)[1]
    released = {cell["id"]: cell for cell in released_notebooks(ROOT)[work.name("02")]["cells"]}
    work.write("q2-11-explanation", text_of(released["q2-11-explanation"]))
    work.write("q2-11", text_of(work.cell("q2-11")) + f'\nexplanation = r"""{words}"""\n')


@WRONG.packed(lost=ALL, told=(r"no notebook", r"pdf|html"))
def pages_instead_of_notebooks(folder: Path, work: Work) -> None:
    """Handed in the notebooks printed as pages."""
    stems = [name.removesuffix(".ipynb") for name in work.notebooks]
    as_folder(
        folder / work.student, {f"{s}.html": b"<html><h1>done</h1></html>" for s in stems} | {"all.pdf": b"%PDF-1.7"}
    )


WAYS: list[Way] = [*RIGHT, *WRONG]
