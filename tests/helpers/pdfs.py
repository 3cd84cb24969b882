"""PDFs as students make them, and as nobody should."""

import functools
import io

import pypdf
import typst

from labcourse.answers.report_files import COMPOSED

GOOD_PAGES = """
#set page(numbering: "1")
= Modelling of the flexible joint
Ada Lovelace, 20 November 2026
== Procedure
The goal was to find the stiffness of the joint, as the handbook [1] has it. For that the joint was shaken by a sine
sweep from 1 Hz to 5 Hz, and its deflection was recorded every 2 ms.
== Results
Figure 1 shows the deflection during the sweep, and Table 1 has the numbers that were read from it by hand.
#figure(rect(width: 3cm), caption: [Deflection of the joint during the sweep.])
#figure(table(columns: 2, [frequency], [3.85 Hz]), caption: [What was read from the sweep.])
#pagebreak()
== Analysis
The peak is at 3.85 Hz, and the stiffness of the joint follows from that frequency and from the inertia of the link.
== Conclusion
The model may be used for the design of a controller, as long as the voltage of the motor is not more than 1.5 V.
== References
[1] A. Author: Handbook of joints. Publisher, 2019.
"""


@functools.cache
def typeset(markup: str = GOOD_PAGES) -> bytes:
    """A document with text in it."""
    return typst.compile(markup.encode())


@functools.cache
def composed(words: str = "A report.") -> bytes:
    """A document as it is made of a notebook's texts: by typst, with the key word."""
    return typst.compile(f'#set document(keywords: ("{COMPOSED}",))\n{words}'.encode())


@functools.cache
def blank(pages: int = 1, password: str = "", owner: str = "") -> bytes:
    """A document without text, as a scanner makes it; perhaps locked, or open to all but not to be changed."""
    writer = pypdf.PdfWriter()
    for _page in range(pages):
        writer.add_blank_page(595, 842)
    if password or owner:
        writer.encrypt(password, owner or None, algorithm="RC4-128")
    made = io.BytesIO()
    writer.write(made)
    return made.getvalue()
