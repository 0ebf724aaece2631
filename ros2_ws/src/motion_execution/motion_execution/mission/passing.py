"""Through the door: walk up, open it, catch the leaf, walk through while the hand holds it."""

from __future__ import annotations

import math
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np
from door_impact_common.errors import DoorImpactError
from robot_driver.motion import Motion, Outcome
from robot_driver.names import DOOR, HAND
from walking.errors import (
    HitNotPlanned,
    InvalidGoal,
    NoDoor,
    NotReached,
    NotReady,
    PassageInfeasible,
    Stopped,
)
from walking.footsteps.footstep import Pose, as_array
from walking.passing.approach import (
    NEAR,
    SURVEYED,
    Site,
    arrived,
    require_arrived,
    require_way,
    within,
)
from walking.passing.held import Hold
from walking.passing.opening import Push
from walking.passing.passage import PassagePlan
from walking.passing.passage_task import PassageTask
from walking.passing.settings import PassageSettings

from motion_execution.hit.execution import Execution
from motion_execution.mission.body import PATIENCE, STANDING, Body
from motion_execution.mission.door_place import DoorPlace
from motion_execution.mission.errors import MotionFailed
from motion_execution.mission.hits import Hits
from motion_execution.mission.link import Link
from motion_execution.mission.order import Order
from motion_execution.mission.walks import Walks
from motion_execution.mission.ways import Wanted, Way, Ways
from motion_execution.walk.goal import WalkGoal
from motion_execution.walk.passage import Passage
from motion_execution.walk.reaching import Reaching
from motion_execution.walk.start import require_near
from motion_execution.walk.walk import Walk

TOPICS = (*STANDING, DOOR, HAND)
CAUGHT = ("post", "hold", "retreat")
"""Phases of the hit in which the hand catches the leaf."""
COMES_TO_REST = 1.0  # longest time in which the hand comes to rest on the leaf [s]
AFTER_WALK = 1.0  # time in which a robot on rubber soles comes to rest after a walk [s]
_NARROWEST, _WIDEST = math.radians(1.0), math.radians(100.0)  # angles that may be asked for [rad]


@dataclass
class Passed:
    """What has become of a passage, as far as it has come.

    Attributes:
        began: When the planning of its first motion began, by the robot's clock [s].
        way: The last way that was planned.
        hit: The hit that opened the door; None if there was none.
        passage: The passage itself; None if it has not begun.
        message: What has happened, for users; empty before the end.
    """

    began: float = math.nan
    way: Way | None = None
    hit: Execution | None = None
    passage: Passage | None = None
    message: str = ""

    @property
    def contact_time(self) -> float:
        """Begin of the hit's contact on the robot's clock [s]; NaN without one."""
        return math.nan if self.hit is None else self.hit.measured.contact_time


@dataclass(frozen=True)
class PassageProgress:
    """How far a passage has come; the names are those of the action's feedback."""

    phase: str
    hit_phase: str
    leaf_angle: float
    hand_force: float
    zmp_margin: float
    clearance: float
    step: int = 0
    steps: int = 0


