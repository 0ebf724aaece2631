"""Whatever a neighbour, a busy computer or a network does: the robot stands, the hand is gentle."""

import pytest

from faults.plan import COMMANDS, Fault, draw
from faults.rig import Rig
from faults.verdict import wrong

SEED, DRAWS = 22, 20


@pytest.fixture(scope="module")
def rig(tmp_path_factory: pytest.TempPathFactory) -> Rig:
    return Rig(tmp_path_factory.mktemp("faults"))


NAMED = [
    Fault("executor", "stopped", -0.05, 3.0, 0.0, 0),
    pytest.param(Fault(COMMANDS, "delayed", 0.9, 1.5, 0.9, 0),
                 marks=pytest.mark.nightly("another run")),
]


@pytest.mark.parametrize("fault", NAMED, ids=str)
def test_an_executor_that_was_held_up_and_a_late_command_do_not_throw_the_door(
        rig: Rig, fault: Fault) -> None:
    verdict = rig.verdict(fault)
    assert not wrong(fault, verdict), str(verdict)


@pytest.mark.nightly("twenty runs")
def test_the_robot_stands_and_the_hand_is_gentle_in_every_draw(
        tmp_path_factory: pytest.TempPathFactory) -> None:
    """Each draw is one fault: of the executor, the driver, the commands or a topic."""
    rig = Rig(tmp_path_factory.mktemp("draws"))
    for fault in draw(SEED, DRAWS):
        verdict = rig.verdict(fault)
        assert not wrong(fault, verdict), str(verdict)


def test_draws_cover_every_part_and_kind_and_are_those_of_their_seed() -> None:
    faults = draw(SEED, 600)
    assert faults == draw(SEED, 600)
    assert len({(fault.part, fault.kind) for fault in faults}) == 39
