"""PDFs as students make them, and as nobody should."""

import functools
import io

import pypdf
import typst

from labcourse.answers.report_files import COMPOSED

PAGES = "= Modelling of the flexible joint\nThe goal was to find its stiffness.\n#pagebreak()\nThe peak is at 3.85 Hz."


@functools.cache
def typeset() -> bytes:
    """A document with text in it."""
    return typst.compile(PAGES.encode())


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
