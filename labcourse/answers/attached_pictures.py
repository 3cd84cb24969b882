"""Pictures in a student's text, made safe to keep and to show: decoded within bounds, and written anew as PNG.

They come from untrusted files: attachments of a text cell, pictures that stand in the text itself ("data:"), and
files beside the notebook. What cannot be read is left out, and told.
"""

from __future__ import annotations

import base64
import binascii
import io
import re
import warnings
from collections.abc import Mapping
from dataclasses import dataclass, field
from urllib.parse import unquote

from PIL import Image, ImageOps, UnidentifiedImageError

from labcourse.answers.kinds.values import LONGEST_PROSE

MOST = 6  #: pictures of one answer; two pages of each of three drafts
MAX_BYTES = 20_000_000  #: of a picture as it comes; a telephone's largest photograph
MAX_PIXELS = 60_000_000  #: of one; a telephone's largest photographs have 50 million
MAX_PIXELS_TOGETHER = 150_000_000  #: of all that are decoded for a notebook; three of the largest
MAX_SIDE = 20_000  #: pixels of its height and of its width as it comes; a strip of few pixels takes very long
LONGEST_SIDE = 1400  #: pixels, as it is kept; handwriting on a page can be read
KEPT_BYTES = 700_000  #: of a picture as it is kept; six of them are within 5 MB
_FORMATS = ("PNG", "JPEG", "GIF", "WEBP", "BMP")
_SMALLER = (LONGEST_SIDE, 1000, 700, 400)  # until it is within KEPT_BYTES
_SHOWN = 60  # characters of an untrusted name in a message

#: A picture in Markdown, ``![words](target)``: its target in angle brackets or not, with or without a title.
PICTURE = re.compile(
    r"!\[(?P<alt>[^\]\n]{0,500})\]\(\s{0,9}(?:<(?P<in>[^<>\n]{1,1000})>|(?P<out>[^\s()<>]{1,1000}))"
    r"(?:[ \t][^()\n]{0,300})?\)"  # so that there is but one way to read it, and a long line takes no time
)
warnings.filterwarnings("ignore", category=Image.DecompressionBombWarning)  # sizes are looked at here, see _spend
_IN_TEXT = re.compile(r"(!\[[^\]\n]{0,500}\]\(\s{0,9}<?)data:image/[\w.+-]{1,30};base64,([A-Za-z0-9+/=]+)")


class PictureError(Exception):
    """A picture that is not kept; the message says why."""


@dataclass
class Budget:
    """How many pixels may still be decoded for a notebook."""

    left: int = MAX_PIXELS_TOGETHER


@dataclass
class Pictures:
    """The pictures of an answer.

    Attributes
    ----------
    text : the answer's, in which pictures are now named
    kept : name, as in the text (``attachment:name`` or a file's path) → PNG
    told : what was left out, and why
    """

    text: str
    kept: dict[str, bytes] = field(default_factory=dict)
    told: list[str] = field(default_factory=list)


def lifted(text: str) -> tuple[str, dict[str, str]]:
    """A text without the pictures that stand in it letter by letter: they are named, and returned as base64."""
    found: dict[str, str] = {}

    def name(match: re.Match[str]) -> str:
        found[f"in-text-{len(found) + 1}"] = match[2]
        return f"{match[1]}attachment:in-text-{len(found)}"

    return _IN_TEXT.sub(name, text), found


def pictures_of(
    text: str,
    attachments: Mapping[str, Mapping[str, str]],
    files: Mapping[str, bytes] | None = None,
    budget: Budget | None = None,
) -> Pictures:
    """The pictures that a text shows.

    Parameters
    ----------
    text : Markdown
    attachments : of its cell: name → media type → base64
    files : the student's own beside the notebook: relative path → content
    budget : what may still be decoded, for all answers of a notebook
    """
    budget = budget or Budget()
    text, inside = lifted(text)
    found = Pictures(text)
    targets = dict.fromkeys(match["in"] or match["out"] for match in PICTURE.finditer(text, 0, LONGEST_PROSE))
    for target in targets:
        if len(found.kept) == MOST:
            found.told.append(f"more than {MOST} pictures: the first {MOST} are shown")
            break
        try:
            found.kept[target] = as_png(_content(target, attachments, inside, files or {}), budget)
        except PictureError as error:
            found.told.append(f"the picture {target[:_SHOWN]!r}: {error}")
    return found


