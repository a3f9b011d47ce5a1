"""A campaign as a file says it: a matrix of runs, what is left out of it, and what is driven besides.

    name: tuning
    scenarios: [house, office]
    methods: [karto, {name: karto, options: {do_loop_closing: false}}, orb_slam3]
    robots: [turtlebot2, turtlebot2_vga15]
    exclude: [{method: karto, robot: turtlebot2_vga15}]
    resources: {cores: 1, memory: 2, methods: {orb_slam3: {cores: 2, memory: 4}}}

What is not said has a default: both modes, three seeds, five rounds, the latency of each method's card.
"""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, model_validator

from taskslam.benchmark.resources import Resources
from taskslam.errors import InputError, did_you_mean
from taskslam.mode import Mode
from taskslam.user_files import Shipped

Name = Annotated[str, Field(min_length=1, max_length=1000)]
Seed = Annotated[int, Field(ge=0)]
SEEDS = (0, 1, 2)
"""Of a campaign that names none: three describe a method; a verdict between two needs more."""

_SHIPPED = Shipped("campaign", "taskslam.benchmark.campaign", "campaigns", InputError)


class _Part(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class MethodChoice(_Part):
    """A method in one of its ways."""

    name: Name
    options: dict[str, Any] = {}


class Selection(_Part):
    """Runs of which all that is said here is true. A key holds a value, or a list of which one must hold."""

    scenario: Name | tuple[Name, ...] = ()
    method: Name | tuple[Name, ...] = ()
    options: dict[str, Any] | None = None
    mode: Mode | tuple[Mode, ...] = ()
    seed: Seed | tuple[Seed, ...] = ()
    latency: Name | tuple[Name, ...] = ()
    robot: Name | tuple[Name, ...] = ()

    @property
    def said(self) -> dict[str, tuple[Any, ...]]:
        """The values that are allowed, by the keys that are given."""
        keys = ("scenario", "method", "mode", "seed", "latency", "robot")
        given = {key: getattr(self, key) for key in keys}
        return {key: value if isinstance(value, tuple) else (value,) for key, value in given.items() if value != ()}


class SingleRun(_Part):
    """A run that is driven besides the matrix. robot: None for the scenario's own."""

    scenario: Name
    method: Name
    options: dict[str, Any] = {}
    mode: Mode = Mode.WITHOUT_MAP
    seed: Seed = 0
    latency: Name = "fixed"
    robot: Name | None = None


class Campaign(_Part):
    """What is driven.

    scenarios: names or files, in a list, or in several by the name of each set. methods: names, or names with options.
    seeds: of each run. rounds: those that count. latencies: how estimates are delayed, `fixed`, `zero` or
    `measured x 4` (a robot's processor four times slower than this machine's). robots: presets or files; empty for each
    scenario's own. settings: keys of every scenario, `protocol.pause=2`. exclude: what of the matrix is not driven;
    runs: what is driven besides. sealed: with noise that no method can guess. resources: what a run takes.
    """

    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9_.-]+$", max_length=100)]
    scenarios: tuple[Name, ...] | dict[str, tuple[Name, ...]] = ()
    methods: tuple[Name | MethodChoice, ...] = ()
    modes: Annotated[tuple[Mode, ...], Field(min_length=1)] = tuple(Mode)
    seeds: Annotated[tuple[Seed, ...], Field(min_length=1)] = SEEDS
    rounds: Annotated[int, Field(ge=1)] = 5
    latencies: Annotated[tuple[Name, ...], Field(min_length=1)] = ("fixed",)
    robots: tuple[Name, ...] = ()
    settings: tuple[Name, ...] = ()
    exclude: tuple[Selection, ...] = ()
    runs: tuple[SingleRun, ...] = ()
    sealed: bool = False
    resources: Resources = Resources()

    def scenarios_of(self, sets: tuple[str, ...] = ()) -> tuple[str, ...]:
        """The scenarios of some sets, or of all. Raises InputError: there is no such set."""
        if not isinstance(self.scenarios, dict):
            if sets:
                raise InputError(f"campaign {self.name}: its scenarios are one list, without sets such as '{sets[0]}'")
            return self.scenarios
        for name in sets:
            if name not in self.scenarios:
                hint = did_you_mean(name, self.scenarios)
                known = ", ".join(self.scenarios)
                raise InputError(f"campaign {self.name} has no scenarios '{name}'; expected one of {known}.{hint}")
        chosen = [self.scenarios[name] for name in sets or self.scenarios]
        return tuple(dict.fromkeys(name for names in chosen for name in names))

    @model_validator(mode="after")
    def _exclusions_leave_something_out(self) -> Campaign:
        known: dict[str, tuple[Any, ...]] = {
            "scenario": self.scenarios_of(),
            "method": tuple(choice.name for choice in self.choices),
            "mode": self.modes,
            "seed": self.seeds,
            "latency": self.latencies,
            "robot": self.robots,
        }
        for exclusion in self.exclude:
            if not exclusion.said and exclusion.options is None:
                raise ValueError("exclude: an entry without a key would leave out everything")
            for key, values in exclusion.said.items():
                for value in values:
                    if value not in known[key]:
                        listed = [str(one) for one in known[key]]
                        raise ValueError(
                            f"exclude: the {key} '{value}' is not in the campaign; expected one of"
                            f" {', '.join(listed) or 'none'}.{did_you_mean(str(value), listed)}"
                        )
        return self

    @property
    def choices(self) -> tuple[MethodChoice, ...]:
        """The methods of the matrix, all with their options."""
        return tuple(MethodChoice(name=one) if isinstance(one, str) else one for one in self.methods)


def load_campaign(reference: str) -> Campaign:
    """A campaign by shipped name or YAML file.

    Raises:
        InputError: unknown name, unreadable file, unknown key.
    """
    return _SHIPPED.load(reference, Campaign)
