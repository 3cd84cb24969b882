"""A student's session and model, for the explorers."""

import numpy as np
import pytest

import rotflex.course.lab
from rotflex.model import state_space


@pytest.fixture
def lab(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("LABCOURSE_PICTURES", raising=False)
    return rotflex.course.lab.start("ada", folder=tmp_path, quiet=True)


@pytest.fixture
def model(lab):
    system = state_space(lab.servo, lab.joint, lab.joint.J_l * 20.7**2, input="voltage")
    return np.asarray(system.A), np.asarray(system.B)
