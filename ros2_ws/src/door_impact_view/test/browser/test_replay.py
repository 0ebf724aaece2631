"""The replay in a real browser: Chromium opens the page from the disk, without network."""

import io

import numpy as np
import pinocchio as pin
import pytest
from door_impact_view.replay.page import page
from door_impact_view.replay.recording import (
    Curve,
    Event,
    Limit,
    Mark,
    Phase,
    Plot,
    Replay,
    Tree,
)
from door_impact_view.scene.urdf import TURNING, read_urdf
from hrp2_description.data import data_path
from PIL import Image

pytestmark = pytest.mark.nightly("starts a browser, which takes seconds and much memory")

GUARD = 180e3  # longest wait for the browser [ms]
URDF = data_path("urdf/hrp2.urdf")
STAMPS = np.linspace(0.0, 4.0, 9)
CONTACT = 2.0


def recording():
    """HRP-2 at random angles and places at every stamp, with a mark, phases and a plot."""
    scene = read_urdf(URDF.read_text(encoding="utf-8"))
    joints = tuple(joint.name for joint in scene.joints if joint.kind in TURNING)
    random = np.random.default_rng(3)
    turns = random.normal(size=(9, 4))
    turns /= np.linalg.norm(turns, axis=1, keepdims=True)
    base = np.hstack([random.uniform(-0.5, 0.5, (9, 3)) + [0.0, 0.0, 0.8], turns])
    positions = random.uniform(-1.0, 1.0, (9, len(joints)))
    return Replay(
        STAMPS, (Tree(scene, joints, positions, base),),
        (Mark("ZMP", (213, 94, 0), np.zeros((9, 3))),
         Mark("support polygon", (86, 180, 233), np.random.default_rng(1).normal(size=(9, 4, 3)))),
        (Phase("cam", 0.0, CONTACT), Phase("post", CONTACT, 4.0)),
        (Event("contact", CONTACT),),
        (Plot("Angle", "deg", (Curve("door", (0, 114, 178), STAMPS, STAMPS**2),
                               Curve("plan", (213, 94, 0), STAMPS[::2], STAMPS[::2], dashed=True)),
              (Limit("desired", 12.0),)),))


@pytest.fixture(scope="module")
def opened(open_tab, tmp_path_factory):
    """The page, opened from a file, offline; in the end it has asked for nothing else."""
    path = tmp_path_factory.mktemp("replay") / "replay.html"
    path.write_text(page("Replay", recording()), encoding="utf-8")
    requests = []
    tab = open_tab(path.as_uri(), offline=True)
    tab.on("request", lambda request: requests.append(request.url))
    tab.reload()
    wait(tab, "window.replay !== undefined")
    yield tab
    assert requests
    assert [url for url in requests if not url.startswith(("file:", "data:"))] == []


def wait(tab, condition):
    """Waits until an expression is true; the page's policy forbids playwright's own way, eval."""
    for _ in range(int(GUARD / 50.0)):
        if tab.evaluate(condition):
            return
        tab.wait_for_timeout(50.0)
    pytest.fail(f"never true: {condition}")


def picture(tab):
    """The pixels of the three-dimensional view."""
    data = tab.locator("#view canvas").screenshot()
    return np.asarray(Image.open(io.BytesIO(data)).convert("RGB")).astype(int)


def test_the_slider_moves_the_robot(opened):
    """Another time has another picture, and the same time the same one."""
    slider = opened.locator("#time")
    slider.fill("1")
    first = picture(opened)
    assert len(np.unique(first.reshape(-1, 3), axis=0)) > 20  # a robot is drawn, no flat ground
    slider.fill("3")
    assert (np.abs(picture(opened) - first).max(axis=2) > 30).mean() > 0.01
    assert opened.locator("#clock").inner_text() == "3.000 s"
    slider.fill("1")
    assert np.abs(picture(opened) - first).max() <= 8


@pytest.mark.parametrize("index", [0, 8])
def test_every_link_is_where_pinocchio_says(opened, index):
    """The forward kinematics of the page are those of the URDF: 0.1 mm, 0.1 mrad."""
    tree = recording().trees[0]
    model = pin.buildModelFromUrdf(str(URDF), pin.JointModelFreeFlyer())
    q = pin.neutral(model)
    place, (w, x, y, z) = tree.base[index, :3], tree.base[index, 3:]
    q[:7] = [*place, x, y, z, w]
    for name, angle in zip(tree.joints, tree.positions[index], strict=True):
        q[model.joints[model.getJointId(name)].idx_q] = angle
    data = model.createData()
    pin.framesForwardKinematics(model, data, q)
    opened.evaluate(f"replay.seek({STAMPS[index]})")
    links = list(tree.scene.links)
    found = opened.evaluate(
        "(links) => links.map((link) => replay.linkPose(0, link))", links)
    for link, pose in zip(links, found, strict=True):
        true = data.oMf[model.getFrameId(link)]
        np.testing.assert_allclose(pose["place"], true.translation, atol=1e-4, err_msg=link)
        w, x, y, z = pose["orientation"]
        turned = pin.Quaternion(w, x, y, z).matrix().T @ true.rotation
        assert np.linalg.norm(pin.log3(turned)) < 1e-4, link


def test_a_phone_with_dark_mode_gets_a_dark_page_of_its_width(open_tab, tmp_path):
    """Nothing sticks out at the right; the text is light."""
    path = tmp_path / "replay.html"
    path.write_text(page("Replay", recording()), encoding="utf-8")
    tab = open_tab(path.as_uri(), (390, 844), offline=True, color_scheme="dark")
    wait(tab, "window.replay !== undefined")
    assert tab.evaluate("document.documentElement.scrollWidth") == 390
    ground, text = (tab.evaluate(f"getComputedStyle(document.body).{name}").strip("rgb()")
                    for name in ("backgroundColor", "color"))
    assert max(map(int, ground.split(","))) < 60 < 180 < min(map(int, text.split(",")))
