"""`ros2 bag`: record, info."""

from __future__ import annotations

import argparse

from ros2_embedded.cli import bag_info, bag_record
from ros2_embedded.cli.common import Verb, define_verbs

_VERBS = {
    "info": Verb("Print information about a bag to the screen", bag_info.info, *bag_info.OPTIONS),
    "record": Verb("Record ROS data to a bag", bag_record.record, *bag_record.OPTIONS),
}


def define(parser: argparse.ArgumentParser) -> None:
    """Adds the verbs of `ros2 bag`."""
    define_verbs(parser, _VERBS)
