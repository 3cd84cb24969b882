"""Recordings: a summary of their channels."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from labcourse.answers.json_values import (
    FormError,
    NotAnswered,
    read_dict,
    read_number,
    read_text,
    read_vector,
    rounded,
    thin,
)
from labcourse.answers.parts import Part
from labcourse.errors import AnswerError
from labcourse.messages import plural

MOST_POINTS = 400  #: as many as a plot is wide, halved
MOST_SAMPLES = 10**7  #: more than an hour at 2 kHz
_LONGEST_METADATA = 4000  # characters of JSON; what a bench says of itself, ten times


class Signal(Protocol):
    """One channel: ``values`` (n,) in ``unit``."""

    @property
    def values(self) -> NDArray[np.float64]: ...
    @property
    def unit(self) -> str: ...


@runtime_checkable
class Sampled(Protocol):
    """What counts as a recording: signals sampled together at a fixed rate, and where they come from."""

    @property
    def channels(self) -> Mapping[str, Signal]: ...
    @property
    def metadata(self) -> Mapping[str, Any]: ...
    @property
    def sample_time(self) -> float: ...  # s
    def __len__(self) -> int: ...


def encode_recording(part: Part, value: Any) -> tuple[dict[str, Any], list[str]]:
    """A recording's metadata and its channels, thinned to 400 points (``json_values.thin``) of 6 significant digits."""
    if value is None or value is Ellipsis:
        raise NotAnswered("nothing yet")
    if not isinstance(value, Sampled):
        raise FormError(f"it is a {type(value).__name__}, not a recording: give what the experiment returned")
    missing = [name for name in part.channels if name not in value.channels]
    if missing:
        raise FormError(f"the recording lacks {' and '.join(missing)}; it has {', '.join(value.channels)}")
    if len(value) > MOST_SAMPLES:
        raise FormError("the recording is too long: cut out the part that matters with recording.between(start, stop)")
    kept = thin(len(value), MOST_POINTS)
    channels = {
        name: {"unit": channel.unit, "values": rounded(channel.values[kept])}
        for name, channel in value.channels.items()
        if name in part.units
    }
    content = {
        "metadata": _metadata(value),
        "n": len(value),
        "sample_time": value.sample_time,
        "channels": channels,
    }
    hints = [
        f"is it the right one? Its {name} is {str(value.metadata[name])[:40]!r}, where {wanted!r} is asked for"
        for name, wanted in (*part.settings, *part.usual.settings)
        if value.metadata.get(name, wanted) != wanted
    ]
    return content, hints


def _metadata(value: Sampled) -> dict[str, Any]:
    try:
        text = json.dumps(dict(value.metadata), allow_nan=False, ensure_ascii=False)
    except (TypeError, ValueError):
        raise FormError("the recording's metadata is not plain data (text, numbers, lists)") from None
    if len(text) > _LONGEST_METADATA:
        raise FormError("the recording's metadata is too long to be kept")
    metadata: dict[str, Any] = json.loads(text)
    return metadata


def decode_recording(part: Part, content: Any) -> dict[str, Any]:
    read_dict(part.name, content, {"kind", "metadata", "n", "sample_time", "channels"})
    n, metadata, channels = content["n"], content["metadata"], content["channels"]
    if isinstance(n, bool) or not isinstance(n, int) or not 2 <= n <= MOST_SAMPLES:
        raise AnswerError("The number of samples should be a whole number.")
    if not isinstance(metadata, dict):
        raise AnswerError("The metadata should be an object.")
    try:
        read_text("The metadata", json.dumps(metadata, ensure_ascii=False), _LONGEST_METADATA)
    except RecursionError:
        raise AnswerError("The metadata should be a small object.") from None
    if not isinstance(channels, dict) or not set(part.channels) <= channels.keys() <= part.units.keys():
        raise AnswerError(
            f"The channels should be some of {', '.join(part.units)}, {', '.join(part.channels)} among them."
        )
    size = min(n, MOST_POINTS)
    read = {}
    for name, item in channels.items():
        channel = read_dict(name, item, {"unit", "values"})
        if read_text("unit", channel["unit"], 10) != part.units[name]:
            raise AnswerError(f"The unit of {name} should be {part.units[name]}.")
        read[name] = {"unit": part.units[name], "values": read_vector(name, channel["values"], size, size)}
    sample_time = read_number("sample_time", content["sample_time"])
    if sample_time <= 0:
        raise AnswerError("The sample time should be positive.")
    return {"metadata": metadata, "n": n, "sample_time": sample_time, "channels": read}


def show_recording(part: Part, content: dict[str, Any]) -> str:
    duration = (content["n"] - 1) * content["sample_time"]
    return f": {duration:.3g} s, {plural(len(content['channels']), '{count} channel', '{count} channels')}"
