"""Attacks by words and pictures in text cells, which are not run, but read, kept, and shown to people."""

import base64
import struct
import zlib
from typing import Any

from hostile import IN_WORDS, STIFFNESS, Attack
from hostile_answers import MARKUP

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


SVG = b"<svg xmlns='http://www.w3.org/2000/svg' onload='alert(1)'><image href='https://example.com/seen'/></svg>"
PICTURES: dict[str, tuple[str, bytes]] = {
    "bomb.png": ("image/png", _png(9, 9).replace(_head(9, 9), _head(60_000, 60_000))),
    "strip.png": ("image/png", _png(1, 300_000)),
    "text.png": ("image/png", _png(9, 9, _chunk(b"zTXt", b"a\0\0" + zlib.compress(bytes(90 << 20), 9)))),
    "script.png": ("image/png", SVG),
    "\x1b[2J\u202e<script>.png": ("text/html", b"<script>alert(1)</script>"),
    "../../etc/passwd": ("image/png", b""),
}


def _attached(notebooks: Notebooks) -> None:
    """Pasted into the text cell, and shown there."""
    cell = next(cell for cell in notebooks[STIFFNESS]["cells"] if cell["id"] == IN_WORDS)
    cell["source"] += "\n\n" + " ".join(f"![{name}](<attachment:{name}>)" for name in PICTURES)
    cell["attachments"] = {name: {media: base64.b64encode(data).decode()} for name, (media, data) in PICTURES.items()}


WORDS = {
    "words-of-scripts": Attack(words=SCRIPTS),
    "pictures-of-all-sorts": Attack(words="See:", spoil=_attached),
}
