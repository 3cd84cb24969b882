"""The parameters of the parts against data sheets and the workbook."""

import math

import pytest

from rotflex import config
from rotflex.config import joint, srv02
from rotflex.errors import ConfigurationError, RotflexError


@pytest.mark.parametrize(
    ("gear", "load", "ratio", "B_eq", "J_eq", "rel"),
    [
        ("high", "none", 70, 0.004, 2.0841792e-3, 3e-7),  # as in the printed matrices, of rounded conversion factors
        ("high", "disc", 70, 0.015, 2.13418e-3, 3e-6),
        ("high", "bar", 70, 0.015, 2.28346e-3, 3e-6),
        ("low", "none", 14, 1.5e-4, 9.76e-5, 5e-4),
    ],
)
def test_ratio_damping_and_equivalent_inertia_of_gear_and_load(gear, load, ratio, B_eq, J_eq, rel):
    servo = srv02(gear=gear, load=load)
    assert (servo.K_g, servo.B_eq) == (ratio, B_eq)
    assert servo.J_eq == pytest.approx(J_eq, rel=rel)


def test_sensors():
    for encoder, counts in (("E", 4096), ("EHR", 8192)):
        assert srv02(encoder=encoder).K_enc * counts == pytest.approx(2 * math.pi, rel=1e-15)
    assert math.degrees(srv02().K_pot) == pytest.approx(-35.2, rel=1e-12)
    assert srv02().K_tach == pytest.approx(-0.99733, abs=5e-6)


@pytest.mark.parametrize(
    ("amplifier", "cable_gain", "V_max"),
    [
        ("VoltPAQ-X1", 1, 10),  # the board's output
        ("VoltPAQ-X1", 3, 24),  # 30 V asked of an amplifier that has 24
        ("UPM_1503", 3, 15),
    ],
)
def test_motor_voltage_is_limited_by_board_and_cable_or_by_the_amplifier(amplifier, cable_gain, V_max):
    assert srv02(amplifier=amplifier, cable_gain=cable_gain).V_max == V_max


@pytest.mark.parametrize(
    ("position", "inches", "J_l", "of_millimetres"),
    [(1, 8.25, 3.278e-3, 3.278e-3), (2, 9.25, 3.617e-3, 3.612e-3), (3, 10.25, 3.994e-3, 3.983e-3)],
)
def test_inertia_of_the_link_from_the_anchors_in_inches_and_in_rounded_millimetres(
    position, inches, J_l, of_millimetres
):
    arm = joint(position)
    assert arm.arm_position == position
    assert arm.d_12 == pytest.approx(inches * 0.0254, rel=1e-12)
    assert arm.J_l == pytest.approx(J_l, abs=5e-7)
    lengths = {"d_12": round(arm.d_12 + 1e-9, 3), "L_1": 0.298, "L_2": 0.156}
    assert config.Joint(arm_position=position, m_1=0.064, m_2=0.030, **lengths).J_l == pytest.approx(
        of_millimetres, abs=5e-7
    )


@pytest.mark.parametrize(
    ("argument", "value", "allowed"),
    [
        ("gear", "HIGH", "'high', 'low'"),
        ("load", "disk", "'none', 'disc', 'bar'"),
        ("encoder", "e", "'E', 'EHR'"),
        ("tachometer", "yes", "True, False"),
        ("amplifier", "VoltPAQ", "'VoltPAQ-X1'"),
        ("cable_gain", 2, "1, 3, 5"),
    ],
)
def test_servo_that_does_not_exist_is_refused_with_those_that_do(argument, value, allowed):
    with pytest.raises(ConfigurationError) as caught:
        srv02(**{argument: value})
    assert isinstance(caught.value, ValueError) and isinstance(caught.value, RotflexError)
    assert all(one in str(caught.value) for one in (argument, repr(value), allowed))


def test_joint_is_mounted_on_the_bare_servo_in_high_gear_only():
    servo = srv02()
    assert config.check_mounted(servo) is servo
    with pytest.raises(ConfigurationError, match=r"gear.* 'low'; allowed: 'high'"):
        config.check_mounted(srv02(gear="low"))
    with pytest.raises(ConfigurationError, match=r"load.* 'disc'; allowed: 'none'"):
        config.check_mounted(srv02(load="disc"))
