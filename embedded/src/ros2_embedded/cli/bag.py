"""`ros2 bag`: record, info."""

from __future__ import annotations

import argparse

from ros2_embedded.cli import bag_info, bag_record
from ros2_embedded.cli.common import Verb, define_verbs


def define(parser: argparse.ArgumentParser) -> None:
    """Adds the verbs of `ros2 bag`."""
    verbs = {
        "info": Verb(
            "Print information about a bag to the screen", bag_info.define, bag_info.info
        ),
        "record": Verb("Record ROS data to a bag", bag_record.define, bag_record.record),
    }  # fmt: skip
    define_verbs(parser, verbs)
