"""One of the two processes between which the benchmarks of topics and services measure.

It runs on whichever rclpy can be imported, or on the Python API of Cyclone DDS alone. It imports
nothing else of this project, so that a ROS 2 installation can run it by its path. It reads commands
from its standard input, one a line, and writes its measurements to its standard output, one JSON
object a line. All times are those of the machine's monotonic clock.
"""

import json
import os
import resource
import statistics
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from typing import Any, Protocol

JOINTS = 30   # number of joints in a message
DEPTH = 1000  # messages that may wait on either side
SERVICE = "bench_flip"
# All participants are on this machine, also where the network has no multicast.
_LOCAL = (
    '<CycloneDDS><Domain><General><Interfaces><NetworkInterface name="lo"/></Interfaces>'
    "<AllowMulticast>false</AllowMulticast></General><Discovery>"
    "<ParticipantIndex>auto</ParticipantIndex>"
    "<MaxAutoParticipantIndex>120</MaxAutoParticipantIndex>"
    '<Peers><Peer address="localhost"/></Peers></Discovery></Domain></CycloneDDS>')

OnMessage = Callable[[int], None]
"""Function that is called with the time at which a message was sent [ns]."""


class Layer(Protocol):
    """Software through which the two processes exchange messages and requests."""

    def publisher(self) -> Callable[[int], None]:
        """Creates a publisher of the states of 30 joints.

        Returns:
            A function that publishes one message, stamped with the given time [ns].
        """

    def listen(self, on_message: OnMessage) -> None:
        """Subscribes and passes on the time of each message; does not return."""

    def serve(self) -> None:
        """Responds to each request with its opposite; does not return."""

    def caller(self) -> Callable[[bool], bool]:
        """Creates a client and waits for the server.

        Returns:
            A function that sends a request and waits for the response.
        """


class RclpyLayer:
    """A node of rclpy.

    Args:
        topic: Name of the topic.
    """

    def __init__(self, topic: str) -> None:
        import rclpy
        from rclpy.executors import SingleThreadedExecutor

        self._topic = topic
        rclpy.init(args=[])
        self._node = rclpy.create_node(f"bench_{sys.argv[2]}")
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(self._node)

    def publisher(self) -> Callable[[int], None]:
        """Creates a publisher of the states of 30 joints."""
        from sensor_msgs.msg import JointState

        message = JointState(**joints())
        publisher = self._node.create_publisher(JointState, self._topic, DEPTH)

        def publish(now: int) -> None:
            message.header.stamp.sec, message.header.stamp.nanosec = divmod(now, 1_000_000_000)
            publisher.publish(message)

        return publish

    def listen(self, on_message: OnMessage) -> None:
        """Subscribes and passes on the time of each message."""
        from sensor_msgs.msg import JointState

        def receive(message: Any) -> None:
            stamp = message.header.stamp
            on_message(stamp.sec * 1_000_000_000 + stamp.nanosec)

        self._node.create_subscription(JointState, self._topic, receive, DEPTH)
        self._executor.spin()

    def serve(self) -> None:
        """Responds to each request with its opposite."""
        from std_srvs.srv import SetBool

        def flip(request: Any, response: Any) -> Any:
            response.success = not request.data
            return response

        self._node.create_service(SetBool, SERVICE, flip)
        self._executor.spin()

    def caller(self) -> Callable[[bool], bool]:
        """Creates a client and waits for the server."""
        from std_srvs.srv import SetBool

        client = self._node.create_client(SetBool, SERVICE)
        client.wait_for_service()
        threading.Thread(target=self._executor.spin, daemon=True).start()
        return lambda data: bool(client.call(SetBool.Request(data=data)).success)


