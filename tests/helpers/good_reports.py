"""Reports with nothing wrong in their format, in several styles: what a checklist says of them is a false alarm."""

from __future__ import annotations

from collections.abc import Sequence

from rotflex.courseware.report.document import (
    Axes,
    Document,
    Equation,
    Figure,
    Place,
    Prose,
    Reference,
    Section,
    Table,
)

Block = Prose | Figure | Table | Equation


def report(
    language: str, sections: Sequence[tuple[str, str, Sequence[Block]]], references: Sequence[tuple[str, str]]
) -> Document:
    """A document with a cover."""
    return Document(
        report="First report",
        title="A report",
        course="A course",
        term="",
        student="ada",
        authors=("Ada Lovelace",),
        date="2026-11-23",
        page_limit=10,
        sections=tuple(
            Section(number, heading, tuple(blocks), Place("04_results.ipynb", number))
            for number, heading, blocks in sections
        ),
        references=tuple(Reference(key, text, Place("04_results.ipynb", "front")) for key, text in references),
        language=language,
        front=Place("04_results.ipynb", "front"),
    )


def text(name: str, *paragraphs: str) -> Prose:
    """A text of these paragraphs."""
    return Prose(name, "\n\n".join(paragraphs), Place("04_results.ipynb", name))


def figure(label: str, number: int, caption: str, *axes: tuple[str, str, tuple[str, ...]]) -> Figure:
    """A figure with diagrams: labels of the two axes, and of the curves."""
    place = Place("02_measuring.ipynb", f"figure-{number}")
    drawn = tuple(Axes("", x, y, curves) for x, y, curves in axes)
    return Figure(label, number, caption, True, "<svg/>", "", drawn, place, place)


def table(label: str, number: int, caption: str, head: Sequence[str], *rows: Sequence[str]) -> Table:
    """A table with its rows."""
    place = Place("04_results.ipynb", f"table-{number}")
    return Table(label, number, caption, True, tuple(head), tuple(map(tuple, rows)), place, place)


def equation(number: int, latex: str, tag: str = "") -> Equation:
    """A displayed equation."""
    return Equation(number, latex, tag, Place("04_results.ipynb", "analysis"))


#: Passive and terse; equations with tags, an interval, a range, a list, hedged numbers, code, another's figure.
TERSE = report(
    "en",
    [
        (
            "I.1",
            "Procedure: finding the stiffness",
            [
                text(
                    "a",
                    "The joint was shaken by a sine sweep from 1 Hz to 5 Hz within 15 s, and frequencies in [1, 5] "
                    "Hz were "
                    "looked at only. The bench and its motor are those of [1, 2]. The amplitude was 4 deg, the "
                    "sample time "
                    "2 ms. Angles were read by `encoder.read(0)` every 2 ms; one count is 0.088 deg. (The sweep "
                    "began at "
                    "rest.)",
                )
            ],
        ),
        (
            "II.1",
            "Results: sweep",
            [
                text("b", "Figures 1 and 2 show the sweep and its spectrum; Table 2 has the numbers."),
                figure(
                    "Figure 2.9", 1, "Deflection of the joint during the sweep.", ("time (s)", r"$\alpha$ / deg", ("",))
                ),
                figure(
                    "Figure 2.10",
                    2,
                    r"Amplitude spectrum of $\alpha$ during the sweep of Figure 1. The peak at 3.85 Hz is marked.",
                    ("", "amplitude (deg)", ("measured", "")),
                    ("frequency in Hz", "coherence (–)", ("measured", "limit")),
                ),
                table(
                    "Table 2",
                    1,
                    "Results for the joint, with standard uncertainties.",
                    ("Quantity", "Symbol", "Value", "Unit"),
                    ("natural frequency", r"$\omega_n$", "24.2", "rad/s"),
                    ("stiffness", "$K_s$", "2.02", "N·m/rad"),
                    ("damping ratio", r"$\zeta$", "0.02", ""),
                    ("inertia", "$J_l$", r"$3.45 \cdot 10^{-3}$", "kg·m²"),
                    ("rank", "$r$", "4", ""),
                ),
            ],
        ),
        (
            "III.1",
            "Analysis: stiffness",
            [
                text(
                    "c",
                    "With the servo's motion given, the link obeys",
                    r"$$ J_l(\ddot\theta + \ddot\alpha) = -K_s\,\alpha - B_l\,\dot\alpha, \tag{1} $$",
                    r"so its natural frequency is $\omega_n = \sqrt{K_s/J_l}$ = 24.2 rad/s, and by (1)",
                    r"$$ K_s = J_l\,\omega_n^2 = 2.02~\mathrm{N\,m/rad}. \tag{2} $$",
                    "Equations (1) and (2) hold for small damping. The handbook prints $K_s$ = 1.30 N·m/rad for "
                    "another "
                    "bench; with $K_s$ = 1.60 N·m/rad the peak would lie at 3.4 Hz. See Figure 3.2 of the handbook "
                    "[2]. "
                    r"With $J_l$ = 3.45·10⁻³ kg·m² this gives $K_s = (2.02 \pm 0.07)$ N·m/rad, that is 3.6 %.",
                    "* The peak is read to half a bin.\n* The loop gives way by 3 %.\n* At frequency 0, nothing moves.",
                ),
                equation(1, r"J_l(\ddot\theta + \ddot\alpha) = -K_s\,\alpha - B_l\,\dot\alpha,", "1"),
                equation(2, r"K_s = J_l\,\omega_n^2 = 2.02~\mathrm{N\,m/rad}.", "2"),
            ],
        ),
        (
            "IV.1",
            "Conclusion: the joint",
            [
                text(
                    "d",
                    "Because the swings agree in time, a wrong stiffness is ruled out. What had had to be assumed, a "
                    "small "
                    "damping, is confirmed by the damping ratio of 0.02. The result may be used for voltages of 1.5 "
                    "V and "
                    "less, and up to frequencies of 2, 3 or 5 Hz.",
                )
            ],
        ),
    ],
    [
        ("1", "Quanser, *SRV02 user manual*, 2011."),
        ("2", "A. Author: Handbook of joints. Publisher, 2nd edition 2019."),
    ],
)

