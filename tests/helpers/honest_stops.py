"""Something wrong, honestly: code that stops, or that works at home only. ``told`` is what the student must read."""

from honest_hand_in import Ways, Work, code, text_of

WAYS = Ways()

AFTER_K = ("3.9", "3.11", "3.12", "3.13", "3.14", "3.15", "3.16", "Table 3")
AFTER_W = ("3.8", *AFTER_K)
AFTER_MODEL = ("3.2", "3.3", "3.5", "3.6", "3.7", "3.10", *AFTER_W)
AFTER_2_14 = ("2.15", "2.18", "Table 2", *AFTER_MODEL)
AFTER_2_12 = ("2.14", *AFTER_2_14)
AFTER_2_11 = ("2.12", *AFTER_2_12)
_PEAK = "inside = (f_hz >= 1) & (f_hz <= 5)\nbest = f_hz[inside][np.argmax(amplitude_deg[inside])]\n"


@WAYS.changed(lost=("2.11", *AFTER_2_11), told=(r"2\.11", r"NameError", r"omgea", r"line 3", r"2\.12", r"build"))
def name_error(work: Work) -> None:
    """Mistyped a name in 2.11; all that builds on it goes too, and no answer in words."""
    work.write("q2-11", _PEAK + "omega_n = 2 * np.pi * omgea")


@WAYS.changed(lost=("Table 3",), told=(r"Table 3", r"took (too long|longer)|time", r"\d+ s"))
def endless_loop(work: Work) -> None:
    """Waits in Table 3 for a number that never becomes small."""
    work.write("table-3", text_of(work.cell("table-3")) + "\nwhile t_s_sim is not None and t_s_sim > 0:\n    pass\n")


@WAYS.changed(lost=("2.8",), told=(r"2\.8", r"ModuleNotFoundError|not found|no file", r"my_rods"))
def module_forgotten(work: Work) -> None:
    """Handed in the notebooks, but not the module that they import."""
    work.write("q2-8", "from my_rods import rod\n\nJ_link = rod(m_1, L_1) + m_2 * (L_2**2 / 12 + d_12**2)")


@WAYS.changed(lost=("3.10",), told=(r"3\.10", r"statistics\.py"))
def module_named_like_pythons_own(work: Work) -> None:
    """Named their own module like one of Python's; at home the folder comes first, and it works."""
    work.files["statistics.py"] = b"from control import place as gain_for\n"
    work.write("q3-10", "from statistics import gain_for\n\nK_library = gain_for(A, B, desired_poles)")


@WAYS.changed(lost=("3.1",), told=(r"3\.1", r"NameError", r"verdict_of", r"further (down|below)|later|not defined"))
def run_out_of_order(work: Work) -> None:
    """Uses a name that is defined in a cell further down, and ran that one first at home."""
    work.write("q3-1", "stability = verdict_of(lab.value('2.18', 'poles'))")
    work.after("q3-5-answer", code("def verdict_of(poles):\n    return 'marginally stable'"))


@WAYS.changed(lost=("2.7",), told=(r"2\.7", r"NameError", r"my_state"))
def cell_deleted_after_running(work: Work) -> None:
    """Deleted a cell whose names are still used; at home they were still there, and it said recorded."""
    work.replace("q2-7", "rates.jacobian([theta, alpha, theta_dot, alpha_dot])", "rates.jacobian(my_state)")


@WAYS.changed(lost=("3.14", "Table 3"), told=(r"3\.14", r"stopped|ended|memory|recursion"))
def recursion_without_limit(work: Work) -> None:
    """Raised the limit of recursion, so that Python itself goes down."""
    crash = "import sys\n\nsys.setrecursionlimit(10**9)\n\n\ndef deeper(n):\n    return deeper([n])\n\n\ndeeper(1)"
    work.write("q3-14", crash)


@WAYS.changed(lost=("3.16", "Table 3"), told=(r"3\.16", r"memory"))
def too_much_memory(work: Work) -> None:
    """Compares every sample with every other, of all runs, in one array."""
    work.write("q3-16", "everything = np.ones((200_000, 200_000))\n" + text_of(work.cell("q3-16")))


@WAYS.changed(lost=("3.12", "Table 3"), told=(r"locked|changed", r"setup", r"3\.12", r"NameError", r"math"))
def import_in_a_locked_cell(work: Work) -> None:
    """Added an import to the locked setup cell, in an editor that knows no locks, and uses it in an answer."""
    work.replace("setup", "import numpy as np", "import math\nimport numpy as np", number="07")
    work.write("q3-12", text_of(work.cell("q3-12")) + "\nV_max = math.fabs(V_max)\nt_s = math.fabs(t_s)")


@WAYS.changed(lost=("3.6",), told=(r"3\.6", r"input"))
def asks_for_input(work: Work) -> None:
    """Asks for the number by input(), and types it in at home."""
    work.write("q3-6", "rank = int(input('rank of the matrix? '))\ncontrollable = 'yes'")


@WAYS.changed(lost=("2.9",), told=(r"2\.9", r"figure", r"empty|no (curve|line|axes)|nothing|label"))
def figure_taken_after_it_was_shown(work: Work) -> None:
    """Took the figure by plt.gcf() after plt.show(), which closes it: this is a new and empty one."""
    plot = "plt.plot(sweep.time, sweep.degrees('alpha'))\nplt.xlabel('t (s)')\nplt.ylabel('alpha (deg)')\n"
    run = "with lab.bench() as on_the_bench:\n    sweep = experiments.sweep(on_the_bench)\n"
    work.write("q2-9", f"{run}{plot}plt.show()\nplt.close('all')\nfigure_sweep = plt.gcf()")
