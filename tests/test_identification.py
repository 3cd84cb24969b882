"""Spectra, resonances and free decays against signals whose truth is known, and against virtual benches."""

import math

import control
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import cont2discrete, lfilter

from rotflex import experiments, hil
from rotflex.errors import IdentificationError
from rotflex.hil.student_benches import student_bench
from rotflex.identification import (
    FrequencyResponse,
    frequency_response,
    logarithmic_decrement,
    resonance,
)
from rotflex.recording import Recording
from rotflex.signals import chirp, time_axis
from rotflex.units import DEG, HZ

SAMPLE_TIME = 0.002
COUNT = 2 * math.pi / 4096
T = time_axis(15.0, SAMPLE_TIME)


def quantised(x):
    return np.round(x / COUNT) * COUNT


def link_ratio(omega, omega_n, zeta):
    """alpha/theta of a link without Coulomb friction."""
    return omega**2 / (omega_n**2 - omega**2 + 2j * zeta * omega_n * omega)


def link_driven_by(theta, omega_n, zeta):
    """alpha of such a link, when the servo moves as told (in straight lines between samples)."""
    b, a, _ = cont2discrete(([-1, 0, 0], [1, 2 * zeta * omega_n, omega_n**2]), SAMPLE_TIME, method="foh")
    return lfilter(b.ravel(), a, theta)


def test_a_delay_with_gain_shows_its_gain_and_phase():
    source = np.random.default_rng(1).standard_normal(20_000)
    response = frequency_response((source[5:], 2 * source[:-5], SAMPLE_TIME), segment=4.0)
    inside = response.f_hz < 100
    expected = 2 * np.exp(-2j * np.pi * response.f_hz * 5 * SAMPLE_TIME)
    np.testing.assert_allclose(response.ratio[inside], expected[inside], rtol=0.1)
    assert response.coherence[inside].min() > 0.95


@given(f_n=st.floats(1.3, 4.6), zeta=st.floats(0.005, 0.2))
@settings(max_examples=40, deadline=None)
def test_an_exact_response_gives_its_natural_frequency_exactly(f_n, zeta):
    f = np.arange(0.05, 20, 0.02)
    response = FrequencyResponse(f, link_ratio(f * HZ, f_n * HZ, zeta), np.ones(f.size), resolution=0.02)
    assert resonance(response).value == pytest.approx(f_n * HZ, rel=1e-5)


def test_the_stated_uncertainty_of_a_resonance_covers_the_errors_that_noise_makes():
    theta = chirp(T, 1.0, 5.0, 4 * DEG)
    alpha = link_driven_by(theta, 3.0 * HZ, 0.03)
    draw = np.random.default_rng(5)
    errors = []
    for _ in range(12):
        noise = 2 * DEG * draw.standard_normal(T.size)
        found = resonance(frequency_response((theta, alpha + noise, SAMPLE_TIME)))
        errors.append((found.value - 3.0 * HZ) / found.uncertainty)
    assert np.sqrt(np.mean(np.square(errors))) < 2
    assert found.uncertainty < 0.01 * found.value


def test_no_resonance_is_said_for_noise_for_a_stiff_link_and_for_one_outside_the_band():
    draw = np.random.default_rng(6)
    theta = chirp(T, 1.0, 5.0, 4 * DEG)
    stiff = 0.5 * theta + 0.01 * DEG * draw.standard_normal(T.size)
    above = link_driven_by(theta, 9.0 * HZ, 0.02)
    for x, y in ((*draw.standard_normal((2, T.size)),), (theta, stiff), (theta, above)):
        with pytest.raises(IdentificationError, match="no resonance"):
            resonance(frequency_response((x, y, SAMPLE_TIME)))


@pytest.mark.parametrize(("f_n", "inside"), [(0.98, False), (1.1, True), (4.9, True), (5.02, False)])
def test_a_resonance_just_beyond_either_edge_of_the_band_is_none(f_n, inside):
    f = np.arange(0.05, 20, 0.02)
    response = FrequencyResponse(f, link_ratio(f * HZ, f_n * HZ, 0.03), np.ones(f.size), resolution=0.1)
    if inside:
        assert resonance(response).value == pytest.approx(f_n * HZ, rel=1e-5)
    else:
        with pytest.raises(IdentificationError):
            resonance(response)


