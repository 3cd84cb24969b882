"""This bench from above: the servo's body, the arm on it, and the two springs between them."""

from __future__ import annotations

import numpy as np

from labcourse.scene.scene import GROUND, Moving, Play
from rotflex.recording import Recording
from rotflex.units import DEG

# Lengths are shares of the radius of the circle that is drawn around it.
_REACH = 1 / 0.84  # of what is to be seen
_ARM = 0.94
_BODY = 0.24, 0.3  # half of its width, of its length
_SPRINGS_ON_BODY = 0.208, 0.24  # to either side; ahead
_SPRINGS_ON_ARM = 0.62
_HELD_AT, _PULLED = 0.78, 0.12  # where the arm can be held; by how much a key pulls
_PLAYED = 60  # 1/s, samples of a recording that the mechanism goes through


def mechanism(theta: float, alpha: float, grab: bool = False) -> Moving:
    """Servo and arm as they stand; a player puts recorded ``theta`` and ``alpha`` in the place of these.

    Parameters
    ----------
    theta : servo angle (rad), anticlockwise from straight up
    alpha : deflection of the arm (rad), from there on
    grab : whether the arm can be grabbed
    """
    body = GROUND.turned(by="theta")
    arm = body.turned(by="alpha")
    axle = GROUND.at(0, 0)
    drawing = Moving({"theta": theta, "alpha": alpha}, x=(-_REACH, _REACH), y=(-_REACH, _REACH))
    drawing.reading("θ", "theta", "°", 1 / DEG)
    drawing.reading("α", "alpha", "°", 1 / DEG)
    drawing.circle(axle, 1, "grid")
    drawing.line(axle, body.at(0, 1), "reference")
    drawing.rectangle(body, (-_BODY[0], -_BODY[1]), _BODY)
    drawing.line(axle, arm.at(0, _ARM), "measured", width=7)
    for side in (-1, 1):
        drawing.spring(body.at(side * _SPRINGS_ON_BODY[0], _SPRINGS_ON_BODY[1]), arm.at(0, _SPRINGS_ON_ARM), "voltage")
    drawing.dot(axle)
    if grab:
        text = f"{alpha / DEG:.1f} degrees aside"
        drawing.grab("arm", arm.at(0, _HELD_AT), "Arm: pull it aside and let go", text, _PULLED)
    return drawing


def played(recording: Recording, begin: float, end: float, auto: bool = False, at_once: bool = False) -> Play:
    """A recording as the mechanism goes through it.

    Parameters
    ----------
    recording : with theta and alpha
    begin, end : s, the part that is played
    auto, at_once : whether it begins by itself, and even before anything has changed
    """
    instants = np.linspace(begin, end, max(2, round((end - begin) * _PLAYED)))
    signals = {name: np.interp(instants, recording.time, recording[name]) for name in ("theta", "alpha")}
    return Play(signals, end - begin, auto, at_once)
