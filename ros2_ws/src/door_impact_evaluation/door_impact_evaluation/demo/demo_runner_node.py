"""Node ``demo_runner``: run the demonstration with nodes that run already."""

import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import rclpy
from door_impact_common.errors import DoorImpactError
from door_impact_common.files import make_folder
from door_impact_common.parameters import Parameters
from door_impact_msgs.msg import ImpactPlan
from door_model.door.config import load_door
from impact_planner.task.settings import ENDINGS, RUN_UPS
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from walking.passing.opening import PUSH

from door_impact_evaluation.demo.demo_client import DemoClient, report_progress, wall_time
from door_impact_evaluation.demo.settings import PASS, STANDS, DemoSettings
from door_impact_evaluation.errors import DemoError
from door_impact_evaluation.report.table import OPENED

PARAMETERS = {
    "door": ("paper", "simulated door: name of a door in door_model/doors, or a YAML file"),
    "target_deg": (25.0, "desired opening angle [deg]"),
    "ending": ("hold", f"what follows the door's peak: {' or '.join(ENDINGS)}"),
    "run_up": ("mcv50", f"profile of the run-up: {' or '.join(RUN_UPS)}"),
    "hits": (1, "number of hits; the results are those of the last one"),
    "out_dir": ("out/demo", "folder of the results"),
}
"""Default and description of each parameter of the node demo_runner."""


def run(
    settings: DemoSettings,
    nodes_alive: Callable[[], bool] = lambda: True,
    stop_nodes: Callable[[], None] = lambda: None,
) -> None:
    """Run the demonstration with nodes that were started by others, and writes the results.

    Args:
        settings: What to do.
        nodes_alive: Reports whether the launcher of the nodes still runs.
        stop_nodes: Is called when they are not needed any more.

    Raises:
        DemoError: Something failed; the message says what. The results of a motion that failed
            are written nevertheless.
    """
    # Imported here: matplotlib, Pinocchio and PyBullet load while the nodes start.
    from door_impact_evaluation.demo import results

    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    try:
        node = DemoClient(nodes_alive)
        report_progress("waiting for the nodes")
        node.wait_for_graph()
        began, simulated = time.perf_counter(), -node.now()
        report_progress("pushing the door by hand")
        node.push_by_hand()
        report_progress("identifying the closer")
        parameters = node.identify()
        samples = tuple(node.samples)  # of the pushes alone: the hit is still to come
        for number in range(1, settings.hits + 1):
            if number > 1:
                report_progress("back to the start, to hit the door again")
                simulated += node.now()
                node.start_again()
                simulated -= node.now()
            passes = settings.ending == PASS and number == settings.hits
            plan, planning_ms, outcome = _hit(node, settings, passes=passes)
            if not outcome.success:
                break
        real_time_factor = (simulated + node.now()) / (time.perf_counter() - began)
        end = node.now()
        node.save_log()
        stop_nodes()
        report_progress("drawing the figures, the animation and the replay")
        try:
            results.write(results.Received(
                door=settings.door, target_deg=settings.target_deg, parameters=parameters,
                plan=plan, outcome=outcome, planning_ms=planning_ms,
                real_time_factor=real_time_factor, wall_s=wall_time(),
                door_angle=np.array(node.door), zmp=np.array(node.zmp), samples=samples,
                phases=node.phases, end=end, passes=passes), settings.out)
        except OSError as error:
            raise DemoError(f"the results cannot be written: {error.strerror or error}") from error
        except DemoError as error:
            if outcome.success:
                raise
            raise DemoError(f"{error}: {outcome.message}") from error
    finally:
        rclpy.try_shutdown()
    if not outcome.success:
        raise DemoError(f"the motion failed: {outcome.message}; see report.html and nodes.log")


def _hit(
    node: DemoClient, settings: DemoSettings, *, passes: bool
) -> tuple[ImpactPlan | None, float, Any]:
    """Plan and execute one hit, which a passage may follow, or which it may push instead.

    Returns:
        The plan (None if the door was pushed), the wall time of planning [ms], and the result of
        the action.
    """
    target = float(np.radians(settings.target_deg))
    ending = "hold" if settings.ending == PASS and not passes else settings.ending
    report_progress(f"planning the hit for {settings.target_deg:g} deg")
    plan, planning_ms = node.make_plan(target, ending, settings.run_up)
    for warning in plan.warnings:
        report_progress(f"    note: {warning}")
    if plan.learned_hits:
        report_progress(f"    learned: restitution {plan.restitution:.3f}, effective mass "
                        f"{plan.effective_mass:.1f} kg, {plan.effective_mass_model:.1f} kg by the "
                        "model")
    report_progress("walking through the door" if passes else "hitting the door")
    if passes:  # the passage has the hit planned anew
        outcome = node.walk_through(target, settings.run_up)
        node.pause(STANDS)
        report_progress(f"    {outcome.plan.opening_reason}")
        if outcome.plan.opening == PUSH:
            report_progress(f"    {outcome.message}")
            return None, planning_ms, outcome
        plan = node.plan or plan
    else:
        outcome = node.execute(plan.plan_id)
    peak = np.degrees(outcome.peak_angle)  # NaN without a hit
    opened = f"{peak:.1f} deg by the encoder; " if peak > OPENED else ""
    report_progress(f"    {opened}{outcome.message}")
    return plan, planning_ms, outcome


def settings_of(node: Node) -> DemoSettings:
    """Declare and read the parameters of the node demo_runner.

    Args:
        node: The node.

    Raises:
        SettingError: A parameter is out of its range; the error names it.
        ConfigError: There is no such door, or its file may not be read.
    """
    parameters = Parameters(node, PARAMETERS)
    load_door(parameters.text("door"))
    return DemoSettings(
        door=parameters.text("door"),
        target_deg=parameters.number("target_deg"),
        ending=parameters.choice("ending", ENDINGS),
        run_up=parameters.choice("run_up", RUN_UPS),
        hits=parameters.whole("hits", low=1),
        out=Path(parameters.text("out_dir")),
    )


def _settings_from_parameters(args: list[str] | None) -> DemoSettings:
    rclpy.init(args=args)
    try:
        node = Node("demo_runner")
        try:
            return settings_of(node)
        finally:
            node.destroy_node()
    finally:
        rclpy.shutdown()


def main(args: list[str] | None = None) -> int:
    """Run the node of demo.launch.yaml; its parameters are those of `PARAMETERS`.

    Args:
        args: Command line with ROS arguments; None means the process's own.

    Returns:
        0 if the door was opened, 1 if something failed, 130 after Ctrl-C.
    """
    try:
        settings = _settings_from_parameters(args)
        make_folder(settings.out)
        run(settings)
    except DoorImpactError as error:
        print(f"demo: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return 130
    print(f"See {settings.out / 'report.html'} for the replay and the figures.", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
