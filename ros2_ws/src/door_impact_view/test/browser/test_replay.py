"""The replay in a real browser: Chromium opens the page from the disk, without network."""

import io

import numpy as np
import pinocchio as pin
import pytest
from door_impact_view.replay.page import page
from door_impact_view.replay.recording import (
    Camera,
    Curve,
    Event,
    Limit,
    Mark,
    Phase,
    Plot,
    Replay,
    Tree,
)
from door_impact_view.scene import meshes
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


@pytest.mark.parametrize("index", [0, 4, 8])
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


def test_a_click_in_a_plot_shows_its_time(opened):
    """The click's place on the time axis is the time, and the curve's value there is written."""
    area = opened.locator("#plots .u-over").first
    width = area.bounding_box()["width"]
    area.click(position={"x": round(0.75 * width), "y": 20})
    assert opened.evaluate("replay.now") == pytest.approx(3.0, abs=4.0 / width)
    value = opened.locator("#plots output").first.inner_text()
    assert float(value) == pytest.approx(9.0, abs=0.2)


def test_keys_step_and_play(opened):
    """The arrow keys step, C goes to the contact, space plays slowly there and stops."""
    opened.evaluate("replay.seek(1)")
    for key in ("ArrowRight", "ArrowRight", "Shift+ArrowLeft"):
        opened.keyboard.press(key)
    assert opened.evaluate("replay.now") == pytest.approx(1.199, abs=1e-6)
    opened.keyboard.press("c")
    assert opened.evaluate("replay.now") == pytest.approx(CONTACT, abs=1e-6)
    assert "contact + 0.000 s" in opened.locator("#phase").inner_text()
    assert opened.evaluate("replay.speed()") == pytest.approx(0.02)
    opened.keyboard.press(" ")
    wait(opened, f"replay.now > {CONTACT}")
    opened.keyboard.press(" ")
    assert not opened.evaluate("replay.playing")
    assert opened.evaluate("replay.now") < 4.0


def test_phases_and_views_are_chosen(opened):
    """A click on a phase shows its start; another view draws another picture."""
    opened.locator("#phases button", has_text="post").click()
    assert opened.evaluate("replay.now") == pytest.approx(CONTACT, abs=1e-6)
    before = picture(opened)
    opened.locator("#camera").select_option(label="front")
    assert (np.abs(picture(opened) - before).max(axis=2) > 30).mean() > 0.01


def test_a_mark_can_be_hidden(opened):
    """The box beside a mark's name takes it away and brings it back."""
    opened.evaluate("replay.seek(1)")
    box = opened.locator("#marks input").nth(1)
    with_mark = picture(opened)
    box.uncheck()
    assert np.abs(picture(opened) - with_mark).max() > 8
    box.check()
    assert np.abs(picture(opened) - with_mark).max() <= 8


def test_a_phone_shows_everything_in_its_width(opened):
    """Nothing is wider than 390 pixels."""
    opened.set_viewport_size({"width": 390, "height": 800})
    wait(opened, "document.querySelector('#view canvas').clientWidth < 390")
    assert opened.evaluate("document.documentElement.scrollWidth") <= 390
    opened.set_viewport_size({"width": 1000, "height": 600})


MESHED = """<robot name="m"><link name="base"><visual><geometry>
<mesh filename="package://arm/hand.stl" scale="1 -1 1"/></geometry>
<material name="red"><color rgba="0.9 0.1 0.1 1"/></material></visual></link></robot>"""


def standing(name, x):
    """A triangle of a mesh, which stands upright at a place."""
    base = np.array([[x, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]])
    return Replay(np.array([0.0, 1.0]), (Tree(read_urdf(MESHED), (), np.zeros((1, 0)), base),),
                  cameras=(Camera("front", (3.0, 0.0, 0.5), (0.0, 0.0, 0.5)),),
                  notes=(f"This is {name}.",), name=name)


def test_meshes_are_drawn_and_each_run_can_be_chosen(open_tab, tmp_path, monkeypatch):
    """The mesh appears in its colour, mirrored as its scale says; the other run is where it is."""
    corners = np.array([[0, 0, 0], [0, 1, 0], [0, 0, 1]], dtype=np.float32)
    monkeypatch.setattr(meshes, "load_mesh",
                        lambda _: (corners, np.array([[0, 1, 2]], dtype=np.uint32)))
    path = tmp_path / "runs.html"
    path.write_text(page("Runs", standing("one", 0.0), standing("two", -40.0)), encoding="utf-8")
    tab = open_tab(path.as_uri(), offline=True)

    def red():
        shown = picture(tab)
        return np.argwhere((shown[..., 0] > 100) & (shown[..., 1] < 80) & (shown[..., 2] < 80))

    tab.locator("#notes li", has_text="This is two.").wait_for()
    far = red()
    tab.locator("#run").select_option(label="one")
    tab.locator("#notes li", has_text="This is one.").wait_for()
    wait(tab, "window.replay !== undefined")
    near = red()
    assert len(near) > 50 * max(1, len(far))
    # Seen from the front y grows to the right; the mirrored triangle lies on the left.
    assert (near[:, 1] <= picture(tab).shape[1] / 2 + 2).all()


def test_without_webgl_the_plots_remain(browser, tmp_path):
    """A sentence stands in the view's place; slider and plots work."""
    path = tmp_path / "replay.html"
    path.write_text(page("Replay", recording()), encoding="utf-8")
    tab = browser.new_page(viewport={"width": 1000, "height": 600})
    tab.set_default_timeout(GUARD)
    tab.add_init_script("HTMLCanvasElement.prototype.getContext = ((old) => function (kind, ...a) {"
                        "return kind.startsWith('webgl') ? null : old.call(this, kind, ...a); })"
                        "(HTMLCanvasElement.prototype.getContext)")
    tab.goto(path.as_uri())
    wait(tab, "window.replay !== undefined")
    assert "does not draw WebGL" in tab.locator("#view").inner_text()
    tab.locator("#time").fill("3")
    assert float(tab.locator("#plots output").first.inner_text()) == pytest.approx(9.0, abs=0.01)
    tab.close()
