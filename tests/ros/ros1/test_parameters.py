import copy
import json
import random
import subprocess
from pathlib import Path

import pytest

from taskslam.ros.errors import RosError
from taskslam.ros.ros1.parameters import Parameters

PEER = str(Path(__file__).parents[1] / "peers" / "debian_parameters.py")


def test_a_folder_replaces_a_value_and_a_value_a_folder():
    parameters = Parameters()
    parameters.set("/a", 1)
    parameters.set("/a/b", 2)
    assert parameters.get("/a") == {"b": 2}
    parameters.set("/a", 3)
    assert not parameters.has("/a/b")
    with pytest.raises(RosError, match=r"\[/a/b\] is not set"):
        parameters.get("/a/b")


def test_search_goes_up_from_the_nodes_own_namespace():
    parameters = Parameters()
    parameters.set("/one/rate", 1)
    parameters.set("/rate", 2)
    assert parameters.search("/one/two", "rate") == "/one/rate"
    assert parameters.search("/three", "rate/below") == "/rate/below"
    with pytest.raises(RosError, match="upwards search"):
        parameters.search("/one", "absent")


def operations(seed, count=400):
    """Sets, reads and searches over a handful of names, so that they meet."""
    dice = random.Random(seed)
    name = lambda: "/" + "/".join(dice.choices("abc", k=dice.randint(1, 3)))  # noqa: E731
    values = [1, 2.5, "text", True, [1, 2], {"a": 1, "b": {"c": 2}}, {}]
    for _ in range(count):
        match dice.choice(["set", "get", "has", "delete", "search", "names"]):
            case "set":
                yield "set", name(), dice.choice(values)
            case "search":
                yield "search", name(), dice.choice(["a", "b/c", "c"])
            case "names":
                yield ("names",)
            case other:
                yield other, name()


def answer(parameters, operation, *arguments):
    try:
        said = getattr(parameters, operation)(*arguments)
    except RosError:
        return None if operation == "search" else "KeyError"
    return sorted(said) if operation == "names" else copy.deepcopy(said)


@pytest.mark.parametrize("seed", [1, 2])
def test_debians_parameter_server_answers_the_same(seed, debian_python):
    asked = json.loads(json.dumps(list(operations(seed))))
    told = subprocess.run([debian_python, PEER], input=json.dumps(asked), capture_output=True, text=True, check=True)
    parameters = Parameters()
    assert [answer(parameters, *operation) for operation in asked] == json.loads(told.stdout)
