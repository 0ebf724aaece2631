"""One of the two processes that the benchmarks of topics and services have talk.

It runs on whichever rclpy is importable, or with Cyclone DDS's Python API alone, and needs nothing
else of this package, so that a ROS 2 can run it by its path. It is told what to do, and tells what
it measured, by lines on its standard streams. Times are of the machine's monotonic clock.
"""

import json
import resource
import statistics
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from typing import Any, Protocol

JOINTS = 30
DEPTH = 1000
SERVICE = "bench_flip"

Heard = Callable[[int], None]  # when a message was sent [ns]


class Layer(Protocol):
    """What the processes talk through."""

    def publisher(self) -> Callable[[int], None]:
        """Makes a publisher of 30 joints' states; what it returns publishes one, with its time."""

    def listen(self, heard: Heard) -> None:
        """Hands over the time of each message; does not return."""

    def serve(self) -> None:
        """Answers requests with the opposite; does not return."""

    def caller(self) -> Callable[[bool], bool]:
        """Waits for the server; what it returns sends a request and waits for the answer."""


class RclpyLayer:
    """A node."""

    def __init__(self, topic: str) -> None:
        import rclpy
        from rclpy.executors import SingleThreadedExecutor

        self._topic = topic
        rclpy.init(args=[])
        self._node = rclpy.create_node(f"bench_{sys.argv[2]}")
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(self._node)

    def publisher(self) -> Callable[[int], None]:
        """See Layer."""
        from sensor_msgs.msg import JointState

        message = JointState(**joints())
        publisher = self._node.create_publisher(JointState, self._topic, DEPTH)

        def publish(now: int) -> None:
            message.header.stamp.sec, message.header.stamp.nanosec = divmod(now, 1_000_000_000)
            publisher.publish(message)

        return publish

    def listen(self, heard: Heard) -> None:
        """See Layer."""
        from sensor_msgs.msg import JointState

        def take(message: Any) -> None:
            stamp = message.header.stamp
            heard(stamp.sec * 1_000_000_000 + stamp.nanosec)

        self._node.create_subscription(JointState, self._topic, take, DEPTH)
        self._executor.spin()

    def serve(self) -> None:
        """See Layer."""
        from std_srvs.srv import SetBool

        def flip(request: Any, response: Any) -> Any:
            response.success = not request.data
            return response

        self._node.create_service(SetBool, SERVICE, flip)
        self._executor.spin()

    def caller(self) -> Callable[[bool], bool]:
        """See Layer."""
        from std_srvs.srv import SetBool

        client = self._node.create_client(SetBool, SERVICE)
        client.wait_for_service()
        threading.Thread(target=self._executor.spin, daemon=True).start()
        return lambda data: bool(client.call(SetBool.Request(data=data)).success)


class DdsLayer:
    """Cyclone DDS's Python API, without any of ROS."""

    def __init__(self, topic: str) -> None:
        from cyclonedds.core import Policy, Qos
        from cyclonedds.idl import make_idl_struct
        from cyclonedds.idl import types as idl
        from cyclonedds.util import duration
        from ros2_embedded.domain import Discovery, domain_id, join_domain

        self._topic = topic
        self._domain, self._participant = join_domain(domain_id(), Discovery())
        self._qos = Qos(Policy.Reliability.Reliable(duration(infinite=True)),
                        Policy.History.KeepLast(DEPTH))
        kinds: Any = idl
        numbers = kinds.sequence[kinds.float64]
        self._joints: Any = make_idl_struct("BenchJoints", "BenchJoints", {
            "stamp": idl.int64, "frame_id": str, "name": kinds.sequence[str],
            "position": numbers, "velocity": numbers, "effort": numbers})
        self._flip: Any = make_idl_struct(
            "BenchFlip", "BenchFlip", {"number": idl.int64, "data": bool})

    def _reader(self, name: str, kind: Any) -> tuple[Any, Any]:
        from cyclonedds.core import InstanceState, ReadCondition, SampleState, ViewState, WaitSet
        from cyclonedds.sub import DataReader
        from cyclonedds.topic import Topic

        reader = DataReader(self._participant, Topic(self._participant, name, kind), self._qos)
        waitset = WaitSet(self._participant)
        waitset.attach(ReadCondition(
            reader, SampleState.Any | ViewState.Any | InstanceState.Any))
        return reader, waitset

    def _writer(self, name: str, kind: Any) -> Any:
        from cyclonedds.pub import DataWriter
        from cyclonedds.topic import Topic

        return DataWriter(self._participant, Topic(self._participant, name, kind), self._qos)

    def publisher(self) -> Callable[[int], None]:
        """See Layer."""
        sample = self._joints(stamp=0, frame_id="", **joints())
        writer = self._writer(self._topic, self._joints)

        def publish(now: int) -> None:
            sample.stamp = now
            writer.write(sample)

        return publish

    def listen(self, heard: Heard) -> None:
        """See Layer."""
        self._each(*self._reader(self._topic, self._joints), lambda sample: heard(sample.stamp))

    def _each(self, reader: Any, waitset: Any, do: Callable[[Any], None]) -> None:
        from cyclonedds.util import duration

        while True:
            waitset.wait(duration(infinite=True))
            for sample in reader.take(DEPTH):
                if sample.sample_info.valid_data:
                    do(sample)

    def serve(self) -> None:
        """See Layer."""
        writer = self._writer(f"{SERVICE}_reply", self._flip)
        reader = self._reader(f"{SERVICE}_request", self._flip)
        self._each(*reader, lambda sample: writer.write(
            self._flip(number=sample.number, data=not sample.data)))

    def caller(self) -> Callable[[bool], bool]:
        """See Layer."""
        from cyclonedds.util import duration

        writer = self._writer(f"{SERVICE}_request", self._flip)
        reader, waitset = self._reader(f"{SERVICE}_reply", self._flip)
        while not (writer.get_matched_subscriptions() and reader.get_matched_publications()):
            time.sleep(0.01)

        def call(data: bool) -> bool:
            writer.write(self._flip(number=0, data=data))
            while True:
                waitset.wait(duration(infinite=True))
                for sample in reader.take(1):
                    return bool(sample.data)

        return call


