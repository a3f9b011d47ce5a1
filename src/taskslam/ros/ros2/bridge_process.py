"""The bridge to ROS 2: `python3 bridge_process.py NAME`, run by the interpreter that has the user's rclpy (from 3.10).

It imports nothing of ours, and knows no message types but by their names. Standard input brings frames, standard output
takes them: a length each of a header (JSON) and of a body, both little-endian uint32, then the two. A topic's messages
are bodies, in CDR as they go over the wire; requests, goals and what answers them are plain values in the header, so
that whoever asks need not know which fields a distribution has.

    {"do": "publish", "id"} + CDR
    {"ask": n, "do": "advertise", "id", "topic", "type", "qos"}      and "subscribe" likewise
    {"ask": n, "do": "withdraw", "id"}                               ends either of them
    {"ask": n, "do": "matched", "id"}                                how many peers a topic of ours has
    {"ask": n, "do": "graph"}                                        who publishes, reads and offers what
    {"ask": n, "do": "call", "service", "type", "fields", "within_s"}
    {"ask": n, "do": "send_goal", "id", "action", "type", "fields", "within_s"}
    {"ask": n, "do": "cancel", "id"}
    {"do": "last_words", "id"} + CDR                                 published on a topic of ours when the input ends

A question is answered by {"answer": n, "value"} or {"answer": n, "error"}, in any order. Unasked come {"heard": id} +
CDR, {"feedback": id, "value"}, {"result": id, "status", "value"}, {"error"} for what was not asked, and first of all
{"ready": facts} or {"unable": why}. A goal whose action server vanishes ends with the status "gone". The bridge ends
when its input does, and cancels the goals that are open then.

A quality of service is {"reliability": "reliable" or "best_effort", "durability": "volatile" or "transient_local",
"depth": n}; depth 0 keeps all.
"""

from __future__ import annotations

import contextlib
import importlib
import json
import os
import signal
import struct
import sys
import threading
import time
from collections.abc import Callable, Mapping
from typing import Any, BinaryIO

LENGTHS = struct.Struct("<II")
LONGEST_HEADER = 4 << 20
LONGEST_BODY = 256 << 20
_LOOK_EVERY_S = 0.5
_LEAVING_S = 2.0


class BrokenFrameError(Exception):
    """What came is no frame."""


def frame(header: dict[str, Any], body: Any = b"") -> tuple[bytes, Any]:
    """The bytes of a frame, in two parts: the body is not copied."""
    said = json.dumps(header).encode()
    return LENGTHS.pack(len(said), len(body)) + said, body


def read_frame(stream: BinaryIO) -> tuple[dict[str, Any], bytes] | None:
    """The next header and body of a buffered stream, or None at its end. Raises BrokenFrameError."""
    lengths = stream.read(LENGTHS.size)
    if not lengths:
        return None
    if len(lengths) < LENGTHS.size:
        raise BrokenFrameError("a frame that ends within its lengths")
    said, long = LENGTHS.unpack(lengths)
    if said > LONGEST_HEADER or long > LONGEST_BODY:
        raise BrokenFrameError(
            f"a frame of {said} and {long} bytes; expected at most {LONGEST_HEADER} and {LONGEST_BODY}"
        )
    words, body = stream.read(said), stream.read(long)
    if len(words) < said or len(body) < long:
        raise BrokenFrameError("a frame that ends before its time")
    try:
        header = json.loads(words)
    except (ValueError, RecursionError) as error:
        raise BrokenFrameError(f"a header that is no JSON: {error}") from error
    if not isinstance(header, dict):
        raise BrokenFrameError("a header that is no mapping")
    return header, body


