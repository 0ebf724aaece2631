"""Whatever a neighbour, a busy computer or a network does: the robot stands, the hand is gentle."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from faults.plan import NAMED, draw

SEED, DRAWS = 22, 20


def judge(*arguments: str) -> None:
    """Run faults in a process of their own, which copies itself for each of them."""
    tests = str(Path(__file__).parent.parent)
    done = subprocess.run(
        [sys.executable, "-m", "faults", *arguments], capture_output=True, text=True, check=False,
        env={**os.environ, "PYTHONPATH": tests})
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.parametrize("number", [
    0, *(pytest.param(number, marks=pytest.mark.nightly("another run"))
         for number in range(1, len(NAMED)))])
def test_an_executor_that_was_held_up_and_a_late_command_do_not_throw_the_door(
        number: int) -> None:
    judge("--named", str(number))


@pytest.mark.nightly("twenty runs")
def test_the_robot_stands_and_the_hand_is_gentle_in_every_draw() -> None:
    """Each draw is one fault: of the executor, the driver, the commands or a topic."""
    judge("-n", str(DRAWS), "--seed", str(SEED))


def test_draws_cover_every_part_and_kind_and_are_those_of_their_seed() -> None:
    faults = draw(SEED, 600)
    assert faults == draw(SEED, 600)
    assert len({(fault.part, fault.kind) for fault in faults}) == 39
