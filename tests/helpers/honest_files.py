"""Everything right, with files of one's own beside the notebooks, or notebooks written by other programs."""

import json
from pathlib import Path

from honest_hand_in import Ways, Work, as_folder, code, written

WAYS = Ways()


@WAYS.changed()
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


@WAYS.changed()
def own_data(work: Work) -> None:
    """Reads numbers of their own from a CSV, a JSON file and a text with blanks and umlauts in its name."""
    work.files["data/poles.csv"] = b"sigma;omega\r\n-12;16\r\n-12;-16\r\n-30;0\r\n-40;0\r\n"
    work.files["limits.json"] = json.dumps({"t_s": 0.5, "PO": 5, "alpha": 12.5, "V": 10}).encode()
    work.files["meine Größen.txt"] = "Dämpfung 0.6\n".encode("latin-1")
    work.write(
        "q3-4",
        "sigma, omega = np.loadtxt('data/poles.csv', delimiter=';', skiprows=1).T\n"
        "open('meine Größen.txt', encoding='latin-1').read()\n"
        "desired_poles = sigma + 1j * omega\ndesired_polynomial = np.poly(desired_poles).real",
    )
    work.replace(
        "q3-14",
        'satisfied = "yes" if t_s <= 0.5',
        'import json\nlimits = json.load(open(\'limits.json\'))\nsatisfied = "yes" if t_s <= limits["t_s"]',
    )


@WAYS.changed()
def own_file_between_notebooks(work: Work) -> None:
    """Hands numbers from one notebook to the next by a file that the first one writes."""
    work.after("q2-12-answer", code("np.savez('mine.npz', J_l=J_l, K_s=K_s)"))
    work.write(
        "q2-14",
        "mine = np.load('mine.npz')\n"
        "A, B, C, D = state_space(float(mine['K_s']), float(mine['J_l']), lab.servo.J_eq, lab.servo.B_eq)",
    )


@WAYS.changed()
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


def without_release(work: Work) -> None:
    """Only the notebooks, with the ID typed into the first cell of each."""
    for name in work.notebooks:
        work.replace("parameters", 'student = ""', f'student = "{work.student}"', number=name)
    work.files.clear()


@WAYS.changed()
def by_colab(work: Work) -> None:
    """Used Colab: format 4.0, ids in the metadata, the course installed by pip, a drive mounted; no course.json."""
    without_release(work)
    install = code("!pip install -q rotflex-course.zip\nfrom google.colab import drive\ndrive.mount('/content/drive')")
    for notebook in work.notebooks.values():
        notebook["cells"].insert(0, install)
        notebook["nbformat_minor"] = 0
        notebook["metadata"]["colab"] = {"provenance": [], "toc_visible": True}
        notebook["cells"] = [
            {
                **{key: value for key, value in cell.items() if key != "id"},
                "metadata": {**cell["metadata"], "id": cell["id"]},
            }
            for cell in notebook["cells"]
        ]


@WAYS.packed()
def written_otherwise(folder: Path, work: Work) -> None:
    """Notebooks' files as other programs write them: CRLF, a byte order mark, one line, letters escaped."""
    files = work.contents()
    options = [{}, {"ensure_ascii": True}, {"indent": None}, {"sort_keys": True}, {"indent": 4}]
    for number, (name, notebook) in enumerate(work.notebooks.items()):
        content = written(notebook, **options[number % len(options)])
        content = content.replace(b"\n", b"\r\n") if number % 2 else content
        files[name] = b"\xef\xbb\xbf" + content if number % 3 == 0 else content
    as_folder(folder / work.student, files)


@WAYS.changed()
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