class Bridge:
    """A node of ROS 2, and what is done and said through it."""

    def __init__(self, name: str, output: BinaryIO) -> None:
        import rclpy
        from rclpy.executors import SingleThreadedExecutor

        self._output, self._speaking = output, threading.Lock()
        with_signals: dict[str, Any] = {}
        with contextlib.suppress(ImportError):
            from rclpy.signals import SignalHandlerOptions

            with_signals = {"signal_handler_options": SignalHandlerOptions.NO}
        rclpy.init(args=[], **with_signals)
        self._node = rclpy.create_node(name, start_parameter_services=False, enable_rosout=False)
        self._topics: dict[int, Any] = {}
        self._clients: dict[tuple[str, str], tuple[Any, Any]] = {}
        self._actions: dict[tuple[str, str], Any] = {}
        self._goals: dict[int, tuple[str, Any]] = {}
        self._last_words: dict[int, bytes] = {}
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(self._node)
        self._hearing = threading.Thread(target=self._spin, name="hears", daemon=True)
        self._hearing.start()
        threading.Thread(target=self._watch, name="watches action servers", daemon=True).start()

    def facts(self) -> dict[str, Any]:
        """What whoever asks should know of this side."""
        import rclpy

        version = sys.version_info
        return {
            "python": f"{version.major}.{version.minor}.{version.micro}",
            "distribution": os.environ.get("ROS_DISTRO", ""),
            "middleware": rclpy.get_rmw_implementation_identifier(),
            "node": self._node.get_fully_qualified_name(),
        }

    def say(self, header: dict[str, Any], body: bytes = b"") -> None:
        """Send a frame."""
        begin, rest = frame(header, body)
        with self._speaking, contextlib.suppress(BrokenPipeError):  # whoever asked was killed: there is still to leave
            self._output.write(begin)
            self._output.write(rest)
            self._output.flush()

    def take(self, header: dict[str, Any], body: bytes) -> None:
        """Do what a frame asks for."""
        what = header.get("do")
        if what == "last_words":
            self._last_words[header["id"]] = body
        elif what == "publish":
            try:
                self._topics[header["id"]].publish(body)
            except Exception as error:  # whatever the middleware raises is told, and the bridge lives on
                self.say({"error": f"publish: {_words(error)}"})
        elif what in ("call", "send_goal", "cancel"):  # these wait for others, and more is to be done meanwhile
            threading.Thread(target=self._answer, args=(header,), daemon=True).start()
        else:
            self._answer(header)

    def close(self) -> None:
        """Leave: cancel the goals that are open, say the last words, and once more when all has come to its end."""
        import rclpy

        ended = [goal.cancel_goal_async() for _, goal in list(self._goals.values())]
        self._say_last_words()
        until = time.monotonic() + _LEAVING_S
        while self._goals and not all(done.done() for done in ended) and time.monotonic() < until:
            time.sleep(0.02)
        if ended:
            self._say_last_words()
        rclpy.try_shutdown()
        self._hearing.join(1.0)
        self._node.destroy_node()

    def _say_last_words(self) -> None:
        for topic, body in self._last_words.items():
            with contextlib.suppress(Exception):  # nobody is there to be told of it
                self._topics[topic].publish(body)

    def _watch(self) -> None:
        """End the goals whose server is not there any more: nobody else would."""
        served_by: dict[int, set[Any]] = {}
        while self._executor.context.ok():
            time.sleep(_LOOK_EVERY_S)
            for number, (action, _) in list(self._goals.items()):
                with contextlib.suppress(Exception):  # while we leave
                    ends = self._node.get_publishers_info_by_topic(f"{action}/_action/status")
                    there = {tuple(end.endpoint_gid) for end in ends}
                    known = served_by.setdefault(number, there) or there
                    served_by[number] = known
                    if known and not known & there:
                        self._goals.pop(number, None)
                        self.say({"result": number, "status": "gone", "value": None})

    def _spin(self) -> None:
        while self._executor.context.ok():
            try:
                self._executor.spin()
            except Exception as error:  # as above; what raised it is no longer waited for
                if self._executor.context.ok():
                    self.say({"error": f"while it hears: {_words(error)}"})

    def _answer(self, header: dict[str, Any]) -> None:
        number, what = header.pop("ask", 0), header.pop("do", "")
        try:
            deed = getattr(self, f"_do_{what}", None)
            if deed is None:
                raise ValueError(f"there is no '{what}' to do")
            answer = {"answer": number, "value": deed(**header)}
        except Exception as error:  # as above
            answer = {"answer": number, "error": _words(error)}
        self.say(answer)

    def _do_advertise(self, id: int, topic: str, type: str, qos: dict[str, Any]) -> None:  # noqa: A002
        self._topics[id] = self._node.create_publisher(_found(type), topic, _profile(qos))

    def _do_subscribe(self, id: int, topic: str, type: str, qos: dict[str, Any]) -> None:  # noqa: A002
        def hear(data: bytes) -> None:
            self.say({"heard": id}, data)

        self._topics[id] = self._node.create_subscription(_found(type), topic, hear, _profile(qos), raw=True)

    def _do_withdraw(self, id: int) -> None:  # noqa: A002
        topic = self._topics.pop(id)
        destroy = self._node.destroy_publisher if hasattr(topic, "publish") else self._node.destroy_subscription
        destroy(topic)

    def _do_matched(self, id: int) -> int:  # noqa: A002
        topic = self._topics[id]
        return int(topic.get_subscription_count() if hasattr(topic, "publish") else topic.get_publisher_count())

    def _do_graph(self) -> dict[str, Any]:
        node = self._node
        topics = {}
        for topic, types in node.get_topic_names_and_types():
            topics[topic] = {
                "types": types,
                "publishers": [_endpoint(end) for end in node.get_publishers_info_by_topic(topic)],
                "subscribers": [_endpoint(end) for end in node.get_subscriptions_info_by_topic(topic)],
            }
        names = [space.rstrip("/") + "/" + name for name, space in node.get_node_names_and_namespaces()]
        return {"nodes": names, "topics": topics, "services": dict(node.get_service_names_and_types())}

    def _do_call(self, service: str, type: str, fields: dict[str, Any], within_s: float) -> Any:  # noqa: A002
        client, kind = self._client(service, type)
        if not client.wait_for_service(timeout_sec=within_s):
            raise TimeoutError(f"nobody offers the service {service}")
        request = filled(kind.Request(), fields)
        sent = self._in_turn(lambda: client.call_async(request), within_s)
        return plain(_waited_for(sent, within_s, f"the service {service}"))

    def _in_turn(self, deed: Callable[[], Any], within_s: float) -> Any:
        """What is done in the thread that hears: a request whose answer came before it was noted down would be lost."""
        return _waited_for(self._executor.create_task(deed), within_s, "the bridge")

    def _client(self, service: str, type: str) -> Any:  # noqa: A002
        if (service, type) not in self._clients:
            kind = _found(type)
            self._clients[service, type] = self._node.create_client(kind, service), kind
        return self._clients[service, type]

    def _do_send_goal(self, id: int, action: str, type: str, fields: dict[str, Any], within_s: float) -> bool:  # noqa: A002
        from rclpy.action import ActionClient

        kind = _found(type)
        if (action, type) not in self._actions:
            self._actions[action, type] = ActionClient(self._node, kind, action)
        client = self._actions[action, type]
        if not client.wait_for_server(timeout_sec=within_s):
            raise TimeoutError(f"nobody offers the action {action}")

        def told(message: Any) -> None:
            self.say({"feedback": id, "value": plain(message.feedback)})

        asked = filled(kind.Goal(), fields)
        sent = self._in_turn(lambda: client.send_goal_async(asked, feedback_callback=told), within_s)
        goal = _waited_for(sent, within_s, f"the action {action}")
        if goal.accepted:
            self._goals[id] = action, goal
            ended = self._in_turn(goal.get_result_async, within_s)
            ended.add_done_callback(lambda done: self._ended(id, done))
        return bool(goal.accepted)

    def _ended(self, id: int, done: Any) -> None:  # noqa: A002
        from action_msgs.msg import GoalStatus

        if self._goals.pop(id, None) is None:
            return
        states = {GoalStatus.STATUS_SUCCEEDED: "succeeded", GoalStatus.STATUS_ABORTED: "aborted"}
        states[GoalStatus.STATUS_CANCELED] = "canceled"
        try:
            found = done.result()
            self.say({"result": id, "status": states.get(found.status, "unknown"), "value": plain(found.result)})
        except Exception as error:
            self.say({"result": id, "status": "unknown", "value": None, "error": _words(error)})

    def _do_cancel(self, id: int, within_s: float = 10.0) -> bool:  # noqa: A002
        if id not in self._goals:
            return False
        _, goal = self._goals[id]
        answer = _waited_for(self._in_turn(goal.cancel_goal_async, within_s), within_s, "cancelling")
        return bool(answer.goals_canceling)


