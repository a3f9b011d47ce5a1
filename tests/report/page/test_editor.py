"""The editor of tours: served to this machine alone, driven by a real browser, its file a scenario again."""

from __future__ import annotations

import http.client
import json
import threading
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from browser import ACT, WATCH, chromium, needs_chromium, told_when_served, without_policy
from taskslam.geometry import SE2
from taskslam.report.loopback import LoopbackServer
from taskslam.report.page.editor import Editor
from taskslam.robot import load_robot
from taskslam.scenario import load_scenario
from taskslam.scenario.writing import save_scenario
from taskslam.task import Sequence, Waypoint
from taskslam.world.floor_plan import FREE, OCCUPIED, FloorPlan
from taskslam.world.map_server import save_floor_plan


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "tour.yaml"


@pytest.fixture
def editor(file: Path, tmp_path: Path) -> Editor:
    cells = np.full((100, 160), OCCUPIED, np.uint8)
    cells[2:98, 2:158] = FREE
    plan = FloorPlan(cells, 0.05, SE2(-1.0, -2.0))
    save_floor_plan(plan, tmp_path / "map.yaml")
    scenario = load_scenario("house").model_copy(
        update={
            "name": "hall",
            "title": "</script><b>Hall</b>",
            "start": Waypoint(x=0.0, y=0.0, theta=0.0),
            "sequence": Sequence(waypoints=(Waypoint(x=2.0, y=1.0, theta=0.5), Waypoint(x=5.0, y=-1.0, theta=0.0))),
        }
    )
    return Editor(scenario, plan, load_robot("turtlebot2"), file)


@pytest.fixture
def server(editor: Editor) -> Iterator[LoopbackServer]:
    with LoopbackServer(editor.page, editor.acts) as serving:
        thread = threading.Thread(target=serving.serve_forever)
        thread.start()
        yield serving
        serving.shutdown()
        thread.join()


def asked(server: LoopbackServer, method: str, path: str, body: bytes = b"", **headers: str) -> tuple[int, str]:
    connection = http.client.HTTPConnection("127.0.0.1", server.server_port, timeout=10)
    connection.request(method, path, body, headers)
    answer = connection.getresponse()
    return answer.status, answer.read().decode()


def test_only_who_knows_the_address_is_answered(server: LoopbackServer) -> None:
    place, tour = f"/{server.word}/", json.dumps({"start": [0, 0, 0], "goals": []}).encode()
    assert server.server_address[0] == "127.0.0.1"
    assert asked(server, "GET", place)[0] == 200
    assert asked(server, "POST", f"{place}survey", tour)[0] == 200
    assert asked(server, "GET", "/")[0] == 404
    assert asked(server, "GET", place, Host="evil.example")[0] == 404
    assert asked(server, "POST", f"{place}survey", tour, Origin="http://evil.example")[0] == 404
    assert asked(server, "POST", "/wrong/save", tour)[0] == 404
    assert asked(server, "POST", f"{place}erase", tour)[0] == 404
    assert asked(server, "POST", f"{place}survey", tour, **{"Content-Length": str(1 << 30)})[0] == 413


@pytest.mark.parametrize(
    "said",
    [b"", b"[]", b'{"start": [0, 0, NaN], "goals": []}', b'{"start": [0, 0], "goals": []}', b'{"start": [0, 0, 0]}',
     b'{"start": [0, 0, 1e300], "goals": []}', b'{"start": [0, 0, 0], "goals": [], "file": "/etc/passwd"}'],
)  # fmt: skip
def test_what_is_no_tour_is_refused_in_a_sentence(said: bytes, server: LoopbackServer, file: Path) -> None:
    status, answer = asked(server, "POST", f"/{server.word}/save", said)
    assert status == 400
    assert json.loads(answer)["error"].startswith("the tour: ")
    assert not file.exists()


def test_a_tour_without_goals_is_not_saved(server: LoopbackServer, file: Path) -> None:
    status, answer = asked(server, "POST", f"/{server.word}/save", b'{"start": [0, 0, 0], "goals": []}')
    assert (status, "without a goal" in answer) == (400, True)
    assert not file.exists()


def test_a_title_cannot_act_on_the_page(editor: Editor) -> None:
    assert "<b>Hall" not in editor.page()


