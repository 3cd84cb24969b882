"""Everything right, in code as people write it: magics, prints, annotations, async, styles, names of their own."""

from honest_hand_in import Ways, Work, code, text_of

WAYS = Ways()

_SWEEP = "with lab.bench() as on_the_bench:\n    sweep = experiments.sweep(on_the_bench)\n"
_PEAK = "inside = (f_hz >= 1) & (f_hz <= 5)\nbest = f_hz[inside][np.argmax(amplitude_deg[inside])]\n"


@WAYS.changed()
def magics(work: Work) -> None:
    """Times cells, asks for help and sets up matplotlib by magics, in own cells and within answers."""
    for number in ("02", "03", "07"):
        setting = '%matplotlib inline\n%config InlineBackend.figure_format = "retina"'
        work.after("setup", code(setting), number=number)
    work.write("q3-11", "%%time\n" + text_of(work.cell("q3-11")))
    work.after("q2-10", code("%timeit -n 2 -r 1 spectrum(sweep['alpha'], 0.002)"), code("np.fft.fft?"), code("%who"))
    work.write("q2-11", _PEAK + "%time omega_n = 2 * np.pi * best\n")


@WAYS.changed()
def shell_commands(work: Work) -> None:
    """Begins with !pip install and !ls, as on Colab, whether or not anything can be installed here."""
    for number in ("02", "05", "06"):
        work.before("setup", code("!pip install -q numpy matplotlib control sympy\n!ls"), number=number)
        work.after("setup", code("%pip list"), code("files = !echo some files\nprint(files)"), number=number)


@WAYS.changed()
def matplotlib_qt(work: Work) -> None:
    """Wants windows for the plots, which there are at home and not where grading runs."""
    for number in ("02", "03", "07", "08", "09"):
        work.after("setup", code("%matplotlib qt"), number=number)


@WAYS.changed()
def plot_styles(work: Work) -> None:
    """Has styles, fonts and sizes of their own, shows and closes figures, and saves them as files."""
    style = "plt.style.use('ggplot')\nplt.rcParams.update({'figure.figsize': (12, 5), 'font.family': 'Comic Sans MS'})"
    work.after("setup", code(style), number="02")
    work.write(
        "q2-9",
        _SWEEP
        + """
figure_sweep = plt.figure()
plt.plot(sweep.time, sweep.degrees("alpha"), "r-", lw=0.5, label="Auslenkung $\\\\alpha$")
plt.xlabel("Zeit $t$ [s]")
plt.ylabel("$\\\\alpha$ [deg]")
plt.title("Sweep 1–5 Hz")
plt.legend(); plt.grid(True)
plt.savefig("sweep.png", dpi=200)
plt.savefig("sweep.pdf")
plt.show()
""",
    )
    work.write("q2-10", text_of(work.cell("q2-10")) + "\nfigure_spectrum.savefig('spectrum.svg')\nplt.close('all')")


@WAYS.changed()
def star_imports(work: Work) -> None:
    """Imports everything from everywhere below the setup cell."""
    work.after("setup", code("from sympy import *"), number="01")
    work.after("setup", code("from numpy import *\nfrom math import *\nfrom matplotlib.pyplot import *"), number="02")
    work.after("setup", code("from pylab import *"), number="06")


@WAYS.changed()
def written_by_a_magic(work: Work) -> None:
    """Writes a module by %%writefile, and imports it."""
    work.before(
        "q3-2", code("%%writefile my_loop.py\nimport numpy as np\n\n\ndef loop(poles):\n    return np.poly(poles)")
    )
    work.write("q3-2", "from my_loop import loop\n\nopen_loop_polynomial = loop(open_loop).real")