def test_unusable_signals_are_refused_with_their_name():
    moving = np.sin(T)
    with pytest.raises(IdentificationError, match="needs the channel 'alpha'; the recording has theta"):
        frequency_response(Recording.of(T, theta=moving))
    with pytest.raises(IdentificationError, match="'alpha' is constant"):
        frequency_response(Recording.of(T, theta=moving, alpha=np.zeros(T.size)))
    with pytest.raises(IdentificationError, match="30 samples; at least"):
        frequency_response((moving[:30], moving[:30], SAMPLE_TIME))
    with pytest.raises(IdentificationError, match="7501 samples, the output 7500"):
        frequency_response((moving, moving[1:], SAMPLE_TIME))
    with pytest.raises(IdentificationError, match="Segments of 20 s do not fit"):
        frequency_response((moving, moving, SAMPLE_TIME), segment=20.0)
    with pytest.raises(IdentificationError, match="sample time is 0"):
        frequency_response((moving, moving, 0.0))
    with pytest.raises(IdentificationError, match="finite"):
        frequency_response((np.full(100, np.nan), moving[:100], SAMPLE_TIME))


@pytest.mark.parametrize(("seed", "drive"), [(0, "voltage"), (8, "voltage"), (1, "position"), (7, "position")])
def test_a_virtual_bench_gives_its_natural_frequency_whatever_drives_the_servo(seed, drive):
    with hil.open(f"virtual:?seed={seed}") as bench:
        recording = experiments.sweep(bench, drive=drive, progress=False)
    parameters = student_bench(seed).parameters
    truth = math.sqrt(parameters.K_s / parameters.J_l)
    found = resonance(frequency_response(recording))
    # On the stiffest joints, near the end of the sweep, it reads higher, see there.
    assert found.value == pytest.approx(truth, rel=0.012 if truth > 26.0 else 0.005)
    assert abs(found.value - truth) < 3 * found.uncertainty
    assert found.uncertainty < 0.005 * truth


def free_swing(omega_n, zeta, friction=(0.0, 0.0), start=0.17, duration=6.0):
    """alpha of a link let go at ``start``, half swing by half swing; ``friction`` is (F⁺, F⁻)/K_s, rad."""
    t = time_axis(duration, SAMPLE_TIME)
    omega_d = omega_n * math.sqrt(1 - zeta**2)
    alpha = np.full(t.size, start)
    turned, at = 0.0, start
    while turned < duration:
        middle = friction[1] if at > 0 else -friction[0]
        if abs(at) <= abs(middle):
            alpha[t >= turned] = at
            break
        after = t[t >= turned] - turned
        shape = np.exp(-zeta * omega_n * after) * (
            np.cos(omega_d * after) + zeta * omega_n / omega_d * np.sin(omega_d * after)
        )
        alpha[t >= turned] = middle + (at - middle) * shape
        at = middle - (at - middle) * math.exp(-math.pi * zeta * omega_n / omega_d)
        turned += math.pi / omega_d
    return t, alpha


@given(
    zeta=st.floats(0.005, 0.03),
    plus=st.floats(0.0005, 0.002),
    minus=st.floats(0.0005, 0.002),
    offset=st.floats(-3e-3, 3e-3),
)
@settings(max_examples=20, deadline=None)
def test_friction_encoders_and_an_offset_do_not_pass_for_viscous_damping(zeta, plus, minus, offset):
    _, alpha = free_swing(20.0, zeta, (plus, minus))
    found = logarithmic_decrement(quantised(alpha + offset), SAMPLE_TIME)
    assert found.omega_n.value == pytest.approx(20.0, rel=5e-3)
    assert found.zeta.value == pytest.approx(zeta, abs=max(4 * found.zeta.uncertainty, 1e-3))
    assert found.zeta.uncertainty < 0.003


@given(gives_way=st.floats(0, 0.06), lags=st.floats(0, 0.04), zeta=st.floats(0.01, 0.03))
@settings(max_examples=20, deadline=None)
def test_a_servo_that_gives_way_is_allowed_for(gives_way, lags, zeta):
    omega_n, g = 19.0, complex(gives_way, -lags)
    s = np.roots([1 + g, 2 * zeta * omega_n, omega_n**2])
    s = s[np.argmax(s.imag)]
    t = time_axis(5.0, SAMPLE_TIME)
    swing = 0.15 * np.exp(s * t)
    found = logarithmic_decrement(Recording.of(t, theta=0.17 + (g * swing).real, alpha=swing.real))
    assert found.omega_n.value == pytest.approx(omega_n, rel=3e-3)
    assert found.zeta.value == pytest.approx(zeta, abs=max(1.5e-3, 2 * found.zeta.uncertainty))


