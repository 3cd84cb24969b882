"""Everything right, but not cell for cell as it was handed out: added, split, merged, moved, renewed, deleted cells."""

import copy

from honest_hand_in import Ways, Work, code, markdown, text_of

WAYS = Ways()

_ARM = "arm = lab.joint\nbottom = arm.m_1 * arm.L_1**2 / 3\ntop = arm.m_2 * arm.L_2**2 / 12 + arm.m_2 * arm.d_12**2"


@WAYS.changed()
def plain(work: Work) -> None:
    """Nothing but the answers, in their cells."""


@WAYS.changed(answers_json=True)
def plain_with_answers_recorded_at_home(work: Work) -> None:
    """The usual case: the folder as it is after the work, with the answers.json that the notebooks wrote."""


@WAYS.changed(told=("student = 'Ada Lovelace' changes nothing",))
def own_name_in_a_cell(work: Work) -> None:
    """Wrote their name in a cell of their own, between the parameters and the setup of 02 and 03."""
    for name in ("02_finding_stiffness.ipynb", "03_model_validation.ipynb"):
        work.notebooks[name]["cells"].insert(1, code('student = "Ada Lovelace"\nprint("Lab 2 by", student)'))


@WAYS.changed()
def begun_again(work: Work) -> None:
    """Began a session of their own in a cell, without an ID, and left papermill's cell of parameters in it."""
    cells = work.notebooks["06_control_design.ipynb"]["cells"]
    cells.insert(1, code('# Parameters\nstudent = "demo"\nbench = "virtual"\n'))
    work.before("q3-7", code('import rotflex.course.lab\nlab = rotflex.course.lab.start("", "virtual")'))


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
def computed_above(work: Work) -> None:
    """Computed in a cell of their own above, and only assigned in the answer cell."""
    work.before(
        "q3-12",
        code("""
angle = turn.degrees("theta")
late = np.flatnonzero(np.abs(angle + 20) > 0.8)
settled_at = turn.time[late[-1] + 1]
over = 100 * (-20 - angle.min()) / 40
bend = np.abs(turn.degrees("alpha")).max()
volts = np.abs(turn["vm"]).max()
"""),
    )
    verdict = 'satisfied = "yes" if t_s <= 0.5 and PO <= 5 and alpha_max_deg <= 12.5 and V_max <= 10 else "no"'
    work.write("q3-12", f"t_s, PO, alpha_max_deg, V_max = settled_at, over, bend, volts\n{verdict}")


@WAYS.changed()
def answer_in_a_cell_below(work: Work) -> None:
    """Left answer cells as they were, and answered in cells added below them."""
    for cell in ("q2-11", "q2-18", "q3-8"):
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


@WAYS.changed()
def locked_cells_copied_to_play(work: Work) -> None:
    """Copied locked cells, as the texts ask, and changed numbers in the copies (which keep the locked metadata)."""
    zoom, example = (copy.deepcopy(work.cell(cell)) for cell in ("first-zoom", "example"))
    changes = (zoom, "10ad5e11", "1.5, 1.6", "0.1, 0.6"), (example, "10ad5e12", "38, 29, 6", "30, 29, 6")
    for cell, name, old, new in changes:
        text = text_of(cell)
        assert old in text
        cell.update(id=name, source=text.replace(old, new).splitlines(keepends=True))
    work.after("first-zoom", zoom)
    work.after("example", example)


@WAYS.changed()
def locked_setup_changed_harmlessly(work: Work) -> None:
    """Changed a locked cell in an editor that knows no locks, to no effect: a comment, and figures of another size."""
    work.replace("setup", "import numpy as np", "import numpy as np  # numbers", number="02")
    work.replace("turn", "turn = None", "# one turn of the servo\nturn = None")


@WAYS.changed()
def answers_read_back(work: Work) -> None:
    """Takes earlier answers by lab.value instead of by their names, and looks at the summary all the time."""
    work.write(
        "q2-12", "omega = lab.value('2.11', 'omega_n')\n" + _ARM + "\nJ_l = bottom + top\nK_s = J_l * omega**2\n"
    )
    work.before("q3-5", code("lab.summary()"), code("lab.progress()"))


@WAYS.changed()
def check_left_in(work: Work) -> None:
    """Left the calls of lab.check() and lab.submit() in a last cell of each notebook."""
    for notebook in work.notebooks.values():
        notebook["cells"].append(code("lab.check()"))
        notebook["cells"].append(code("lab.submit()"))