def joints() -> dict[str, Any]:
    """The fields of 30 joints' states, without their header."""
    values = [0.001 * i for i in range(JOINTS)]
    return {"name": [f"JOINT_{i:02d}" for i in range(JOINTS)],
            "position": values, "velocity": values, "effort": values}


def tell(**told: Any) -> None:
    """Writes a line for the process that measures."""
    print(json.dumps(told), flush=True)


class Ledger:
    """What a process used and heard since it was last asked."""

    def __init__(self) -> None:
        self.ages: list[int] = []
        self._cpu = time.process_time()

    def close(self) -> dict[str, Any]:
        """The figures since the last time: CPU time [s], messages, their ages [ms], memory."""
        ages, self.ages = [1e-6 * age for age in self.ages], []
        now = time.process_time()
        told = {"cpu_s": now - self._cpu, "count": len(ages), "memory_mb": memory()}
        self._cpu = now
        if len(ages) > 1:
            told |= {"median_ms": statistics.median(ages),
                     "p99_ms": statistics.quantiles(ages, n=100)[98],
                     "last_ms": statistics.median(ages[-len(ages) // 4:])}
        return told


def memory() -> float:
    """What this process has in memory now [MB]."""
    with open("/proc/self/statm", encoding="ascii") as file:
        return int(file.read().split()[1]) * resource.getpagesize() / 1e6


def talk(layer: Layer) -> None:
    """Publishes at the rates [1/s] and for the times [s] that lines of standard input give."""
    publish, ledger = layer.publisher(), Ledger()
    tell(ready=True)
    for line in sys.stdin:
        rate, seconds = map(float, line.split())
        ledger.close()
        begin = time.monotonic()
        for i in range(round(rate * seconds)):
            late = begin + i / rate - time.monotonic()
            if late > 0.0:
                time.sleep(late)
            publish(time.monotonic_ns())
        tell(took=time.monotonic() - begin, **ledger.close())


def listen(layer: Layer) -> None:
    """Tells for each line of standard input of the messages since the last, and of the first."""
    ledger = Ledger()
    first: list[float] = []

    def heard(sent: int) -> None:
        if not first:
            first.append(time.monotonic())
        ledger.ages.append(time.monotonic_ns() - sent)

    def report() -> None:
        for _ in sys.stdin:
            tell(first=first[0] if first else None, **ledger.close())

    threading.Thread(target=report, daemon=True).start()
    layer.listen(heard)


def call(layer: Layer) -> None:
    """Makes as many calls as each line of standard input says."""
    ask = layer.caller()
    tell(ready=True)
    for line in sys.stdin:
        ledger = Ledger()
        for i in range(int(float(line))):
            begin = time.monotonic_ns()
            if ask(bool(i % 2)) is bool(i % 2):
                raise SystemExit("a wrong answer")
            ledger.ages.append(time.monotonic_ns() - begin)
        tell(**ledger.close())


def main() -> None:
    """Runs `bench_talk.py rclpy|dds talk|listen|serve|call TOPIC`."""
    layer: Layer = (RclpyLayer if sys.argv[1] == "rclpy" else DdsLayer)(sys.argv[3])
    role = {"talk": talk, "listen": listen, "call": call, "serve": lambda it: it.serve()}
    with suppress(KeyboardInterrupt):
        role[sys.argv[2]](layer)


if __name__ == "__main__":
    main()