def in_humble(variables: Mapping[str, str]) -> dict[str, str]:
    """Variables of later distributions with those by which Humble understands them."""
    told = dict(variables)
    if told.get("ROS_AUTOMATIC_DISCOVERY_RANGE") == "LOCALHOST":
        told["ROS_LOCALHOST_ONLY"] = "1"
    if profile := told.get("FASTDDS_DEFAULT_PROFILES_FILE"):
        told["FASTRTPS_DEFAULT_PROFILES_FILE"] = profile
    return told


def plain(value: Any) -> Any:
    """A message as mappings, lists and numbers."""
    if hasattr(value, "get_fields_and_field_types"):
        return {name: plain(getattr(value, name)) for name in value.get_fields_and_field_types()}
    if isinstance(value, (str, bool, int, float)):
        return value
    if isinstance(value, bytes):
        return list(value)
    if hasattr(value, "tolist"):
        return value.tolist()
    return [plain(part) for part in value]


def filled(message: Any, fields: dict[str, Any]) -> Any:
    """A message with these of its fields set. Raises ValueError: it has no such field."""
    kinds = message.get_fields_and_field_types()
    for name, value in fields.items():
        if name not in kinds:
            raise ValueError(f"{type(message).__name__} has no field '{name}'; expected some of {', '.join(kinds)}")
        setattr(message, name, _fitting(getattr(message, name), kinds[name], value))
    return message


