"""What no robot can be is refused by name, and what is improbable is doubted in words."""

import re

import pytest
from hrp2_description import check_robot
from hrp2_description.data import data_path
from hrp2_description.errors import RobotConfigError
from hrp2_description.robot import load_robot_config

URDF = data_path("urdf/hrp2.urdf").read_text(encoding="utf-8")
YAML = data_path("config/robot.yaml").read_text(encoding="utf-8")
INERTIA = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
SLIP = {"ixx": 0.16, "ixy": -0.001, "ixz": -0.004, "iyy": -0.001, "iyz": 0.137, "izz": 0.004}


def scaled(text, factor, *attributes):
    """Return XML in which the numbers of some attributes are multiplied."""
    return re.sub(
        rf' ({"|".join(attributes)})="([^"]*)"',
        lambda found: f' {found[1]}="' + " ".join(
            str(factor * float(each)) for each in found[2].split()) + '"', text)


def put(text, **values):
    """Return XML with other values of some attributes."""
    for key, value in values.items():
        text = re.sub(rf' {key}="[^"]*"', f' {key}="{value}"', text)
    return text


def edited(name, change):
    """Return the URDF with the element of a link or joint changed."""
    kind = "joint" if "JOINT" in name else "link"
    element = re.search(rf'<{kind} name="{name}".*?</{kind}>', URDF, re.S)[0]
    assert change(element) != element
    return URDF.replace(element, change(element))


def robot(folder, urdf=URDF, yaml=YAML):
    """Write the files of a robot, and load them."""
    (folder / "robot.urdf").write_text(urdf)
    path = folder / "robot.yaml"
    path.write_text(yaml.replace("urdf: urdf/hrp2.urdf", "urdf: robot.urdf"))
    return load_robot_config(path)


@pytest.mark.parametrize(("name", "change", "match"), [
    ("torso", lambda t: put(t, ixx=-0.16048), r"torso .*11.5246, -0.16.*0 or more"),
    ("torso", lambda t: scaled(t, 1000.0, "izz"), "torso .*none above the sum of the two others"),
    ("torso", lambda t: put(t, **SLIP), "torso .*-0.1"),
    ("torso", lambda t: scaled(t, 1e6, *INERTIA), r"torso .*radius of gyration .*kg mm\^2"),
    ("torso", lambda t: scaled(t, 1e-3, *INERTIA), "torso .*densest metal"),
    ("RLEG_LINK3", lambda t: put(t, value=0), "RLEG_LINK3 .*a mass above 0"),
    ("RLEG_LINK3", lambda t: put(t, value=-1), "RLEG_LINK3 .*a mass above 0"),
    ("RLEG_LINK3", lambda t: put(t, value="nan"), "mass of RLEG_LINK3 .*finite"),
    ("RLEG_LINK3", lambda t: put(t, value="1,7"), "mass of RLEG_LINK3 .*1,7"),
    ("torso", lambda t: put(t, rpy="0, 0, 0"), "origin rpy in torso .*0, 0, 0.*3 finite numbers"),
    ("torso", lambda t: put(t, rpy="0 1.57"), "origin rpy in torso .*0 1.57"),
    ("torso", lambda t: put(t, rpy="0 0 1.57rad"), "origin rpy in torso .*1.57rad.*without units"),
    ("torso", lambda t: put(t, rpy="0 90 0"), r"origin rpy in torso .*\(degrees\?\)"),
    ("RARM_JOINT2", lambda t: put(t, xyz="0 0"), "xyz in RARM_JOINT2 .*3 finite numbers"),
    ("RLEG_LINK3", lambda t: put(t, **dict.fromkeys(INERTIA, 0)), r"RLEG_LINK3 \(1.7476 kg\)"),
    ("RLEG_LINK3", lambda t: re.sub("<inertial>.*</inertial>", "", t, flags=re.S),
     r"RLEG_LINK3 \(0 kg\)"),
    ("RARM_JOINT1", lambda t: put(t, velocity=0), "velocity of RARM_JOINT1 .*found 0.0"),
    ("RARM_JOINT1", lambda t: put(t, velocity=-2), "velocity of RARM_JOINT1 .*above 0"),
    ("RARM_JOINT1", lambda t: put(t, velocity="inf"), "velocity of RARM_JOINT1 .*finite"),
    ("RARM_JOINT1", lambda t: put(t, effort=0), "effort of RARM_JOINT1 .*above 0"),
    ("RARM_JOINT1", lambda t: re.sub("<limit.*?/>", "", t), "of RARM_JOINT1 .*none"),
    ("RARM_JOINT1", lambda t: put(t, lower=1.66), "RARM_JOINT1 .*lower first"),
    ("RARM_JOINT1", lambda t: put(t, lower=-95, upper=10), r"RARM_JOINT1 .*\(degrees\?\)"),
    ("RARM_JOINT3", lambda t: re.sub('axis xyz=".*?"', 'axis xyz="0 2 0"', t), "axis of RARM_JOI"),
    ("RARM_JOINT6", lambda t: t.replace("</", '<mimic joint="LARM_JOINT6"/></'), "without mimic"),
    ("RARM_JOINT6", lambda t: re.sub("(parent link)=.*?/", r'\1="no"/', t), "RARM_JOINT6.*a tree"),
    ("RARM_JOINT2", lambda t: re.sub("(parent link)=.*?/", r'\1="RARM_LINK5"/', t), "a tree"),
])
def test_links_and_joints_that_cannot_be_are_refused_by_name(tmp_path, name, change, match):
    """Masses, principal moments, limits and axes, with the value that was found."""
    mark = "frames: {mark: {link: RLEG_LINK3, xyz: [0, 0, 0]}}\n"  # gives its link no weight
    with pytest.raises(RobotConfigError, match=match):
        robot(tmp_path, edited(name, change), YAML + mark)


