"""The house as CONTRIBUTING.md draws it, as pyproject.toml demands it, and as the code is: the three are one."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import grimp

ROOT = Path(__file__).parents[1]
Floors = list[set[str]]


def drawn() -> Floors:
    """Floors of the drawing, from the top: names between the walls."""
    page = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    (drawing,) = re.findall(r"^```text\n(┌.*?┘)\n```$", page, re.MULTILINE | re.DOTALL)
    return [
        set(re.findall(r"^│ (\w+) ", floor, re.MULTILINE)) for floor in re.split(r"^├─+┤$", drawing, flags=re.MULTILINE)
    ]


def demanded() -> Floors:
    """Floors of the layers contract, from the top."""
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["importlinter"]
    layers = next(
        contract["layers"] for contract in settings["contracts"] if contract.get("containers") == ["taskslam"]
    )
    return [set(re.split(r"\s*\|\s*", layer)) for layer in layers]


def test_the_drawing_shows_the_floors_that_the_contract_demands() -> None:
    assert drawn() == demanded()


def test_every_room_of_the_code_stands_on_one_floor() -> None:
    rooms = {
        path.stem
        for path in (ROOT / "src" / "taskslam").iterdir()
        if (path.suffix == ".py" or (path / "__init__.py").is_file()) and not path.stem.startswith("__")
    }
    floors = demanded()
    assert rooms == set().union(*floors)
    assert sum(map(len, floors)) == len(rooms)


def test_no_modules_import_one_another_in_a_circle() -> None:
    graph = grimp.build_graph("taskslam")
    todo = {module: set(graph.find_modules_directly_imported_by(module)) for module in graph.modules}
    while free := {module for module, needs in todo.items() if not needs & todo.keys()}:
        todo = {module: needs for module, needs in todo.items() if module not in free}
    assert sorted(todo) == []


def test_a_methods_code_is_loaded_in_confined_processes_alone() -> None:
    """Nobody else imports the loader, and nobody at all imports the two programs that do (design D12)."""
    graph = grimp.build_graph("taskslam")
    programs = {"taskslam.slam.guest.child", "taskslam.slam.guest.describe"}
    assert graph.find_modules_that_directly_import("taskslam.slam.guest.loading") == programs
    for program in programs:
        assert graph.find_modules_that_directly_import(program) == set()
    methods = {module for module in graph.modules if module.startswith("taskslam.slam.methods")}
    for method in methods:
        assert graph.find_modules_that_directly_import(method) <= methods, method