def _fitting(now: Any, kind: str, value: Any) -> Any:
    if hasattr(now, "get_fields_and_field_types"):
        return filled(now, value)
    element, bracket, _ = kind.removeprefix("sequence<").partition("[")
    element = element.partition(">")[0].partition(",")[0]
    is_list = bracket or kind.startswith("sequence<")
    if is_list and "/" in element:
        package, _, name = element.partition("/")
        made = _found(f"{package}/msg/{name}")
        return [filled(made(), part) for part in value]
    if is_list and element in ("float", "double"):
        return [float(part) for part in value]
    if isinstance(now, float):
        return float(value)
    return value


def _waited_for(future: Any, within_s: float, whom: str) -> Any:
    """What a future comes to, the executor's thread at work on it. Raises TimeoutError."""
    done = threading.Event()
    future.add_done_callback(lambda _: done.set())
    if not done.wait(within_s):
        raise TimeoutError(f"{whom} has not answered within {within_s:g} s")
    return future.result()


def _found(name: str) -> Any:
    """The class of a type named as sensor_msgs/msg/LaserScan. Raises ValueError: this ROS has none."""
    package, _, rest = name.partition("/")
    room, _, last = rest.partition("/")
    try:
        return getattr(importlib.import_module(f"{package}.{room}"), last)
    except (ImportError, AttributeError) as error:
        raise ValueError(f"the ROS of {sys.executable} has no type {name}") from error


def _profile(qos: dict[str, Any]) -> Any:
    from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy

    return QoSProfile(
        reliability=ReliabilityPolicy[qos["reliability"].upper()],
        durability=DurabilityPolicy[qos["durability"].upper()],
        history=HistoryPolicy.KEEP_LAST if qos["depth"] else HistoryPolicy.KEEP_ALL,
        depth=qos["depth"],
    )


def _endpoint(end: Any) -> dict[str, str]:
    qos = end.qos_profile
    return {
        "node": end.node_namespace.rstrip("/") + "/" + end.node_name,
        "type": end.topic_type,
        "reliability": qos.reliability.name.lower(),
        "durability": qos.durability.name.lower(),
    }


def _words(error: Exception) -> str:
    return " ".join(str(error).split()) or type(error).__name__


def main(name: str) -> None:
    """Serve until the input ends."""
    source = os.fdopen(os.dup(0), "rb", 1 << 16)
    output = os.fdopen(os.dup(1), "wb", 1 << 16)
    os.dup2(2, 1)  # whatever else is printed shall not come between frames
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # it ends when its input does, and its node before it
    try:
        if sys.version_info < (3, 10):  # noqa: UP036 it is the user's
            raise RuntimeError(f"{sys.executable} is Python {sys.version.split()[0]}; expected 3.10 or later")
        if os.environ.get("ROS_DISTRO") == "humble":
            os.environ.update(in_humble(os.environ))
        bridge = Bridge(name, output)
    except Exception as error:  # whatever it is, it is told
        for part in frame({"unable": f"{sys.executable}: {_words(error)}"}):
            output.write(part)
        output.flush()
        return
    bridge.say({"ready": bridge.facts()})
    with contextlib.suppress(BrokenFrameError, BrokenPipeError):
        while (said := read_frame(source)) is not None:
            bridge.take(*said)
    with contextlib.suppress(BrokenPipeError):
        bridge.close()


if __name__ == "__main__":
    main(sys.argv[1])
