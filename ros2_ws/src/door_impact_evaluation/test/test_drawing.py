"""The pictures of the identified door show the door that was identified, whatever its closer."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from door_impact_evaluation.demo.results import draw_door
from door_impact_evaluation.report import figures
from door_impact_msgs.msg import CloserParameters, EncoderSamples
from door_model.door.config import DoorConfig, load_door
from door_model.door.door import Zone
from door_model.recording.synthetic import synthetic_recording

PEAKS = np.radians([12.0, 20.0, 30.0]).tolist()  # of the pushes by hand [rad]


def mirrored_door() -> DoorConfig:
    """A door with a mirrored linkage, friction, backcheck and latch within its swings."""
    paper = load_door("paper")
    return replace(
        paper, linkage=replace(paper.linkage, assembly=-1.0), tau_c0_prime=-14.0,
        c_c_closing=0.3, backcheck=Zone(np.radians(15.0), 0.5), latch=Zone(np.radians(5.0), 0.6),
        friction=0.4)


def message(config: DoorConfig) -> CloserParameters:
    """The door as closer_identifier publishes it."""
    door, link = config.door(), config.linkage
    return CloserParameters(
        door=config.name, i_a=door.i_a, c_c=door.c_c, k_c=door.k_c, tau_c0_prime=door.tau_c0_prime,
        c_c_closing=door.c_c_closing, friction=door.friction,
        backcheck_angle=door.backcheck.angle, backcheck_c_c=door.backcheck.c_c,
        latch_angle=door.latch.angle, latch_c_c=door.latch.c_c,
        link_l=link.l, link_l1=link.l1, link_l2=link.l2, link_l3=link.l3, theta_i0=link.theta_i0,
        assembly=link.assembly, leaf_mass=config.leaf.mass, leaf_width=config.leaf.width)


@pytest.fixture(scope="module")
def drawn(tmp_path_factory: pytest.TempPathFactory) -> dict[str, list[Any]]:
    """The lines of each picture of the mirrored door, by the name of its file."""
    folder = tmp_path_factory.mktemp("drawn")
    lines: dict[str, list[Any]] = {}
    keep = figures._save

    def save(figure: Any, path: Path) -> None:
        lines[path.name] = [line.get_xydata() for line in figure.axes[0].lines]
        keep(figure, path)

    config = mirrored_door()
    recording = synthetic_recording(config.door(), PEAKS)
    counts = np.round(recording.theta / recording.resolution).astype(int)
    samples = EncoderSamples(period=1e-3, counts_per_turn=14400, counts=counts.tolist())
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(figures, "_save", save)
        draw_door(message(config), [samples], config, folder)
    return lines


def test_the_identified_torque_lies_on_the_simulated_doors(drawn: dict[str, list[Any]]) -> None:
    """Both lines show the same door, whose closer pulls it shut at every angle of the pushes."""
    simulated, identified = drawn["restoring_torque.png"]
    np.testing.assert_allclose(identified, simulated, atol=1e-9)
    assert (identified[identified[:, 0] < 35.0, 1] > 0.0).all()


def test_the_fit_follows_swings_with_friction_and_a_backcheck(drawn: dict[str, list[Any]]) -> None:
    """Within three counts of the encoder at every sample: eq. (1) has all that damps the door."""
    lines = drawn["identification.png"]
    assert len(lines) == 2 * len(PEAKS)
    for measured, fitted in zip(lines[::2], lines[1::2], strict=True):
        np.testing.assert_allclose(fitted, measured, atol=3.0 * 360.0 / 14400)
