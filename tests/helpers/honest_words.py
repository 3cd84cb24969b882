"""Answers in words as people write them: in their languages, with formulas, lists, tables and pictures."""

import base64
import hashlib
import io
import uuid
from urllib.parse import quote

from honest_hand_in import Ways, Work, is_answer, text_of
from PIL import Image

WAYS = Ways()


def png(width: int, height: int) -> bytes:
    """A picture: a slope of grey."""
    packed = io.BytesIO()
    Image.linear_gradient("L").resize((width, height)).save(packed, "PNG")
    return packed.getvalue()


def texts_of(work: Work) -> list[str]:
    """The ids of all text cells that are answers."""
    cells = [cell for notebook in work.notebooks.values() for cell in notebook["cells"]]
    return [cell["id"] for cell in cells if is_answer(cell) and cell["cell_type"] == "markdown"]


def paste(work: Work, cell: str, content: bytes, key: str = "", reference: str = "") -> None:
    """Paste a picture below the words of a cell: as JupyterLab does it, which invents a name, or under a name."""
    key = key or f"{uuid.UUID(bytes=hashlib.md5(content).digest())}.png"
    held = work.cell(cell)
    held.setdefault("attachments", {})[key] = {"image/png": base64.b64encode(content).decode()}
    work.write(cell, text_of(held) + f"\n\n![image.png](attachment:{reference or key})")


@WAYS.changed()
def words_in_other_scripts(work: Work) -> None:
    """Hebrew, Arabic, Greek and Chinese, from right to left and with marks that turn the direction; emoji."""
    texts = (
        "הקפיץ חזק: $K_s=J_l\\omega_n^2$ ולכן התדר עולה.",
        "الزنبرك \u202eعكس\u202c $\\omega_n$ أقوى.",
        "Η ιδιοσυχνότητα.",
        "固有频率为 $\\omega_n$。",
    )
    for number, cell in enumerate(texts_of(work)):
        work.say(cell, f"{texts[number % 4]}\n\n👍🏽 👩‍🔬 ⚙️ \u200fé\u0301")


@WAYS.changed()
def pictures_pasted(work: Work) -> None:
    """Pasted screenshots into answers in words: two in one cell, and under names as the classic notebook gives them."""
    screenshot = "Bildschirmfoto 2026-03-01 um 12.30.05 Größe.png"
    paste(work, "q2-11-explanation", png(640, 400))
    paste(work, "q2-11-explanation", png(300, 200))
    paste(work, "q2-16-comparison", png(320, 200), "image.png")
    paste(work, "q3-12-conclusion", png(320, 201), quote(screenshot))
    paste(work, "q3-14-conclusion", png(800, 500), screenshot, quote(screenshot))


@WAYS.changed()
def picture_as_a_file(work: Work) -> None:
    """Put pictures as files beside the notebooks, and refers to them, as in any Markdown."""
    work.files["images/my spectrum.png"] = png(640, 400)
    work.write(
        "q2-11-explanation", text_of(work.cell("q2-11-explanation")) + "\n\n![spectrum](images/my%20spectrum.png)"
    )
    work.write(
        "q2-16-comparison",
        text_of(work.cell("q2-16-comparison")) + '\n\n<img src="images/my spectrum.png" width="400">',
    )


@WAYS.changed()
def words_that_look_like_code(work: Work) -> None:
    """Wrote words that look like code, formats and stubs: {t_s:.2f}, %d, \\n, $5, # Your code here., BEGIN SOLUTION."""
    work.say(
        "q3-16-conclusion",
        "{t_s:.2f} s, 5 %d, C:\\new\\table, it costs $5 and 7$.\n\n# Your code here.\n\nThat is so. "
        "### BEGIN SOLUTION is what I do not know; None, null, NaN; '''quotes''' and \"\"\"more\"\"\".",
    )