class Passing:
    """Leads the robot through the door.

    Args:
        body: The robot.
        link: Messages and plans.
        ways: Plans ways through the door.
        hits: Executes hits.
        walks: Executes walks.
        settings: Settings of the passage.
        place: Where the door stands.
    """

    def __init__(
        self, body: Body, link: Link, ways: Ways, hits: Hits, walks: Walks,
        settings: PassageSettings, place: DoorPlace,
    ) -> None:
        self._body, self._link, self._ways = body, link, ways
        self._hits, self._walks = hits, walks
        self._settings, self._place = settings, place
        self._left: Way | None = None  # on which a passage has ended with the hand on the leaf
        self._yields = False  # whether the right hand was told to yield
        self._way: Way | None = None  # of the order under way

    # -- orders ---------------------------------------------------------------------------------

    async def go(self, wanted: Wanted, order: Order, passed: Passed) -> None:
        """Go through the door.

        Args:
            passed: Gets what becomes of it; its `passage` has ended then, or it was a dry run.

        Raises:
            DoorImpactError: It cannot be done, or was taken back between two motions.
        """
        self._way = None
        try:
            await self._ready(wanted, order)
            if self._settings.yields:
                await self._require_compliance(order)
            order.tell(self.progress(order))
            passed.began, way = self._link.now(), await self._held(wanted, order)
            if way is None:
                way = await self._open(wanted, order, passed)
            passed.way = way
            if wanted.dry_run:
                first = f"{way.opening.way} and " if way.opening.way else ""
                passed.message = (
                    f"this was a dry run: {first}passage could be made, in "
                    f"{way.passage.clear:.1f} s and {len(way.passage.walk.footsteps)} footsteps")
                return
            self._way = way
            passage = Passage(self._body.model, way.passage, yields=self._settings.yields)
            await self._begin(way, passage, order)
            passed.passage = passage
            await self._body.ended(order)
            self._link.show(())
            self._ended(way, passage, passed)
        finally:
            self._comply(yields=False)

    async def plan(self, wanted: Wanted, order: Order) -> Way:
        """Plan a passage from the leaf that the robot holds, otherwise a way through the door.

        Raises:
            DoorImpactError: There is none.
        """
        await self._ready(wanted, order)
        return (await self._held(wanted, order)
                or await self._ways.plan(wanted, self._place.site(), order))

    def yield_hand(self, motion: Motion, now: float) -> None:
        """Let the right hand yield, or make it stiff, as a motion wants it at a time [s]."""
        if isinstance(motion, Passage | Reaching):
            self._comply(yields=motion.yields_at(now))

    def progress(self, order: Order) -> PassageProgress:
        """Return how far an order has come."""
        body, way, motion, soles = self._body, self._way, order.motion, self._body.soles()
        now, phase, hit_phase = self._link.now(), "plan", ""
        margin = clearance = math.nan
        step = steps = 0
        if isinstance(motion, Execution):
            phase, hit_phase = "catch" if motion.phase in CAUGHT else "hit", motion.phase
            margin = self._hits.margin(motion)
        elif isinstance(motion, Passage | Reaching):
            phase, margin = motion.stage(now), body.walk_margin(motion, now)
            step, steps = min(motion.steps, motion.steps_made(now) + 1), motion.steps
            if soles is not None and way is not None:
                rectangle, hold = self._settings.body, way.hold
                place = as_array(soles.middle.seen_from(hold.axes))[None]
                clearance = float(min(
                    hold.doorway.wall_gaps(rectangle, place)[0], hold.doorway.leaf_gaps(
                        rectangle, place, np.array([body.inputs.door_angle]))[0]))
        elif isinstance(motion, Walk):
            phase, margin = "approach", body.walk_margin(motion, now)
        return PassageProgress(
            phase, hit_phase, body.inputs.door_angle, body.inputs.hand_force, margin, clearance,
            step, steps)

    # -- the way to the leaf --------------------------------------------------------------------

    async def _ready(self, wanted: Wanted, order: Order) -> None:
        for name in ("hit_angle", "leaf_angle"):
            value = getattr(wanted, name)
            if not (value < 0.0 or _NARROWEST <= value <= _WIDEST):
                raise InvalidGoal(quantity=f"{name} [rad]", value=value,
                                  limit=f"{_NARROWEST:.3f} to {_WIDEST:.3f}, or negative")
        survey = self._place.survey
        if not np.isfinite(survey).all():
            raise NotReady(quantity="place of the door (door_distance, hinge_x) [m]",
                           value=tuple(survey[:2]),
                           limit="given as door_impact_bringup/config/params.yaml does")
        await self._body.wait(lambda: self._body.heard(TOPICS), PATIENCE, order)
        self._body.standing(TOPICS)  # refuses missing messages before anything is planned

    async def _require_compliance(self, order: Order) -> None:
        await self._body.wait(lambda: self._link.yields, PATIENCE, order)
        if not self._link.yields:
            raise NotReady(
                "no driver takes /hand_compliance, and a stiff hand would press on the leaf as "
                "far as it should yield: set hand_stiffness to 0", quantity="/hand_compliance")

    async def _held(self, wanted: Wanted, order: Order) -> Way | None:
        """Plan the way from the leaf that the robot holds; None: it holds none.

        It holds the leaf after a hit, or after a passage that was stopped on the way.
        """
        if wanted.hit_angle >= 0.0 or wanted.opening:
            return None
        left, last = self._left, self._link.last_hit
        held: list[tuple[str, Hold, PassagePlan | None]] = [] if left is None else [
            (left.door, left.hold, left.passage)]
        if last is not None:
            with suppress(HitNotPlanned, NoDoor):
                held.append((last.door, self._ways.hold(last), None))
        for door, hold, before in held:
            with suppress(NotReady):
                task = self._found(hold)
                return Way(door, hold, await self._ways.passage(task, wanted, order, before))
        return None

    async def _open(self, wanted: Wanted, order: Order, passed: Passed) -> Way:
        """Open the door, and return the way from there; errors as of `go`."""
        planned = self._place.site()
        self._require_reachable(planned, walk_up=wanted.walk_up)
        way = await self._ways.plan(wanted, planned, order)
        site = await self._arrive(planned, way.ahead, wanted, order)
        if site != planned:
            order.tell(self.progress(order))
            way = await self._ways.plan(wanted, site, order)
        self._link.say(way.opening.reason)
        self._way = passed.way = way
        if way.hit is not None:
            touched = wanted.probe == "auto" and not way.site.certain
            passed.hit = await self._hits.make(
                way.hit, order, probe="on" if touched else wanted.probe,
                speed_scale=wanted.speed_scale, dry_run=wanted.dry_run)
            if passed.hit is not None and not wanted.dry_run:
                MotionFailed.check(passed.hit, "no passage follows the hit: ")
        elif not wanted.dry_run:
            assert way.opening.push is not None, "the leaf is held"
            await self._reach(way, way.opening.push, order)
        if wanted.dry_run:
            return way
        order.tell(self.progress(order))
        await self._body.wait(lambda: self._holds(way.hold), COMES_TO_REST, order)
        try:
            plan = await self._ways.passage(self._found(way.hold), wanted, order, way.passage)
        except PassageInfeasible as error:
            raise PassageInfeasible(
                f"{error}; the robot stands and holds the leaf", quantity=error.quantity,
                value=error.value, limit=error.limit) from error
        return replace(way, passage=plan)

    async def _reach(self, way: Way, push: Push, order: Order) -> None:
        """Put the hand on the closed leaf."""
        reaching = Reaching(self._body.model, push.reach)
        await self._begin(way, reaching, order)
        await self._body.ended(order)
        MotionFailed.check(reaching)

    def _found(self, hold: Hold) -> PassageTask:
        """Return the passage from where the robot has its hand on the leaf, as it is measured.

        Raises:
            NotReady: Messages are missing or old, the robot moves, or it does not hold the leaf.
        """
        standing, soles = self._body.require_still(TOPICS), self._body.soles()
        assert soles is not None
        return hold.found(standing.position, soles, self._body.inputs.door_angle,
                          self._body.commanded, standing.attitude)

    def _holds(self, hold: Hold) -> bool:
        """Return whether the robot is at rest with its hand on the leaf."""
        try:
            self._found(hold)
        except NotReady:
            return False
        return True

    # -- the walk up ----------------------------------------------------------------------------

    def _middle(self) -> Pose:
        """Return the middle between the soles; errors are those of `Body.standing`."""
        self._body.standing()
        soles = self._body.soles()
        assert soles is not None
        return soles.middle

    def _require_reachable(self, site: Site, *, walk_up: bool) -> None:
        """Check that the robot stands where a hit is to begin, or can and may walk there.

        Raises:
            NotReady: Messages are missing or old.
            NotReached: It stands elsewhere, and may not walk.
            BadDoorPose: It is too far away, or not on the side from which it pushes.
        """
        middle = self._middle()
        if not walk_up:
            require_arrived(middle, site.axes)
        elif not within(middle, site.axes, NEAR):
            require_way(middle, site.axes, self._place.pose())

    async def _arrive(self, site: Site, ahead: float, wanted: Wanted, order: Order) -> Site:
        """Walk to where a hit begins, unless the robot stands there, and see the door from there.

        Args:
            site: Where it is to begin.
            ahead: Distance of B ahead of the soles at the hit [m].

        Returns:
            The site as it is found; that of the argument where the robot stands as surveyed, and
            after a dry run of a walk.

        Raises:
            DoorImpactError: The robot has not got there.
        """
        walks = not within(self._middle(), site.axes, NEAR)
        if walks:
            await self._walk_to(site.axes, order, dry_run=wanted.dry_run)
            if wanted.dry_run:
                return site
            await self._body.rest(AFTER_WALK, order)
        found, middle = self._place.site(), self._middle()
        certain = found.certain and not walks
        if certain and within(middle, found.axes, SURVEYED):
            return site
        return arrived(found.axes, middle, self._place.survey, ahead, certain=certain)

    async def _walk_to(self, place: Pose, order: Order, *, dry_run: bool) -> None:
        """Walk to a place in odom; errors as of `_arrive`."""
        goal = WalkGoal(place)
        try:
            if dry_run:
                await self._walks.plan(goal, order)
            else:
                MotionFailed.check(await self._walks.go(goal, order))
        except Stopped:
            raise
        except DoorImpactError as error:
            order.require()
            raise NotReached(f"the robot has not got to the door: {error}",
                             reason="fell" if error.value is Outcome.FELL else "") from error

    # -- the motion at the leaf -----------------------------------------------------------------

    async def _begin(self, way: Way, motion: Passage | Reaching, order: Order) -> None:
        """Begin a motion at the leaf.

        Raises:
            DoorImpactError: It cannot begin.
        """
        await self._body.caught_up(order)
        require_near(self._body.model, motion.plan.knots.position[0],
                     self._body.standing(TOPICS).position)
        self._link.show(way.hold.in_odom(motion.plan.footsteps))
        self._body.begin(
            order, motion, motion.start(self._link.now() + self._body.inputs.lag), TOPICS)

    def _ended(self, way: Way, passage: Passage, passed: Passed) -> None:
        """Keep where a stopped passage has left the leaf, and say how a passage has ended."""
        if math.isnan(passage.release_angle) and passage.outcome in (
                Outcome.STOPPED, Outcome.LEAF_LOST):
            assert self._body.commanded is not None  # by the passage
            self._left = replace(way, hold=replace(
                way.hold, stance=passage.stance, joints=self._body.commanded))
        now = self._link.now()
        since = passage.cleared(now) - passed.contact_time
        when = (f"{since:.1f} s after the hit" if math.isfinite(since) else
                f"{passage.cleared(now) - passed.began:.1f} s after its first motion")
        passed.message = passage.reason or (
            f"the robot has passed the door in {passage.steps_made(now)} steps, clear of it "
            f"{when} by the odometry")

    def _comply(self, *, yields: bool) -> None:
        """Let the right hand yield to the leaf, or make it stiff again, where that changes."""
        if yields == self._yields or not self._settings.yields:
            return
        self._yields = yields
        self._link.comply(*(self._settings.impedance if yields else ()))