def test_turning_points_have_the_times_of_the_recording_also_where_the_servo_stands_later():
    omega, start = 15.0, 0.4
    t = time_axis(6.0, SAMPLE_TIME)
    swing = np.where(t < start, 0.0, 0.2 * np.exp(-0.3 * (t - start)) * np.cos(omega * (t - start)))
    found = logarithmic_decrement(Recording.of(t, theta=0.3 * np.minimum(t / start, 1.0), alpha=swing))
    np.testing.assert_allclose(np.interp(found.peak_times, t, swing), found.peaks, rtol=0.01)


def test_what_is_no_free_decay_is_refused():
    t, alpha = free_swing(20.0, 0.02)
    with pytest.raises(IdentificationError, match="turning points"):
        logarithmic_decrement(free_swing(20.0, 0.4)[1], SAMPLE_TIME)
    with pytest.raises(IdentificationError, match="do not become smaller"):
        logarithmic_decrement(alpha[::-1], SAMPLE_TIME)
    with pytest.raises(IdentificationError, match="give dt"):
        logarithmic_decrement(alpha)
    with pytest.raises(IdentificationError, match="constant"):
        logarithmic_decrement(Recording.of(t, alpha=np.zeros(t.size)))


@pytest.mark.parametrize("seed", [3, 6])
def test_a_virtual_bench_decays_at_its_natural_frequency_with_its_viscous_damping(seed):
    """The natural frequency within 1 %, the damping ratio within 0.006. The servo of some benches gives way more."""
    with hil.open(f"virtual:?seed={seed}") as bench:
        recording = experiments.free_decay(bench, progress=False)
    true = student_bench(seed).parameters
    found = logarithmic_decrement(recording)
    omega_n = math.sqrt(true.K_s / true.J_l)
    assert found.omega_n.value == pytest.approx(omega_n, rel=0.01)
    assert abs(found.omega_n.value - omega_n) < 2 * found.omega_n.uncertainty
    assert found.zeta.value == pytest.approx(true.B_l / (2 * math.sqrt(true.K_s * true.J_l)), abs=0.006)


def test_a_response_becomes_an_frd_of_python_control_with_gain_phase_and_names():
    omega_n, zeta = 20.0, 0.2
    theta = np.cumsum(np.random.default_rng(1).standard_normal(100_000)) * 1e-3
    time = np.arange(theta.size) * SAMPLE_TIME
    found = frequency_response(
        Recording.of(time, theta=theta, alpha=link_driven_by(theta, omega_n, zeta)), segment=10.0
    )
    frd = found.to_frd(band=(1.5, 6.0))
    assert (frd.input_labels, frd.output_labels) == (["theta"], ["alpha"])
    assert frd.omega[0] >= 1.5 * HZ and frd.omega[-1] <= 6.0 * HZ
    link = control.tf([-1, 0, 0], [1, 2 * zeta * omega_n, omega_n**2])
    np.testing.assert_allclose(frd.frdata[0, 0], link(1j * frd.omega), atol=0.1)
    loop = control.feedback(control.tf([1], [1, 1]) * frd)  # it works with other systems
    np.testing.assert_allclose(loop.frdata, frd.frdata / (1 + 1j * frd.omega + frd.frdata))
    assert found.to_frd().omega[0] > 0
    with pytest.raises(IdentificationError):
        found.to_frd(band=(300, 400))


def test_several_outputs_are_each_as_if_alone():
    theta = np.cumsum(np.random.default_rng(1).standard_normal(20_000)) * 1e-3
    alpha = link_driven_by(theta, 20.0, 0.2)
    recording = Recording.of(np.arange(theta.size) * SAMPLE_TIME, vm=np.gradient(theta), theta=theta, alpha=alpha)
    both = frequency_response(recording, input="vm", output=("theta", "alpha")).to_frd(band=(1, 5))
    assert (both.input_labels, both.output_labels) == (["vm"], ["theta", "alpha"])
    for row, name in enumerate(both.output_labels):
        alone = frequency_response(recording, input="vm", output=name).to_frd(band=(1, 5))
        np.testing.assert_allclose(both.frdata[row, 0], alone.frdata[0, 0], rtol=1e-12)
    with pytest.raises(IdentificationError, match="names for 1"):
        frequency_response((theta, (theta, alpha), SAMPLE_TIME), output=("theta",))
    with pytest.raises(IdentificationError, match="of one output"):
        resonance(frequency_response((theta, (theta, alpha), SAMPLE_TIME), output=("theta", "alpha")))
