"""Functions: their outputs on the inputs of a probe."""

from __future__ import annotations

import copy
from typing import Any

import numpy as np
from numpy.typing import NDArray

from labcourse.answers.json_values import FormError, NotAnswered, read_dict, read_list
from labcourse.answers.parts import Part
from labcourse.answers.probes import Probe
from labcourse.messages import plural

_LONGEST_MESSAGE = 200  # characters: two lines


def encode_function(part: Part, value: Any, probe_seed: int) -> tuple[dict[str, Any], list[str]]:
    """Call a function on its probe's inputs and keep the outputs, as the probe says."""
    if value is None or value is Ellipsis:
        raise NotAnswered("nothing yet")
    probe = _probe(part)
    if not callable(value):
        raise FormError(
            f"it is a {type(value).__name__}: give the function {probe.signature} itself, not what it returns"
        )
    outputs = []
    for arguments in probe.inputs(probe_seed):
        try:
            output = value(*copy.deepcopy(arguments))
        except Exception as error:  # whatever a student's function may raise is theirs to read
            message = str(error)[:_LONGEST_MESSAGE]
            raise FormError(f"calling {probe.signature} raised {type(error).__name__}: {message}") from None
        outputs.append(probe.keep(output))
    return {"outputs": outputs}, []


def decode_function(part: Part, content: Any) -> list[tuple[NDArray[np.float64], ...]]:
    """The outputs, one tuple of arrays for each of the probe's inputs."""
    outputs = read_dict(part.name, content, {"kind", "outputs"})["outputs"]
    probe = _probe(part)
    return [probe.read(output) for output in read_list(part.name, outputs, probe.count, probe.count)]


def _probe(part: Part) -> Probe:
    if part.probe is None:
        raise TypeError(f"{part.name}: a part of kind function needs a probe.")
    return part.probe


def show_function(part: Part, content: dict[str, Any]) -> str:
    return ": a function, tried on {inputs}".format(
        inputs=plural(len(content["outputs"]), "{count} input", "{count} inputs")
    )
