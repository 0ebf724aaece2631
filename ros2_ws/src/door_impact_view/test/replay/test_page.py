"""The page of a replay: complete in itself, and with the data that was recorded."""

import base64
import json
import re
from dataclasses import replace

import numpy as np
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
from door_impact_view.scene.urdf import read_urdf

URDF = """<robot name="arm"><link name="base"/><link name="tip"><visual><geometry>
<box size="0.1 0.2 0.3"/></geometry></visual></link><joint name="hinge" type="revolute">
<parent link="base"/><child link="tip"/><origin xyz="0 0 1"/><axis xyz="0 0 1"/></joint></robot>"""
START = 1.7e9  # of a hardware's clock: seconds since 1970


@pytest.fixture
def replay():
    """An arm with one joint, a point, a polygon, and one plot."""
    stamps = START + np.arange(5) / 10.0
    base = np.tile([0.0, 0.0, 0.5, 1.0, 0.0, 0.0, 0.0], (5, 1))
    angle = np.linspace(0.0, 1.0, 5)[:, None]
    return Replay(
        stamps=stamps,
        trees=(Tree(read_urdf(URDF), ("hinge",), angle, base),),
        marks=(Mark("ZMP", (213, 94, 0), np.full((5, 3), np.nan)),
               Mark("support", (86, 180, 233), np.zeros((5, 4, 3)))),
        phases=(Phase("cam", START, START + 0.2),),
        events=(Event("contact", START + 0.2),),
        plots=(Plot("Angle", "rad", (Curve("arm", (0, 0, 0), stamps, angle[:, 0]),),
                    (Limit("desired", 0.5),)),),
    )


def page_of(text):
    """The data in a page, with the arrays decoded."""
    found = re.search(r'id="replay-data">(.*?)</script>', text, re.DOTALL)

    def decode(node):
        kind = next(iter(node), "")
        if kind in ("float32", "uint32"):
            return np.frombuffer(base64.b64decode(node[kind]), dtype=kind)
        return node

    return json.loads(found[1], object_hook=decode)


def test_the_page_refers_to_nothing_outside_itself(replay):
    """Neither the network nor another file is named; the policy forbids the browser both."""
    text = page("A replay", replay)
    assert "https://" not in text
    assert not re.search(r'(src|href)="(?!data:)', text)
    assert "default-src 'none'" in text
    assert "@@" not in text


def test_recorded_data_come_back(replay):
    """Angles, places, times and limits are in the page as they were recorded."""
    (data,) = page_of(page("A replay", replay))["runs"]
    (tree,), (zmp, support), (plot,) = data["trees"], data["marks"], data["plots"]
    np.testing.assert_allclose(data["stamps"], [0.0, 0.1, 0.2, 0.3, 0.4], atol=1e-6)
    np.testing.assert_allclose(tree["positions"], replay.trees[0].positions[:, 0], atol=1e-6)
    np.testing.assert_allclose(tree["base"].reshape(5, 7), replay.trees[0].base, atol=1e-6)
    assert [joint["column"] for joint in tree["joints"]] == [0]
    assert np.isnan(zmp["places"]).all()
    assert (zmp["corners"], support["corners"]) == (1, 4)
    np.testing.assert_allclose(plot["curves"][0]["values"], replay.plots[0].curves[0].values)
    assert plot["limits"][0]["value"] == 0.5
    assert data["events"] == [{"name": "contact", "time": pytest.approx(0.2, abs=1e-6)}]


def test_no_text_of_a_recording_becomes_html(replay):
    """Names and titles may contain any character."""
    evil = '</script><script>alert(1)</script>&"'
    text = page(evil, replace(replay, phases=(Phase(evil, START, START + 0.1),), notes=(evil,)))
    assert "alert(1)</script>" not in text
    assert page_of(text)["runs"][0]["phases"][0]["name"] == evil


def test_meshes_are_part_of_the_page_once(replay):
    """Several runs share the geometry, which is in the link's frame."""
    data = page_of(page("A replay", replay, replay))
    (mesh,) = data["meshes"]
    corners = mesh["vertices"].reshape(-1, 3)
    np.testing.assert_allclose(np.ptp(corners, axis=0), [0.1, 0.2, 0.3], atol=1e-6)
    assert mesh["faces"].max() < len(corners)
    for run in data["runs"]:
        assert [shape["mesh"] for shape in run["trees"][0]["shapes"]] == [0]
        assert run["notes"] == []


def test_the_run_that_is_shown_first_is_the_last_one_with_a_contact(replay):
    """A recording may end with a reset, after which nothing happens."""
    idle = replace(replay, events=(), name="idle")
    for runs, first in (((replay, idle), 0), ((idle, replay, idle), 1), ((idle, idle), 1)):
        data = page_of(page("Runs", *runs))
        assert data["first"] == first
        assert [run["name"] for run in data["runs"]] == [run.name for run in runs]
