"""Other ways of writing the two functions (2.10, 2.13) rightly, and of running the experiments."""

from typing import Any

import numpy as np
import scipy.fft
import scipy.signal
import sympy
from right_ways_types import Frame, Ways
from working_through import state_space

WAYS = Ways("functions")
SPECTRUM, MODEL = ("2.10", "spectrum"), ("2.13", "state_space")


def spectrum(what: str) -> Any:
    return lambda function: (WAYS.add(f"spectrum {what}", {SPECTRUM: lambda _, own: function}), function)[1]


def model(what: str) -> Any:
    return lambda function: (WAYS.add(f"model {what}", {MODEL: lambda _, own: function}), function)[1]


@spectrum("by rfft, no zeros appended")
def _(x, dt):
    return np.fft.rfftfreq(len(x), dt), 2 * np.abs(np.fft.rfft(x)) / len(x)


@spectrum("with a Hann window, its height made up for")
def _(x, dt):
    w = np.hanning(len(x))
    return np.fft.rfftfreq(len(x), dt), 2 * np.abs(np.fft.rfft(w * x)) / w.sum()


@spectrum("as the root of a periodogram")
def _(x, dt):
    f, power = scipy.signal.periodogram(x, 1 / dt, scaling="spectrum", detrend=False)
    return f, np.sqrt(2 * power)


@spectrum("as columns of tables")
def _(x, dt):
    f, a = np.fft.rfftfreq(len(x), dt), 2 * np.abs(np.fft.rfft(x)) / len(x)
    return Frame(f[:, None]), Frame(a[:, None])


@spectrum("with a default sample time, the mean not doubled")
def _(x, dt=0.002):
    a = np.abs(np.fft.rfft(x)) / len(x)
    a[1:-1] *= 2
    return np.fft.rfftfreq(len(x), dt), a


@spectrum("by the sums themselves, up to 10 Hz")
def _(x, dt):
    n = np.arange(len(x))
    f = np.arange(0, 10, 1 / (len(x) * dt))
    return f, [2 / len(x) * abs(np.sum(x * np.exp(-2j * np.pi * one * n * dt))) for one in f]


@model("as sympy's matrices")
def _(K_s, J_l, J_eq, B_eq):
    return tuple(sympy.Matrix(np.asarray(m).tolist()) for m in state_space(K_s, J_l, J_eq, B_eq))


@model("with B and D as rows, and other names of arguments")
def _(stiffness, inertia, servo_inertia, friction):
    A, B, C, D = state_space(stiffness, inertia, servo_inertia, friction)
    return A, B.reshape(1, 4), C, D.reshape(1, 2)
