"""Pictures in a student's text, made safe to store and to show: decoded within limits, and written anew as PNG.

They come from untrusted files: attachments of a text cell, pictures in the text itself ("data:"), and files beside the
notebook. Pictures that cannot be read are left out, with a message.
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

from labcourse.answers import bounds

MOST = 6  #: pictures of one answer; two pages of each of three drafts
MAX_BYTES = 20_000_000  #: of a picture as it comes; a telephone's largest photograph
MAX_PIXELS = 60_000_000  #: of one; a telephone's largest photographs have 50 million
MAX_PIXELS_TOGETHER = 150_000_000  #: of all that are decoded for a notebook; three of the largest
MAX_SIDE = 20_000  #: pixels of its height and of its width as it comes; a strip of few pixels takes very long
LONGEST_SIDE = 1400  #: pixels, as it is stored; handwriting on a page can be read
MAX_STORED = 700_000  #: of a picture as it is stored; six of them are within 5 MB
_FORMATS = ("PNG", "JPEG", "GIF", "WEBP", "BMP")
_SMALLER = (LONGEST_SIDE, 1000, 700, 400)  # until it is within MAX_STORED
_TOO_MANY_PIXELS = f"it has more than {MAX_PIXELS // 1_000_000} million pixels"
_SHOWN = 60  # characters of an untrusted name in a message

#: A picture in Markdown, ``![words](target)``: its target in angle brackets or not, with or without a title.
PICTURE = re.compile(
    r"!\[(?P<alt>[^\]\n]{0,500})\]\(\s{0,9}(?:<(?P<in>[^<>\n]{1,1000})>|(?P<out>[^\s()<>]{1,1000}))"
    r"(?:[ \t][^()\n]{0,300})?\)"  # so that there is but one way to read it, and a long line takes no time
)
warnings.filterwarnings("ignore", category=Image.DecompressionBombWarning)  # sizes are looked at here, see _spend
_IN_TEXT = re.compile(r"(!\[[^\]\n]{0,500}\]\(\s{0,9}<?)data:image/[\w.+-]{1,30};base64,([A-Za-z0-9+/=]+)")


class PictureError(Exception):
    """A picture that is left out; the message says why."""


@dataclass
class Budget:
    """How many pixels may still be decoded for a notebook."""

    left: int = MAX_PIXELS_TOGETHER


@dataclass
class Pictures:
    """The pictures of an answer.

    Attributes
    ----------
    text : of the answer, with a name in place of each picture in the text itself
    saved : name, as in the text (``attachment:name`` or a file's path) → PNG
    problems : what was left out, and why
    """

    text: str
    saved: dict[str, bytes] = field(default_factory=dict)
    problems: list[str] = field(default_factory=list)


def lifted(text: str) -> tuple[str, dict[str, dict[str, str]]]:
    """Replace the pictures in the text itself by names; return the text, and the pictures as attachments."""
    pictures: dict[str, dict[str, str]] = {}

    def name(match: re.Match[str]) -> str:
        pictures[f"in-text-{len(pictures) + 1}"] = {"image/*": match[2]}
        return f"{match[1]}attachment:in-text-{len(pictures)}"

    return _IN_TEXT.sub(name, text), pictures


def pictures_of(
    text: str, attachments: Mapping[str, Mapping[str, str]], files: Mapping[str, bytes], budget: Budget
) -> Pictures:
    """Read the pictures that a text shows.

    Parameters
    ----------
    text : Markdown
    attachments : of its cell: name → media type → base64
    files : the student's own files beside the notebook: relative path → content
    budget : pixels that may still be decoded, for all answers of a notebook
    """
    text, inside = lifted(text)
    result = Pictures(text)
    targets = dict.fromkeys(match["in"] or match["out"] for match in PICTURE.finditer(text, 0, bounds.LONGEST_PROSE))
    for target in targets:
        if len(result.saved) == MOST:
            result.problems.append(f"more than {MOST} pictures: the first {MOST} are shown")
            break
        try:
            result.saved[target] = as_png(_content(target, {**attachments, **inside}, files), budget)
        except PictureError as error:
            result.problems.append(f"the picture {target[:_SHOWN]!r}: {error}")
    return result


def _content(target: str, attachments: Mapping[str, Mapping[str, str]], files: Mapping[str, bytes]) -> bytes:
    """Return the content of the picture that a text names."""
    kind, _colon, name = target.partition(":")
    if kind == "attachment":
        # Jupyter Notebook 6 stores "a (1).png" as "a%20%281%29.png".
        for media, data in (attachments.get(name) or attachments.get(unquote(name), {})).items():
            if media.startswith("image/"):
                return _decoded(data)
        raise PictureError("it is not in the cell; paste it again")
    path = target.removeprefix("./")
    try:
        return files[path if path in files else unquote(path)]
    except KeyError:
        raise PictureError("it is not in the notebook; paste it into the cell") from None


def _decoded(data: str) -> bytes:
    """Decode base64. Raises PictureError if it is too large or damaged."""
    _check_size(len(data) * 3 // 4 - 3)
    try:
        return base64.b64decode(data)
    except (binascii.Error, ValueError):
        raise PictureError("it is damaged") from None


def _check_size(size: int) -> None:
    if size > MAX_BYTES:
        raise PictureError(f"it has more than {MAX_BYTES // 1_000_000} million bytes")


def as_png(data: bytes, budget: Budget) -> bytes:
    """Write a picture as a PNG of bounded size, with nothing but its pixels.

    Raises
    ------
    PictureError
        If it is too large, is damaged, or is of a format that is not read.
    """
    _check_size(len(data))
    try:
        with Image.open(io.BytesIO(data), formats=_FORMATS) as image:
            _spend(image, budget)
            image.draft("RGB", (LONGEST_SIDE, LONGEST_SIDE))  # a JPEG can be decoded at a smaller size
            ImageOps.exif_transpose(image, in_place=True)
            return _packed(image)
    except PictureError:
        raise
    except Image.DecompressionBombError:
        raise PictureError(_TOO_MANY_PIXELS) from None
    except UnidentifiedImageError:
        raise PictureError(f"it is none of {', '.join(_FORMATS)}") from None
    except Exception:  # pillow raises all sorts of errors on what is damaged
        raise PictureError("it is damaged") from None


def _spend(image: Image.Image, budget: Budget) -> None:
    """Check the size that a picture's header states, before anything is decoded."""
    pixels = image.width * image.height
    if max(image.size) > MAX_SIDE:
        raise PictureError(f"it is more than {MAX_SIDE} pixels wide or high")
    if pixels > MAX_PIXELS:
        raise PictureError(_TOO_MANY_PIXELS)
    if pixels > budget.left:
        raise PictureError("all pictures of the notebook together have too many pixels; paste smaller ones")
    budget.left -= pixels


def _packed(image: Image.Image) -> bytes:
    """Write a PNG, on white where the picture is transparent, and reduce it until it is small enough."""
    if image.mode in ("RGB", "RGBA", "L", "LA"):  # the others have to be decoded before they can be made smaller
        image.thumbnail((LONGEST_SIDE, LONGEST_SIDE), reducing_gap=2.0)
    if image.mode != "RGB":
        transparent = image.convert("RGBA")
        image = Image.new("RGB", transparent.size, "white")
        image.paste(transparent, mask=transparent.getchannel("A"))
    for side in _SMALLER:
        image.thumbnail((side, side))
        for candidate in (image, image.quantize(128, Image.Quantize.FASTOCTREE)):
            packed = io.BytesIO()
            candidate.save(packed, format="PNG")
            if packed.tell() <= MAX_STORED:
                return packed.getvalue()
    raise PictureError("it cannot be made small enough")
