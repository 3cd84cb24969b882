"""Everything right, but not cell for cell as it was handed out: added, split, merged, moved, renewed, deleted cells."""

import copy

from honest_hand_in import Ways, Work, code, markdown, text_of

WAYS = Ways()


@WAYS.changed()
def plain(work: Work) -> None:
    """Nothing but the answers, in their cells."""


@WAYS.changed()
def split_in_jupyterlab(work: Work) -> None:
    """Split an answer cell in JupyterLab: each piece has a new id, and all of them the metadata of the one."""
    cells, index = work.place("q3-7")
    old = cells[index]
    head, tail = text_of(old).split("W = T @", 1)
    pieces = [
        {**copy.deepcopy(code(text)), "metadata": copy.deepcopy(old["metadata"])} for text in (head, "W = T @" + tail)
    ]
    cells[index : index + 1] = pieces


@WAYS.changed()
def merged_with_the_locked_cell(work: Work) -> None:
    """Merged an answer cell with the locked one that records it, in an editor that knows no locks."""
    work.write("q3-9", text_of(work.cell("q3-9")) + "\n" + text_of(work.delete("q3-9-answer")))


@WAYS.changed()
def all_ids_renewed(work: Work) -> None:
    """An editor gave every cell a new id when it saved."""
    for notebook in work.notebooks.values():
        for number, cell in enumerate(notebook["cells"]):
            cell["id"] = f"{number * 2654435761 % 2**32:08x}"


@WAYS.changed()
def notes_added(work: Work) -> None:
    """Added headings, notes and to-do lists as text cells all over, some of them beside answers in words."""
    for notebook in work.notebooks.values():
        for number, index in enumerate(range(len(notebook["cells"]), 0, -3)):
            notebook["cells"].insert(
                index, markdown(f"### Note {number} ✎\n\n* [ ] ask in the *tutorial* about this, $x_{number}$")
            )


@WAYS.changed()
def own_cells_first_and_last(work: Work) -> None:
    """Has a title and a cell of magics above the first cell, and a playground below the last."""
    for notebook in work.notebooks.values():
        first = [
            markdown("# My lab course, summer term"),
            code("%matplotlib inline\n%load_ext autoreload\n%autoreload 2"),
        ]
        notebook["cells"] = [*first, *notebook["cells"], code("print('done', lab.joint.arm_position)")]


@WAYS.changed()
def answer_in_a_cell_below(work: Work) -> None:
    """Left answer cells as they were, and answered in cells added below them."""
    for cell in ("q3-1", "q3-10"):
        answer = text_of(work.cell(cell))
        head, _, own = answer.partition("\n")
        preset, own = own.split("\n", 1)
        work.write(cell, f"{head}\n{preset}\n# Your code here.")
        work.after(cell, code(own))


@WAYS.changed()
def answer_below_the_locked_cell(work: Work) -> None:
    """Added a cell below the locked one, and called lab.answer in it again."""
    own = text_of(work.cell("q2-18"))
    work.write(
        "q2-18", "# ✎ Your answer: 2.18\npoles = None  # four numbers, complex where they are\n# Your code here."
    )
    work.after("q2-18-answer", code(own + '\nlab.answer("2.18", poles=poles)'))


@WAYS.changed()
def scratch_that_fails(work: Work) -> None:
    """Left attempts of their own that stop with an error, which no answer uses."""
    work.before("q2-10", code("sweep.angle  # no such thing?"))
    work.before("q3-9", code("np.linalg.eig(A, B)"), code("this is not python, I only wanted to note something"))
    work.after("summary", code("1 / 0"), number="02")