class DdsLayer:
    """The Python API of Cyclone DDS, without ROS.

    Args:
        topic: Name of the topic.
    """

    def __init__(self, topic: str) -> None:
        from cyclonedds.core import Policy, Qos
        from cyclonedds.domain import Domain, DomainParticipant
        from cyclonedds.idl import make_idl_struct
        from cyclonedds.idl import types as idl
        from cyclonedds.util import duration

        self._topic = topic
        number = int(os.environ.get("ROS_DOMAIN_ID") or 0)
        self._domain = Domain(number, ",".join(filter(None, (
            _LOCAL, os.environ.get("CYCLONEDDS_URI")))))
        self._participant = DomainParticipant(number)
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
        """Creates a publisher of the states of 30 joints."""
        sample = self._joints(stamp=0, frame_id="", **joints())
        writer = self._writer(self._topic, self._joints)

        def publish(now: int) -> None:
            sample.stamp = now
            writer.write(sample)

        return publish

    def listen(self, on_message: OnMessage) -> None:
        """Subscribes and passes on the time of each message."""
        reader = self._reader(self._topic, self._joints)
        self._each(*reader, lambda sample: on_message(sample.stamp))

    def _each(self, reader: Any, waitset: Any, do: Callable[[Any], None]) -> None:
        from cyclonedds.util import duration

        while True:
            waitset.wait(duration(infinite=True))
            for sample in reader.take(DEPTH):
                if sample.sample_info.valid_data:
                    do(sample)

    def serve(self) -> None:
        """Responds to each request with its opposite."""
        writer = self._writer(f"{SERVICE}_reply", self._flip)
        reader = self._reader(f"{SERVICE}_request", self._flip)
        self._each(*reader, lambda sample: writer.write(
            self._flip(number=sample.number, data=not sample.data)))

    def caller(self) -> Callable[[bool], bool]:
        """Creates a client and waits for the server."""
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
    """Returns the fields of a message with the states of 30 joints, without its header."""
    values = [0.001 * i for i in range(JOINTS)]
    return {"name": [f"JOINT_{i:02d}" for i in range(JOINTS)],
            "position": values, "velocity": values, "effort": values}


def report(**figures: Any) -> None:
    """Writes a line with figures for the process that runs the benchmark."""
    print(json.dumps(figures), flush=True)


class Ledger:
    """Counts the CPU time and the messages of this process.

    Attributes:
        ages: Time from sending to receiving of each message since the last `close` [ns].
    """

    def __init__(self) -> None:
        self.ages: list[int] = []
        self._cpu = time.process_time()

    def close(self) -> dict[str, Any]:
        """Returns the figures since the last call and starts to count anew.

        Returns:
            CPU time [s], number of messages, memory [MB] and, of two messages or more, median,
            99th percentile and median of the last quarter of their ages [ms].
        """
        ages, self.ages = [1e-6 * age for age in self.ages], []
        now = time.process_time()
        figures = {"cpu_s": now - self._cpu, "count": len(ages), "memory_mb": memory()}
        self._cpu = now
        if len(ages) > 1:
            figures |= {"median_ms": statistics.median(ages),
                        "p99_ms": statistics.quantiles(ages, n=100)[98],
                        "last_ms": statistics.median(ages[-len(ages) // 4:])}
        return figures


def memory() -> float:
    """Returns the memory that this process occupies now [MB]."""
    with open("/proc/self/statm", encoding="ascii") as file:
        return int(file.read().split()[1]) * resource.getpagesize() / 1e6


def talk(layer: Layer) -> None:
    """Publishes; each line of standard input is a rate [1/s] and a duration [s]."""
    publish, ledger = layer.publisher(), Ledger()
    report(ready=True)
    for line in sys.stdin:
        rate, seconds = map(float, line.split())
        ledger.close()
        begin = time.monotonic()
        for i in range(round(rate * seconds)):
            late = begin + i / rate - time.monotonic()
            if late > 0.0:
                time.sleep(late)
            publish(time.monotonic_ns())
        report(took=time.monotonic() - begin, **ledger.close())


def listen(layer: Layer) -> None:
    """Subscribes; for each line of standard input it reports the messages since the last line.

    Each report also has the time of the first message of all [s].
    """
    ledger = Ledger()
    first: list[float] = []

    def on_message(sent: int) -> None:
        if not first:
            first.append(time.monotonic())
        ledger.ages.append(time.monotonic_ns() - sent)

    def respond() -> None:
        for _ in sys.stdin:
            report(first=first[0] if first else None, **ledger.close())

    threading.Thread(target=respond, daemon=True).start()
    layer.listen(on_message)


def call(layer: Layer) -> None:
    """Calls the service; each line of standard input is a number of calls."""
    ask = layer.caller()
    report(ready=True)
    for line in sys.stdin:
        ledger = Ledger()
        for i in range(int(float(line))):
            begin = time.monotonic_ns()
            if ask(bool(i % 2)) is bool(i % 2):
                raise SystemExit("the service gave a wrong response")
            ledger.ages.append(time.monotonic_ns() - begin)
        report(**ledger.close())


def main() -> None:
    """Runs `talk.py rclpy|dds talk|listen|serve|call TOPIC`."""
    layer: Layer = (RclpyLayer if sys.argv[1] == "rclpy" else DdsLayer)(sys.argv[3])
    role = {"talk": talk, "listen": listen, "call": call, "serve": lambda it: it.serve()}
    with suppress(KeyboardInterrupt):
        role[sys.argv[2]](layer)


if __name__ == "__main__":
    main()
