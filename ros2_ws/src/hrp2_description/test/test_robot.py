"""Tests of the robot's configuration."""

import copy
import math

import numpy as np
import pytest
import yaml
from hrp2_description.data import data_path
from hrp2_description.errors import RobotConfigError
from hrp2_description.robot import load_robot_config

ROBOT = load_robot_config()
BRACE = {
    "arm": {"link": "RARM_LINK4", "xyz": [0.0, 0.0, 0.0], "radius": 0.04},
    "trunk": {"link": "base_link", "xyz": [0.0, -0.2, 0.2], "normal": [0, -1, 0], "radius": 0.04},
    "stiffness": 1e6, "damping": 1e2, "friction": 0.5,
}  # fmt: skip
DRIVE = ("gear", "rotor_inertia", "size", "position_gain", "speed_gain")
WRIST = {"link": "l_gripper", "joint": "l_gripper_joint"}
FOOTSTEPS = {"ahead": 0.2, "back": 0.15, "width": 0.19, "narrowest": 0.17, "widest": 0.34,
             "turn_deg": 20.0, "clearance": 0.02}
STEP = {"shortest": 0.12, "nominal": 0.20, "longest": 0.30, "lift": 0.035}


def _load_edited(folder, **changes):
    data = yaml.safe_load(data_path("config/robot.yaml").read_text(encoding="utf-8"))
    for key, value in changes.items():
        if value is None:
            del data[key]
        else:
            data[key] = value
    path = folder / "robot.yaml"
    path.write_text(yaml.safe_dump(data), encoding="utf-8")
    return load_robot_config(path)


def test_arrays_have_an_entry_for_each_joint():
    """All arrays are (30,), finite and read-only."""
    for array in (
        ROBOT.half_sitting,
        ROBOT.drives.gear_ratio,
        ROBOT.drives.rotor_inertia,
        ROBOT.lower,
        ROBOT.upper,
        ROBOT.velocity_limit,
        ROBOT.effort_limit,
    ):
        assert array.shape == (len(ROBOT.joint_names),) == (30,)
        assert np.isfinite(array).all()
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 1.0


def test_published_limits():
    """Some limits are those of the sources, with yaw and roll swapped on the left."""
    lower, upper = np.rad2deg(ROBOT.lower), np.rad2deg(ROBOT.upper)
    expected = {
        "RLEG_JOINT0": (-45, 30),
        "LLEG_JOINT0": (-30, 45),
        "RLEG_JOINT1": (-35, 20),
        "LLEG_JOINT1": (-20, 35),
        "LLEG_JOINT3": (-2, 150),
        "RLEG_JOINT5": (-20, 35),
        "LLEG_JOINT5": (-35, 20),
        "RARM_JOINT1": (-95, 10),
        "LARM_JOINT1": (-10, 95),
        "LARM_JOINT3": (-137, 2),
        "CHEST_JOINT1": (-5, 60),
    }
    for name, (low, high) in expected.items():
        at = ROBOT.index(name)
        np.testing.assert_allclose((lower[at], upper[at]), (low, high), atol=1e-6)


def test_half_sitting_is_the_published_posture():
    """The legs are at -26, 50, -24 degrees and the arms at 15, -+10, 0, -30 degrees."""
    expected = [0, 0, -26, 50, -24, 0] * 2 + [0] * 4
    expected += [15, -10, 0, -30, 0, 0, 10, 15, 10, 0, -30, 0, 0, 10]
    np.testing.assert_allclose(np.rad2deg(ROBOT.half_sitting), expected, atol=1e-9)


def test_reflected_rotor_inertia():
    """Gear^2 times J is 0.40 at hip roll, 0.35 at shoulder roll, 1.0 kg m^2 at chest pitch."""
    for name, value in (("RLEG_JOINT1", 0.40), ("LARM_JOINT1", 0.35), ("CHEST_JOINT1", 1.01)):
        assert ROBOT.armature[ROBOT.index(name)] == pytest.approx(value, abs=0.01)


def test_each_gear_is_the_smallest_whose_momentary_peak_torque_exceeds_its_motors():
    """A smaller size of the table would bear less than the motor's largest torque."""
    peaks = sorted(set(ROBOT.drives.peak_torque))
    for peak, effort in zip(ROBOT.drives.peak_torque, ROBOT.effort_limit, strict=True):
        assert peak > effort
        assert not [smaller for smaller in peaks if effort < smaller < peak]


def test_motor_encoders_resolve_the_joints_behind_the_gears():
    """2000 counts per motor turn are 31 urad at ankle roll (gear 100) and a quarter at hip yaw."""
    assert ROBOT.motor_encoder_counts == 2000
    assert ROBOT.joint_resolution.shape == (30,)
    assert ROBOT.joint_resolution[ROBOT.index("LLEG_JOINT5")] == pytest.approx(31.416e-6, rel=1e-4)
    assert ROBOT.joint_resolution[ROBOT.index("RLEG_JOINT0")] == pytest.approx(8.181e-6, rel=1e-4)


