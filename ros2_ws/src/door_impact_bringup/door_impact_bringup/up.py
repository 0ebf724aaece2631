"""Command ``up``: start every node until Ctrl-C, and say when they run."""

from __future__ import annotations

import argparse
import signal
import socket
import subprocess
import sys
from contextlib import closing, suppress
from http.client import HTTPConnection, HTTPException

import rclpy
from door_impact_common.errors import DoorImpactError
from door_impact_common.node import executor_of, spin_for
from door_model.door.config import load_door
from geometry_msgs.msg import PointStamped
from hrp2_description.robot import load_robot_config
from humanoid_motion.robot_model import RobotModel
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

from door_impact_bringup.graph import NODES, launch_command, parameters_for, refuse_running_graph

SERVERS = ("identify_closer", "forget_hits", "plan_door_passage",
           "walk_through_door/_action/send_goal")
"""The last services that the nodes serve when they start."""
_HOST, _PORTS = "127.0.0.1", range(8080, 8180)


def _free_port() -> int:
    """Return the first port at which a page can be served; 0 if there is none."""
    for port in _PORTS:
        with socket.socket() as probe, suppress(OSError):
            probe.bind((_HOST, port))
            return port
    return 0


def _runs(launcher: subprocess.Popen[bytes], port: int, namespace: str) -> bool:
    """Wait until all nodes, and the page at a port, serve; return False if the launcher ends."""
    rclpy.init(args=[], signal_handler_options=SignalHandlerOptions.NO)
    node, zmp = Node("up", namespace=namespace), list[PointStamped]()
    node.create_subscription(PointStamped, "zmp", zmp.append, 1)
    with executor_of(node) as executor:
        while launcher.poll() is None:
            spin_for(executor, 0.5)
            served = {name for name, _ in node.get_service_names_and_types()}
            if zmp and served.issuperset(map(node.resolve_service_name, SERVERS)) and (
                    not port or answers(port)):
                break
    rclpy.shutdown()
    return launcher.poll() is None


def answers(port: int) -> bool:
    """Return whether a page is served at a port; without a request viser logs a traceback."""
    page = HTTPConnection(_HOST, port, timeout=5.0)
    with closing(page), suppress(OSError, HTTPException):
        page.request("GET", "/")
        return bool(page.getresponse().read())
    return False


def main(args: list[str] | None = None) -> int:
    """Start the nodes; return the exit code of the launcher, or 1 if they cannot be started."""
    parser = argparse.ArgumentParser(prog="up", description=__doc__)
    parser.add_argument("--door", default="paper", help="name or YAML file of a door")
    parser.add_argument("--params", default="", help="parameter file that every node reads")
    parser.add_argument("--robot", default="", help="robot.yaml of another robot, for every node")
    parser.add_argument("--experience", default="", help="file that keeps what hits teach")
    parser.add_argument("--view", choices=("0", "1"), default="1", help="1 serves a page")
    parser.add_argument("arguments", nargs="*", metavar="name:=value",
                        help="further arguments of bringup.launch.yaml")
    options = parser.parse_args(args)
    port = _free_port() if options.view == "1" else 0
    given = {"door": options.door, "robot_config": options.robot,
             "experience": options.experience, "view": options.view, "view_port": str(port or "")}
    try:  # what each node would refuse is refused once
        load_door(options.door)
        robot = RobotModel(load_robot_config(options.robot or None))
        given["params"] = parameters_for(robot, options.params)
        refuse_running_graph()
        command = launch_command()
    except DoorImpactError as error:
        print(f"up: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 130
    launcher = subprocess.Popen(
        [*command, *(f"{name}:={value}" for name, value in given.items() if value),
         *options.arguments])
    signal.signal(signal.SIGTERM, lambda number, _: launcher.send_signal(number))
    signal.signal(signal.SIGINT, lambda *_: None)  # the terminal sends it to the launcher, too
    named = dict(word.partition(":=")[::2] for word in options.arguments)
    if _runs(launcher, port, named.get("namespace", "")):
        page = f"page: http://localhost:{port}. " if port else ""
        kept = (f"What hits teach stays in {options.experience} for the next start, and for every "
                "graph started here (`/forget_hits` discards it). " if options.experience else "")
        print(f"ready: {', '.join(NODES)} run, door {options.door}. {page}{kept}Ctrl-C ends all.",
              flush=True)
    return launcher.wait()


if __name__ == "__main__":
    sys.exit(main())