def _content(
    target: str, attachments: Mapping[str, Mapping[str, str]], inside: Mapping[str, str], files: Mapping[str, bytes]
) -> bytes:
    """The bytes of what a text names."""
    kind, _colon, name = target.partition(":")
    if kind == "attachment" and name in inside:
        return _decoded(inside[name])
    if kind == "attachment":
        for spelt in (name, unquote(name)):
            for media, data in attachments.get(spelt, {}).items():
                if media.startswith("image/"):
                    return _decoded(data)
        raise PictureError("it is not in the cell; paste it again")
    for spelt in (target, unquote(target)):
        if spelt.removeprefix("./") in files:
            return files[spelt.removeprefix("./")]
    raise PictureError("it is not in the notebook; paste it into the cell")


def _decoded(data: str) -> bytes:
    if len(data) > MAX_BYTES * 4 // 3 + 4:
        raise PictureError(_too_large())
    try:
        return base64.b64decode(data)
    except (binascii.Error, ValueError):
        raise PictureError("it is damaged") from None


def _too_large() -> str:
    return f"it has more than {MAX_BYTES // 1_000_000} million bytes"


def _too_many_pixels() -> str:
    return f"it has more than {MAX_PIXELS // 1_000_000} million pixels"


def as_png(data: bytes, budget: Budget | None = None) -> bytes:
    """A picture as a PNG of bounded size, of the pixels alone.

    Raises
    ------
    PictureError
        If it is too large, is damaged, or is of a format that is not read.
    """
    budget = budget or Budget()
    if len(data) > MAX_BYTES:
        raise PictureError(_too_large())
    try:
        with Image.open(io.BytesIO(data), formats=_FORMATS) as image:
            _spend(image, budget)
            image.draft("RGB", (LONGEST_SIDE, LONGEST_SIDE))  # a JPEG can be decoded at a smaller size
            ImageOps.exif_transpose(image, in_place=True)
            return _packed(image)
    except PictureError:
        raise
    except Image.DecompressionBombError:
        raise PictureError(_too_many_pixels()) from None
    except UnidentifiedImageError:
        raise PictureError(f"it is none of {', '.join(_FORMATS)}") from None
    except Exception:  # pillow raises all sorts of errors on what is damaged
        raise PictureError("it is damaged") from None


def _spend(image: Image.Image, budget: Budget) -> None:
    """Look at the size that a picture's head states, before anything is decoded."""
    pixels = image.width * image.height
    if max(image.size) > MAX_SIDE:
        raise PictureError(f"it is more than {MAX_SIDE} pixels wide or high")
    if pixels > MAX_PIXELS:
        raise PictureError(_too_many_pixels())
    if pixels > budget.left:
        raise PictureError("all pictures of the notebook together have too many pixels; paste smaller ones")
    budget.left -= pixels


def _packed(image: Image.Image) -> bytes:
    """As PNG, on white where it was transparent, and made smaller until it is small enough."""
    if image.mode in ("RGB", "RGBA", "L", "LA"):  # the others have to be decoded before they can be made smaller
        image.thumbnail((LONGEST_SIDE, LONGEST_SIDE), reducing_gap=2.0)
    if image.mode != "RGB":
        seen = image.convert("RGBA")
        image = Image.new("RGB", seen.size, "white")
        image.paste(seen, mask=seen.getchannel("A"))
    for side in _SMALLER:
        image.thumbnail((side, side))
        for kept in (image, image.quantize(128, Image.Quantize.FASTOCTREE)):
            packed = io.BytesIO()
            kept.save(packed, format="PNG")
            if packed.tell() <= KEPT_BYTES:
                return packed.getvalue()
    raise PictureError("it cannot be made small enough")