@pytest.mark.parametrize(("urdf", "match"), [
    (scaled(URDF, 1e3, "xyz"), r"\(mm\?\)"),
    (scaled(URDF, 1e3, "value", *INERTIA), r"16988.*\(g\?\)"),
    (scaled(URDF, 1e-3, "value", *INERTIA), r"0.0579.*tonnes\?\)"),
    (scaled(URDF, 180.0 / 3.14159, "lower", "upper"), r"\(degrees\?\)"),
    (URDF.replace("</robot>", '<link name="torso"/></robot>'), "torso twice"),
    (URDF.replace("</robot>", '<link name="alone"/></robot>'), "a tree of all 38 links"),
])
def test_a_robot_in_another_unit_or_that_is_no_tree_is_refused(tmp_path, urdf, match):
    with pytest.raises(RobotConfigError, match=match):
        robot(tmp_path, urdf)


@pytest.mark.parametrize(("old", "new", "match"), [
    (r"sole: \[.*\]", "sole: [-100, 130, -75, 55]", r"sole .*\(mm\?\)"),
    (r"sole: \[.*\]", "sole: [-0.1, -0.07, 0.13, 0.05]", "sole .*the lower one first"),
    ("contact_radius: 0.05", "contact_radius: 50", r"contact_radius .*\(mm\?\)"),
    (r"heights: \[.*\]", "heights: [750, 1250]", r"arm.heights .*\(mm\?\)"),
    (r"0, 0, -26, 50, -24, 0", "0, 0, -0.45, 0.87, -0.42, 0", r"LLEG_JOINT3 .*\(radians\?\)"),
    (r"(JOINT\d): (-?)\d+\.\d+", r"\1: \g<2>1.5", None),
    (r"turn_deg: 20", "turn_deg: 0.35", r"turn_deg .*\(radians\?\)"),
    (r"gear: \[384", "gear: [0.0026", "gear.0 .*1 or more"),
    ("6.96e-6", "6.96e-2", r"CHEST_JOINT1 .*\(kg cm\^2\?\)"),
])
def test_numbers_of_robot_yaml_in_another_unit_are_refused(tmp_path, old, new, match):
    yaml, count = re.subn(old, new, YAML)
    assert count
    if match is None:  # every angle of the braced posture
        yaml = yaml.replace("RARM_JOINT6: 10", "RARM_JOINT6: 0.17")
        match = r"braced_posture_deg .*\(radians\?\)"
    with pytest.raises(RobotConfigError, match=match):
        robot(tmp_path, yaml=yaml)


@pytest.mark.parametrize("most", [1e-4, 2.4e-35])
def test_a_moment_of_inertia_that_is_negative_by_rounding_is_0(tmp_path, most):
    """Of a part that is fixed to a body, as in a description that a program has written."""
    rod = "".join(f' {key}="{value}"' for key, value in zip(
        INERTIA, (-2.4e-35, 0, 0, most, 0, most), strict=True))
    part = (f'<link name="rod"><inertial><mass value="0.1"/><inertia{rod}/></inertial></link>'
            '<joint name="rod" type="fixed"><parent link="torso"/><child link="rod"/></joint>'
            '</robot>')
    assert robot(tmp_path, URDF.replace("</robot>", part)).mass == pytest.approx(58.1)


def test_only_links_have_mass(tmp_path):
    """A block for Gazebo with 50 kg does not make the robot heavier."""
    block = '<gazebo><link name="x"><inertial><mass value="50"/></inertial></link></gazebo></robot>'
    assert robot(tmp_path, URDF.replace("</robot>", block)).mass == pytest.approx(58.0)


@pytest.mark.parametrize(("urdf", "doubt"), [
    (scaled(URDF, 57.3, "velocity"), "RLEG_JOINT0 202.899 rad/s (deg/s?)"),
    (put(URDF, velocity="1e9"), "RLEG_JOINT0 1e+09 rad/s (deg/s?)"),
    (scaled(URDF, 1e3, "effort"), "RLEG_JOINT0 86200 N m (N mm?)"),
    (edited("LLEG_LINK2", lambda t: t.replace(" 0.0779", " -0.0779")), "LLEG_LINK2 is not that of"),
])
def test_what_is_improbable_is_doubted(tmp_path, urdf, doubt):
    """Huge limits, and an inertia that was copied to the other leg without mirroring it."""
    assert doubt in robot(tmp_path, urdf).doubts[0]


def test_check_robot_prints_the_robot_and_ends_with_1_for_one_that_is_refused(tmp_path, capsys):
    """HRP-2 has 58 kg, its braced elbow is 1 m above the floor; nothing in it is doubted.

    The file that is named is the user's, also where readers get another one.
    """
    assert check_robot.main([]) == 0
    out = capsys.readouterr().out
    assert "58.00 kg in 37 links, 30 moving joints" in out
    assert "braced elbow 1.008 m above the floor" in out
    assert out.count("_JOINT") == 30
    assert "doubt: none" in out
    frame = edited("l_sole", lambda t: re.sub("<inertial>.*</inertial>", "", t, flags=re.S))
    assert robot(tmp_path, frame).urdf_path != tmp_path / "robot.urdf"  # it gets an inertia
    assert check_robot.main([str(tmp_path / "robot.yaml")]) == 0
    assert str(tmp_path / "robot.urdf") in capsys.readouterr().out
    with pytest.raises(RobotConfigError):
        robot(tmp_path, edited("torso", lambda t: put(t, ixx=-0.16048)))
    assert check_robot.main([str(tmp_path / "robot.yaml")]) == 1
    assert "torso" in capsys.readouterr().err