@needs_chromium
def test_a_person_edits_a_tour_and_saves_it(editor: Editor, file: Path) -> None:
    """A click adds a goal, dragging moves one and its handle turns it, keys and fields too; the file is the tour."""
    script = """
    const settled = async (count) => {
      for (let i = 0; i < 200 && Number(document.documentElement.dataset.surveyed ?? 0) < count; i++)
        await new Promise((go) => setTimeout(go, 20));
    };
    const svg = document.querySelector("svg.drawing");
    const {view} = JSON.parse(document.getElementById("data").textContent);
    const screen = (x, y) => {
      const drawn = new DOMPoint((x - view.left) * view.scale, (view.top - y) * view.scale);
      const point = drawn.matrixTransform(svg.getScreenCTM());
      return {clientX: point.x, clientY: point.y, bubbles: true, button: 0, pointerId: 1};
    };
    const pointer = (target, kind, x, y) => target.dispatchEvent(new PointerEvent(kind, screen(x, y)));
    const drag = (target, from, to) => {
      target.setPointerCapture = undefined;
      pointer(target, "pointerdown", ...from);
      pointer(target, "pointermove", ...to);
      pointer(target, "pointerup", ...to);
    };
    const place = (index) => document.querySelectorAll(".place")[index];
    const press = (index, key) =>
      place(index).dispatchEvent(new KeyboardEvent("keydown", {key, bubbles: true, cancelable: true}));
    (async () => {
      await settled(1);
      const first = document.getElementById("verdict").textContent;
      pointer(svg, "pointerdown", 3.0, 2.0);                                   // a third goal
      drag(place(1).querySelector("circle"), [2.0, 1.0], [1.5, 1.5]);           // the first is moved
      drag(place(2).querySelector(".handle"), [5.5, -1.0], [5.0, 0.5]);         // the second looks up
      press(3, "ArrowLeft"); press(3, "]");
      await settled(5);
      pointer(svg, "pointerdown", -0.96, 0.0);                                  // a fourth, at the wall
      await settled(7);
      const wrong = [document.getElementById("verdict").textContent, text("#faults li"), seen(".place.faulty").length];
      press(4, "Delete");
      await settled(8);
      document.getElementById("save").click();
      for (let i = 0; i < 200 && !document.getElementById("said").textContent; i++)
        await new Promise((go) => setTimeout(go, 20));
      const acting = seen("button, input, .place");
      const missed = acting.filter((at) => { at.focus(); return document.activeElement !== at; }).length;
      const result = [first, wrong, document.getElementById("said").textContent, missed, noted];
      const told = document.createElement("pre"); told.id = "told"; told.textContent = JSON.stringify(result);
      document.body.append(told);
    })();
    return null;"""
    page = (
        without_policy(editor.page())
        .replace("<head>", f"<head>{WATCH}", 1)
        .replace("</body>", f"{ACT % script}</body>")
    )
    first, wrong, said, missed, noted = told_when_served(lambda: page, editor.acts)
    assert noted == []
    assert first.startswith("Every goal can be reached: ")
    assert wrong[0] == "This tour cannot be driven as it is."
    assert len(wrong[1]) == wrong[2] == 1
    assert said == f"Saved {file}"
    assert missed == 0
    one, two, three = load_scenario(file).sequence.waypoints
    assert (one.x, one.y, one.theta) == pytest.approx((1.5, 1.5, 0.5), abs=0.02)
    assert (two.x, two.y) == (5.0, -1.0)
    assert two.theta == pytest.approx(np.pi / 2, abs=0.05)
    assert (three.x, three.y) == pytest.approx((2.95, 2.0), abs=0.02)


@needs_chromium
def test_the_page_opens_under_its_own_policy(server: LoopbackServer) -> None:
    dom, console = chromium(server.url, "--dump-dom")
    assert console == []
    assert "data-surveyed=" in dom
    assert dom.count('class="place"') == 3


def test_what_was_edited_is_written_as_a_person_would(editor: Editor, server: LoopbackServer, file: Path) -> None:
    tour = json.dumps({"start": [0, 0, 0], "goals": [[1, 1, 0.5]]}).encode()
    assert asked(server, "POST", f"/{server.word}/save", tour)[0] == 200
    assert "  - [1.0, 1.0, 0.5]\n" in file.read_text()
    scenario = load_scenario(file)
    save_scenario(scenario, file)
    assert load_scenario(file) == scenario
