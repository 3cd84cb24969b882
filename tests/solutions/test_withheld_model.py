"""Nothing that a release holds returns the numbers of a bench's model, which question 2.14 asks for."""

import contextlib
import dataclasses
import importlib
import inspect
import pkgutil
from collections.abc import Mapping

import numpy as np

import rotflex
from rotflex import hil
from rotflex.config import srv02
from rotflex.greybox.result import FitResult, Prediction
from rotflex.hil.student_benches import student_bench
from rotflex.plant import PlantParameters
from rotflex.recording import Recording
from rotflex.simulation import zero_order_hold
from solutions.course import COURSE
from solutions.key_modeling import A, B

SERVO, SPEC = srv02(), student_bench(7)
PLANT, JOINT = SPEC.parameters, SPEC.joint
MODULES = [one.name for one in pkgutil.walk_packages(rotflex.__path__, "rotflex.")]
COMMANDS = ("__main__", "cli", "commands")  # ends of modules that return nothing, and do things
DEEPEST = 3


def given():
    """What somebody at the bench has: by the name of a parameter."""
    still = Recording.of(np.arange(10) * 0.002, theta=np.zeros(10), alpha=np.zeros(10), vm=np.zeros(10))
    zero = Prediction(still, {"theta": 0.0, "alpha": 0.0})
    found = FitResult(PLANT, 0.0, {}, {}, np.eye(0), (zero,), (PLANT,), {}, SERVO, JOINT)
    named = {"servo": SERVO, "joint": JOINT, "K_s": PLANT.K_s, "stiffness": PLANT.K_s, "plant": PLANT}
    return {**named, "parameters": PLANT, "found": found, "fit": found, "spec": SPEC, "seed": 7}


def wanted():
    """A and B of the bench and of its parts, of torque and voltage, continuous and sampled."""
    for p in (PLANT, PlantParameters.of(SERVO, JOINT, PLANT.K_s)):
        values = {name: getattr(p, name) for name in ("K_s", "J_l", "J_eq", "B_eq")}
        damped = values | {"B_eq": p.B_eq + p.torque_per_volt * p.back_emf}
        for a, b in ((A(values), B(values)), (A(damped), p.torque_per_volt * np.array(B(values)))):
            yield from (np.array(a), np.ravel(b))
            yield from (np.asarray(one).squeeze() for one in zero_order_hold(np.array(a), np.array(b), 0.002))


WANTED = [*wanted()]


def holds(value, depth=DEEPEST):
    """Whether a value is, or has anywhere in it, one of the arrays that are wanted; an undamped joint counts."""
    with contextlib.suppress(Exception):
        array = np.squeeze(np.asarray(value, dtype=float))
        if any(array.shape == one.shape and np.allclose(array, one, rtol=0.02, atol=1e-6) for one in WANTED):
            return True
    if depth == 0 or isinstance(value, str | bytes | np.ndarray | type) or inspect.ismodule(value):
        return False
    within = list(value.values()) if isinstance(value, Mapping) else []
    within += list(value) if isinstance(value, list | tuple) else []
    for name in () if isinstance(value, int | float) else dir(value):
        if not name.startswith("_") and name != "states":  # which python-control will not have any more
            with contextlib.suppress(Exception):
                within.append(getattr(value, name))
    return any(holds(one, depth - 1) for one in within if not inspect.isroutine(one))


def calls(module):
    """(name, what it returns) of each public function, class and method that what is given is enough for."""
    known = given()
    functions = {
        f"{module}.{name}": one
        for name, one in vars(importlib.import_module(module)).items()
        if not name.startswith("_") and callable(one) and getattr(one, "__module__", "") == module
    }
    for one in known.values():
        if dataclasses.is_dataclass(one) and type(one).__module__ == module:
            for name, method in inspect.getmembers(one, inspect.ismethod):
                functions[f"{module}.{type(one).__name__}.{name}"] = method
    for name, function in functions.items():
        with contextlib.suppress(Exception):
            parameters = inspect.signature(function).parameters.values()
            named = [one for one in parameters if one.kind not in (one.VAR_POSITIONAL, one.VAR_KEYWORD)]
            arguments = {one.name: known[one.name] for one in named if one.name in known}
            enough = all(one.name in known or one.default is not one.empty for one in named)
            if enough and (arguments or inspect.ismethod(function)):
                yield name, function(**arguments)


def tellers(module):
    return {name for name, result in calls(module) if holds(result)}


def test_the_search_finds_what_the_course_withholds():
    assert tellers("rotflex.model") == {f"rotflex.model.{name}" for name in ("of_fit", "of_plant", "state_space")}


def test_nothing_of_a_release_returns_the_model_of_a_bench():
    released = [name for name in MODULES if name not in COURSE.withheld and not name.endswith(COMMANDS)]
    assert len(released) > 60
    assert [name for module in released for name in tellers(module)] == []


def test_nor_does_an_open_bench():
    with hil.open("virtual:?seed=7") as bench:
        assert not holds(bench, depth=4)