def test_counts_of_no_encoder_are_refused(tmp_path):
    """The error has the value."""
    with pytest.raises(RobotConfigError, match="motor_encoder_counts") as caught:
        _load_edited(tmp_path, motor_encoder_counts=2000.5)
    assert caught.value.value == 2000.5


def test_soles_are_mirrored_and_as_large_as_the_collision_box():
    """A sole is 0.23 x 0.13 m and extends farther outward than inward."""
    assert ROBOT.soles["right"] == (-0.10, 0.13, -0.075, 0.055)
    assert ROBOT.soles["left"] == (-0.10, 0.13, -0.055, 0.075)


def test_rubber_under_the_soles_is_as_stiff_as_published():
    """It is between LAAS's 4e4 N/m and JSK's 1e5 N/m, and its roll stiffness is that of JSK."""
    rubber = ROBOT.sole_rubber
    assert 4e4 <= rubber.stiffness <= 1e5
    assert 1e2 <= rubber.damping <= 6e2
    half_width = np.ptp(ROBOT.soles["right"][2:]) / 2.0
    assert 400.0 < rubber.stiffness * half_width**2 < 600.0


def test_footsteps_are_as_wide_as_half_sitting():
    """The feet of half-sitting are 0.19 m apart; degrees of the file become radians."""
    assert ROBOT.footsteps.width == pytest.approx(0.19)
    assert ROBOT.footsteps.turn == pytest.approx(math.radians(20.0))


@pytest.mark.parametrize("field", ["joint_names", "step"])
def test_missing_field_is_named(tmp_path, field):
    """The error names the missing field."""
    with pytest.raises(RobotConfigError, match=field):
        _load_edited(tmp_path, **{field: None})


@pytest.mark.parametrize(("place", "value", "message"), [
    (("drives", "RARM", "size"), [25, 17, 13, 17, 11, 11, 11], "size of the gear of RARM_JOINT2"),
    (("gear_sizes", 17, "peak_torque"), 500.0, "gear_sizes.17"),
])
def test_a_gear_of_no_size_or_whose_teeth_skip_below_its_peak_torque_is_refused(
        tmp_path, place, value, message):
    """The error names the joint or the size."""
    data = yaml.safe_load(data_path("config/robot.yaml").read_text(encoding="utf-8"))
    changed = copy.deepcopy(data[place[0]])  # RARM and LARM are one table in the file
    changed[place[1]][place[2]] = value
    with pytest.raises(RobotConfigError, match=message):
        _load_edited(tmp_path, **{place[0]: changed})


def test_joints_left_out_are_fixed_only_where_the_file_says_so(tmp_path):
    """Without `other_joints` the list must have all joints of the URDF."""
    short = list(ROBOT.joint_names[:-1])
    tables = {
        key: yaml.safe_load(data_path("config/robot.yaml").read_text(encoding="utf-8"))[key]
        for key in ("half_sitting_deg", "drives")
    }
    tables["half_sitting_deg"]["LARM"].pop()
    with pytest.raises(RobotConfigError, match="differ"):
        _load_edited(tmp_path, joint_names=short, **tables)
    tables["drives"] = None
    robot = _load_edited(tmp_path, joint_names=short, other_joints="fixed", **tables)
    assert robot.joint_names == tuple(short)
    assert robot.lower.shape == (29,)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"contact_link": "RARM_ELBOW"}, "RARM_ELBOW"),
        ({"braced_posture_deg": {"RARM_JOINT1": -100}}, "RARM_JOINT1 outside its limits"),
        ({"joint_names": list(ROBOT.joint_names[:-1])}, "LARM_JOINT6"),
        ({"urdf": "urdf/none.urdf"}, "none.urdf"),
        ({"sole": [1, 2, 3]}, "sole"),
        ({"step": {**STEP, "shortest": 0.25}}, "shortest < nominal"),
        ({"brace": {**BRACE, "stiffness": float("inf")}}, "stiffness"),
        ({"wrist_sensors": {"left": WRIST}}, "right"),
        ({"drives": {"RLEG": {key: [1] for key in DRIVE}}}, "RLEG_JOINT0"),
        ({"chest_yaw": "CHEST_JOINT7"}, "CHEST_JOINT7"),
        ({"footsteps": {**FOOTSTEPS, "clearance": math.nan}}, r"footsteps\.clearance"),
        ({"footsteps": {**FOOTSTEPS, "width": 0.4}}, "narrowest to widest"),
        ({"contact_lnk": "RARM_LINK3"}, r"contact_lnk .*contact_link"),
    ],
)
def test_contradictions_are_refused(tmp_path, changes, message):
    """Unknown names, violated limits and wrong lengths are errors that name the cause."""
    with pytest.raises(RobotConfigError, match=message):
        _load_edited(tmp_path, **changes)


def test_a_file_that_is_no_configuration_is_refused(tmp_path):
    """A list is an error that names the file."""
    path = tmp_path / "other.yaml"
    path.write_text("- a\n- b\n", encoding="utf-8")
    with pytest.raises(RobotConfigError, match=r"other\.yaml"):
        load_robot_config(path)