#: First person, another laboratory (a pendulum), no tags, a table in a text, code, prices, names of files.
NARRATIVE = report(
    "en",
    [
        (
            "1",
            "Procedure",
            [
                text(
                    "a",
                    "We wanted to know how long a pendulum is, without touching it. We let it swing from about 5 "
                    "degrees, "
                    "and counted 20 swings with a stop watch, ten times. My partner said that that was enough. The "
                    "file "
                    "`swings_2026.csv` holds all times; `numpy.mean(times[0:10])` gave the mean. The watch cost "
                    "\\$12, and "
                    "the string comes from a shop at the corner (it is not elastic).",
                    "We write *T* for the time of one swing, and *l* for the length. We looked at damping ratios in "
                    "[0, 1].",
                )
            ],
        ),
        (
            "2",
            "Results",
            [
                text(
                    "b",
                    "The times are in the table, and Figure 1 shows how they scatter:",
                    "Table: Time of twenty swings, by a stop watch.",
                    "| swing | time (s) |\n|---|---|\n| 1 | 40.12 |\n| 2 | 40.31 |",
                    "Their mean is 40.2 s, with a standard deviation of 0.1 s. One swing takes T = 2.01 s.",
                ),
                Table(
                    "",
                    1,
                    "Time of twenty swings, by a stop watch.",
                    True,
                    (),
                    (),
                    Place("04_results.ipynb", "b"),
                    Place("04_results.ipynb", "b"),
                ),
                figure("Figure 1", 1, "Time of twenty swings in each of ten runs.", ("run number", "time, s", ("",))),
            ],
        ),
        (
            "3",
            "Analysis",
            [
                text(
                    "c",
                    "From",
                    r"$$ T = 2\pi\sqrt{\frac{l}{g}} $$",
                    r"follows $l = g\,(T/2\pi)^2$, which with $g = 9.81\,\mathrm{m/s^2}$ gives a length of 1.00 m. The "
                    r"uncertainty of $T$ is $\pm 5\cdot 10^{-3}$ s, and twice that, relatively, is the one of the "
                    r"length: "
                    "half a centimetre. A swing of 5 degrees makes it 0.05 % longer [Feynman, 1963]. As Galilei "
                    "wrote in "
                    "1638, the mass does not matter.",
                    "Why did we not swing it further? Then the formula would no longer hold…",
                ),
                equation(1, r"T = 2\pi\sqrt{\frac{l}{g}}"),
            ],
        ),
        (
            "4",
            "Conclusions",
            [
                text(
                    "d",
                    "The pendulum is 1.00 m long, to half a centimetre. We could not have told it more exactly by a "
                    "ruler, "
                    "because nobody knows where the middle of the bob is. What we would do otherwise: count 100 swings "
                    "rather than 20. Dr. Smith's method [Feynman] is the same, i.e. counting.",
                )
            ],
        ),
    ],
    [("Feynman", "R. Feynman, R. Leighton, M. Sands: *The Feynman Lectures on Physics*, vol. 1. Addison-Wesley 1963.")],
)

