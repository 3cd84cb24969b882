"""Attacks by words and pictures in text cells, which are not run, but read, kept, and shown to people."""

import base64
import io
import struct
import zlib
from collections.abc import Callable
from typing import Any

from hostile import IN_WORDS, STIFFNESS, Attack
from hostile_answers import MARKUP
from PIL import Image

Notebooks = dict[str, dict[str, Any]]

SCRIPTS = f"""
<script>alert(1)</script> <img src=x onerror=alert(1)> <iframe srcdoc="<script>alert(1)</script>"></iframe> {MARKUP}

[a](javascript:alert(1)) [b](data:text/html,<script>alert(1)</script>) <javascript:alert(1)> <https://example.com>
[c]: vbscript:x "onload='alert(1)'"
![d](https://example.com/seen.png "x\\" onerror=alert(1)") ![e](//example.com/f.svg) ![g](file:///etc/passwd) ![h][c]

<svg onload=alert(1)><style>*{{display:none}}</style><base href=//example.com><form action=//example.com><input></form>
<!-- --!> <![CDATA[<script>]]> <?php ?> &lt;script&gt; &#x202e; \u202e \u2066 \x1b[2J \x9b31m [red]x[/red] {{{{ 7*7 }}}}

$\\href{{javascript:alert(1)}}{{x}}$ $\\text{{<script>alert(1)</script>}}$ $$\\def\\a{{\\a\\a}}\\a$$
$\\includegraphics{{/etc/passwd}}$
"""
DEEP = "".join(f"{'  ' * depth}- {'> ' * depth}{depth}\n" for depth in range(40)) + "> " * 1000 + "* " * 500
FORMULAS = (
    "$$" + "\\frac{1}{" * 400 + "x" + "}" * 400 + "$$\n\n$" + "x^{" * 400 + "}" * 400 + "$\n\n" + "$\\sqrt" * 400 + "$"
)
BRACKETS = ("![" * 250 + "](" + "x" * 1300) * 100
LARGE = "**a *b " * 25_000


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def _head(width: int, height: int) -> bytes:
    return _chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 1, 0, 0, 0, 0))


def _png(width: int, height: int, *more: bytes) -> bytes:
    """A picture of zeros: some kilobytes that become so many pixels."""
    packer = zlib.compressobj(9)
    packed = b"".join(packer.compress(bytes(width // 8 + 1)) for _ in range(height)) + packer.flush()
    chunks = [_head(width, height), *more, _chunk(b"IDAT", packed), _chunk(b"IEND", b"")]
    return b"\x89PNG\r\n\x1a\n" + b"".join(chunks)


def _animated() -> bytes:
    packed = io.BytesIO()
    frames = [Image.new("P", (600, 600), number) for number in range(60)]
    frames[0].save(packed, "GIF", save_all=True, append_images=frames[1:])
    return packed.getvalue()


SVG = b"<svg xmlns='http://www.w3.org/2000/svg' onload='alert(1)'><image href='https://example.com/seen'/></svg>"
PICTURES: dict[str, tuple[str, bytes]] = {
    "bomb.png": ("image/png", _png(9, 9).replace(_head(9, 9), _head(60_000, 60_000))),
    "large.png": ("image/png", _png(7_700, 7_700)),
    "strip.png": ("image/png", _png(1, 300_000)),
    "text.png": ("image/png", _png(9, 9, _chunk(b"zTXt", b"a\0\0" + zlib.compress(bytes(90 << 20), 9)))),
    "animated.gif": ("image/gif", _animated()),
    "script.svg": ("image/svg+xml", SVG),
    "script.png": ("image/png", SVG),
    "page.png": ("image/png", b"<script>alert(1)</script>"),
    "cut.png": ("image/png", _png(90, 90)[:50]),
    "\x1b[2J\u202e<script>.png": ("text/html", b"<script>alert(1)</script>"),
    "../../etc/passwd": ("image/png", b""),
}


def attached(pictures: dict[str, tuple[str, bytes]], times: int = 1) -> Callable[[Notebooks], None]:
    """Pasted into the text cell, and shown there."""

    def spoil(notebooks: Notebooks) -> None:
        cell = next(cell for cell in notebooks[STIFFNESS]["cells"] if cell["id"] == IN_WORDS)
        cell["source"] += "\n\n" + " ".join(f"![{name}](<attachment:{name}>)" for name in pictures)
        cell["attachments"] = {
            f"{name}{number if number else ''}": {media: base64.b64encode(data).decode()}
            for number in range(times)
            for name, (media, data) in pictures.items()
        }

    return spoil


def _attachments_of_other_forms(notebooks: Notebooks) -> None:
    cell = next(cell for cell in notebooks[STIFFNESS]["cells"] if cell["id"] == IN_WORDS)
    cell["source"] += "![a](attachment:a) ![b](attachment:b) ![c](attachment:c)"
    cell["attachments"] = {
        "a": {"image/png": ["x"]},
        "b": {"image/png": "\u202e=="},
        "c": 7,
        "d": {"image/png": "A" * 10**6},
    }


def _in_every_cell(notebooks: Notebooks) -> None:
    """Text cells that all say that they are the one, by every sign that there is."""
    cells = notebooks[STIFFNESS]["cells"]
    one = next(cell for cell in cells if cell["id"] == IN_WORDS)
    cells += [
        {**one, "id": name, "source": f"{one['source']}\n{number} " * 50}
        for name in (IN_WORDS, "x")
        for number in range(200)
    ]
    about = {"question": "2.12", "part": "K_s"}
    cells.append(
        {**one, "id": "y", "metadata": {"labcourse": about, "nbgrader": {"grade_id": "q2-12"}}, "source": "1.3"}
    )


WORDS = {
    "words-of-scripts": Attack(words=SCRIPTS),
    "words-in-depth": Attack(words=DEEP),
    "words-of-formulas": Attack(words=FORMULAS),
    "words-of-brackets": Attack(words=BRACKETS, trouble=("of which the first 5000 are read",)),
    "words-by-the-megabyte": Attack(words=LARGE, trouble=("of which the first 5000 are read",)),
    "pictures-of-all-sorts": Attack(words="See:", spoil=attached(PICTURES)),
    "pictures-by-the-hundred": Attack(words="See:", spoil=attached({"large.png": PICTURES["large.png"]}, 300)),
    "pictures-of-no-form": Attack(words="See:", spoil=_attachments_of_other_forms),
    "words-everywhere": Attack(words="Friction.", spoil=_in_every_cell),
}
