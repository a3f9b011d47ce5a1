import re

import pytest
import yaml
from typer.testing import CliRunner

from taskslam.cli.ros import app
from taskslam.errors import InputError
from taskslam.ros.node_file import NODES


@pytest.fixture
def invoke(monkeypatch):
    monkeypatch.setenv("COLUMNS", "100")
    return lambda *arguments: CliRunner().invoke(app, list(arguments))


def test_list_names_every_node_file_that_ships(invoke):
    result = invoke("list")
    assert result.exit_code == 0
    for name in NODES.names():
        assert re.search(rf"^{name} +[12] ", result.stdout, re.MULTILINE)


def test_show_prints_a_file_to_begin_from(invoke):
    result = invoke("show", "slam_toolbox")
    assert yaml.safe_load(result.stdout)["answer"]["topic"] == "/slam_toolbox/pose"


def test_check_says_what_keeps_a_node_from_starting(invoke, tmp_path):
    (tmp_path / "mine.yaml").write_text(
        "name: mine\ncommand: no_such_node\nsensors: [laser_scan]\n"
        "answer: {topic: /pose, type: geometry_msgs/PoseStamped}\n"
    )
    result = invoke("check", str(tmp_path / "mine.yaml"))
    assert isinstance(result.exception, InputError)
    assert "the node's command 'no_such_node': there is no such program" in str(result.exception)