#: German, with decimal commas, and captions that cite.
GERMAN = report(
    "de",
    [
        (
            "I.1",
            "Durchführung: Steifigkeit",
            [
                text(
                    "a",
                    "Ziel des Versuchs war es, die Steifigkeit des Gelenks aus der Eigenfrequenz zu bestimmen. Der "
                    "Servo "
                    "wurde mit einem Sinus von 1 Hz bis 5 Hz angeregt, die Dauer betrug 15 s und die Amplitude 4°. Die "
                    "Winkel, die die Geber liefern, wurden alle 2 ms aufgezeichnet; ein Schritt ist 0,088°. Der "
                    "Aufbau ist "
                    "der von [1]. (Zu Beginn war alles in Ruhe.)",
                )
            ],
        ),
        (
            "II.1",
            "Ergebnisse: Spektrum",
            [
                text("b", "Abbildung 1 zeigt das Spektrum, und in Tabelle 1 stehen die Werte mit ihren Einheiten."),
                figure(
                    "",
                    1,
                    "Spektrum der Auslenkung während der Anregung [1].",
                    ("Frequenz in Hz", "Amplitude / °", ("",)),
                ),
                table(
                    "Tabelle 1",
                    1,
                    "Ergebnisse der Messung am Gelenk mit ihren Einheiten.",
                    ("Größe", "Symbol", "Wert", "Einheit"),
                    ("Kreisfrequenz", "$ω_n$", "24,2", "rad/s"),
                    ("Steifigkeit", "$K_s$", "2,02", "N·m/rad"),
                ),
            ],
        ),
        (
            "III.1",
            "Analyse: Steifigkeit",
            [
                text(
                    "c",
                    r"Das Spektrum (Abb. 1) hat sein Maximum bei 3,85 Hz, also ist $\omega_n$ = 24,2 rad/s. Aus",
                    r"$$ K_s = J_l\,\omega_n^2 \tag{1} $$",
                    "folgt mit Gl. (1) die Steifigkeit $K_s = 2{,}02$ N·m/rad. Die Unsicherheit beträgt 3,6 %, weil "
                    "die "
                    "Frequenz auf eine halbe Linie genau abgelesen wurde. Ein Wert von 1,3 N·m/rad, wie er gedruckt "
                    "steht, "
                    "gehört zu einem anderen Gelenk, bei dem die Eigenfrequenz 3,1 Hz ist.",
                ),
                equation(1, r"K_s = J_l\,\omega_n^2", "1"),
            ],
        ),
        (
            "IV.1",
            "Schluss",
            [
                text(
                    "d",
                    "Das Modell beschreibt den Versuchsstand bis 1,5 V auf etwa zehn Prozent genau. Es taugt daher "
                    "für den "
                    "Entwurf eines Reglers, der beide Winkel misst. Die Reibung des Servos, die das Modell nicht "
                    "kennt, "
                    "wäre als Nächstes zu messen.",
                )
            ],
        ),
    ],
    [("1", "Hersteller GmbH: Handbuch des Versuchsstands. 3. Auflage, 2018.")],
)

#: In a language that no list of words is kept for.
FRENCH = report(
    "en",
    [
        (
            "I.1",
            "Procedure: sweep",
            [
                text(
                    "a",
                    "Le but de l'essai était de trouver la raideur de l'articulation à partir de sa fréquence "
                    "propre. La "
                    "base a été secouée par un sinus de 1 Hz à 5 Hz pendant 15 s, comme dans [1]. Nous nous sommes "
                    "assurés "
                    "que tout était au repos au début ; les angles ont été notés toutes les 2 ms",
                ),
                figure("Figure 1", 1, "La réponse de l'articulation au balayage.", ("temps (s)", "angle (deg)", ("",))),
            ],
        )
    ],
    [("1", "Fabricant, *Manuel du banc d'essai*, 2018.")],
)

GOOD = {"terse": TERSE, "narrative": NARRATIVE, "german": GERMAN, "french": FRENCH}
