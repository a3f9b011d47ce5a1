"""Files that people write: YAML read with bounds, checked against a pydantic model, refused in one sentence.

    study = read_model(path, Study, "study", TrajectoryError)
    robot = Shipped("robot", "taskslam.robot", "presets", RobotError).load("turtlebot2", Robot)

A sentence names the file, the key and what was expected there; the caller names the error that carries it.
"""

from __future__ import annotations

import reprlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, is_dataclass
from importlib import resources
from pathlib import Path
from types import NoneType, UnionType
from typing import Annotated, Any, TypeVar, Union, get_args, get_origin

import yaml
from pydantic import BaseModel, ValidationError

from taskslam.errors import TaskSlamError, did_you_mean
from taskslam.reading import LARGEST_WRITTEN_BY_HAND, read_text

Model = TypeVar("Model", bound=BaseModel)

_MOST_VALUES = 1 << 20  # with every alias written out
_MOST_EVENTS = 60_000  # of the parser, which is slow: some seconds
_MOST_FAULTS = 100  # that are looked at for the one to tell
_MERGE = "tag:yaml.org,2002:merge"


def read_model(path: Path, model: type[Model], what: str, error: type[TaskSlamError]) -> Model:
    """What a YAML file describes. what: its noun, such as `setup`. Raises `error` naming the file and the key."""
    return check(model, read_mapping(path, what, error, keys_of(model)), str(path), error)


def read_mapping(path: Path, what: str, error: type[TaskSlamError], keys: str) -> dict[str, Any]:
    """The keys of a YAML file of at most 1 MB. keys: those that are expected, in words.

    Raises `error`: unreadable, too large, not UTF-8, or as `mapping_of` does.
    """
    return mapping_of(read_text(path, what, error, LARGEST_WRITTEN_BY_HAND), str(path), error, keys)


def mapping_of(text: str, where: str, error: type[TaskSlamError], keys: str) -> dict[str, Any]:
    """The keys of a YAML text. where, keys: as in the sentence.

    Raises `error`: not YAML, a key given twice, aliases that refer to themselves or multiply beyond all bounds, or
    something else than keys and values.
    """
    content = value_of(text, where, error)
    if not isinstance(content, dict):
        found = "a list" if isinstance(content, list) else "empty" if content is None else "a single value"
        raise error(f"{where}: not keys with values but {found}; expected {keys}")
    return content


def value_of(text: str, where: str, error: type[TaskSlamError]) -> Any:
    """Any YAML value, such as that of `--set a.b=VALUE`. Raises `error` as `mapping_of` does."""
    if text.startswith("%YAML"):  # OpenCV writes a directive that is not YAML 1.1
        text = text.partition("\n")[2]
    try:
        loader = _BoundedLoader(text)
        node = loader.get_single_node()
        if node is None:
            return None
        _size(node, {})
        return loader.construct_document(node)
    # Beside YAMLError, the constructor lets these out: for a date without such a day, `!!int ""`, 5000 digits.
    except (yaml.YAMLError, RecursionError, ValueError, LookupError, AttributeError, TypeError) as fault:
        why = str(fault).partition("\n")[0]
        if isinstance(fault, yaml.MarkedYAMLError) and fault.problem_mark is not None:
            why = f"line {fault.problem_mark.line + 1}: {fault.problem}"
        elif isinstance(fault, RecursionError):
            why = "nested too deeply"
        raise error(f"{where}: not valid YAML: {' '.join(why.split())[:200]}") from None


def check(model: type[Model], content: Mapping[str, Any], where: str, error: type[TaskSlamError]) -> Model:
    """The content as a model. Raises `error` with `where` and the first complaint."""
    try:
        return model.model_validate(content)
    except ValidationError as fault:
        raise error(f"{where}: {complaint(fault, model)}") from None


def complaint(error: ValidationError, model: type[BaseModel] = BaseModel) -> str:
    """What is wrong, in one sentence with its key; an unknown key that looks like a known one comes first.

    model: whose keys are known. A missing key is told with its field's description, if it has one.
    """
    faults = error.errors(include_url=False)[:_MOST_FAULTS]
    unknown = [_unknown(model, fault["loc"]) for fault in faults if fault["type"] == "extra_forbidden"]
    guessed = [words for words in unknown if words.endswith("?")]
    first, parents = faults[0], faults[0]["loc"][:-1]
    if guessed or first["type"] == "extra_forbidden":
        return (guessed or unknown)[0]
    key, inside = _follow(model, first["loc"])
    got = "" if isinstance(first["input"], dict) else f" (got {reprlib.repr(first['input'])})"
    if first["type"] == "missing" and isinstance(last := first["loc"][-1], int):
        return f"{'.'.join(map(str, parents))}: expected more than {last} entries{got}"
    if first["type"] == "missing":
        holder = _follow(model, parents)[1]
        why = holder.model_fields[str(last)].description if holder and last in holder.model_fields else None
        return f"the key '{key}' is missing" + (f": {why}" if why else "")
    # A value that may be of several kinds has a fault for each.
    alike = dict.fromkeys(_words(fault, inside) for fault in faults if _follow(model, fault["loc"])[0] == key)
    wrong = ", or ".join(alike)
    return f"{key}: {wrong}{got}" if key else wrong


def keys_of(model: type[BaseModel]) -> str:
    """`the keys a, b, c`."""
    return f"the keys {', '.join(model.model_fields)}"


@dataclass(frozen=True)
class Shipped:
    """YAML files in a folder of this package; a user names one of them, or a file of their own.

    what: the noun, such as `scenario`.
    """

    what: str
    package: str
    folder: str
    error: type[TaskSlamError]

    def names(self) -> list[str]:
        """Those that ship with the package, sorted."""
        folder = resources.files(self.package) / self.folder
        return sorted(Path(file.name).stem for file in folder.iterdir() if file.name.endswith(".yaml"))

    def load(self, reference: str | Path, model: type[Model]) -> Model:
        """What a shipped name or a .yaml file describes. Raises `error`, with a guess at what was meant."""
        content, where = self.read(reference, model)
        return check(model, content, where, self.error)

    def read(self, reference: str | Path, model: type[BaseModel]) -> tuple[dict[str, Any], str]:
        """The keys as they were written, and where: as in the sentences of errors. Raises `error`."""
        text, where = self.text(reference)
        return mapping_of(text, where, self.error, keys_of(model)), where

    def text(self, reference: str | Path) -> tuple[str, str]:
        """The file as it was written, and where: as in the sentences of errors. Raises `error`."""
        if Path(reference).suffix in {".yaml", ".yml"}:
            text = read_text(Path(reference), self.what, self.error, LARGEST_WRITTEN_BY_HAND)
            where = str(reference)
        elif str(reference) in (known := self.names()):
            file = resources.files(self.package) / self.folder / f"{reference}.yaml"
            text, where = file.read_text(encoding="utf-8"), f"{self.what} {reference}"
        else:
            raise self.error(
                f"{self.what} '{reference}' is neither shipped ({', '.join(known)}) nor a .yaml file."
                f"{did_you_mean(str(reference), known)}"
            )
        return text, where


class _BoundedLoader(yaml.SafeLoader):
    """Stops where a text holds more than anybody writes by hand."""

    _events = 0

    def get_event(self) -> yaml.Event:
        """The next part of the text. Raises YAMLError where it is one too many."""
        event: yaml.Event = super().get_event()  # type: ignore[no-untyped-call]
        self._events += 1
        if self._events > _MOST_EVENTS:
            raise yaml.YAMLError(f"more than {_MOST_EVENTS} values and brackets")
        return event

    def _integer(self, node: yaml.ScalarNode) -> int:
        number = self.construct_yaml_int(node)
        if not -(2**63) <= number < 2**63:
            raise yaml.MarkedYAMLError(problem="an integer of more than 64 bits", problem_mark=node.start_mark)
        return number


_BoundedLoader.add_constructor("tag:yaml.org,2002:int", _BoundedLoader._integer)


def _size(node: yaml.Node, known: dict[int, int]) -> int:
    """How many values there are with every alias written out. Raises MarkedYAMLError where it is too many."""
    size = known.get(id(node))
    if size is None:
        known[id(node)] = 0  # under way
        size = 1 + sum(_size(child, known) for child in _children(node))
        known[id(node)] = size
    if not 0 < size <= _MOST_VALUES:
        problem = "aliases multiply to more than a million values" if size else "an alias refers to what holds it"
        raise yaml.MarkedYAMLError(problem=problem, problem_mark=node.start_mark)
    return size


def _children(node: yaml.Node) -> list[yaml.Node]:
    if isinstance(node, yaml.MappingNode):
        seen = set()
        for key, _ in node.value:
            if isinstance(key, yaml.ScalarNode) and key.tag != _MERGE:
                if (key.tag, key.value) in seen:
                    problem = f"the key '{key.value[:60]}' is given twice"
                    raise yaml.MarkedYAMLError(problem=problem, problem_mark=key.start_mark)
                seen.add((key.tag, key.value))
        return [part for pair in node.value for part in pair]
    return node.value if isinstance(node, yaml.SequenceNode) else []


def _unknown(model: type[BaseModel], location: Sequence[int | str]) -> str:
    key, inside = _follow(model, location[:-1])
    fields, wrong = inside.model_fields if inside else {}, _shown(location[-1])
    deeper = {
        f"{name}.{wrong}": field
        for name, field in fields.items()
        if _is_model(part := _plain(field.annotation)) and wrong in part.model_fields
    }
    hint = did_you_mean(next(iter(deeper), wrong), deeper or fields)
    listed = f"; expected one of {', '.join(fields)}" if fields else ""
    return f"unknown key '{'.'.join(filter(None, (key, wrong)))}'{listed}.{hint}"


def _words(fault: Mapping[str, Any], inside: type[BaseModel] | None) -> str:
    if fault["type"] in ("model_type", "dict_type"):
        return f"should hold {keys_of(inside)}" if inside else "should be keys with values"
    if fault["type"] in ("tuple_type", "list_type"):
        return "should be a list"
    return str(fault["msg"]).removeprefix("Value error, ").removeprefix("Input ")


def _follow(model: type[BaseModel], location: Sequence[int | str]) -> tuple[str, type[BaseModel] | None]:
    """The dotted key at a location of pydantic's, without its names for kinds of values; and the model found there."""
    keys: list[str] = []
    kind: Any = model
    for part in location:
        kind = _plain(kind)
        if _is_model(kind):
            field = kind.model_fields.get(str(part))
            kind = field.annotation if field else None
        elif get_origin(kind) is tuple and isinstance(part, int):
            inner = get_args(kind)
            kind = inner[0] if inner[-1] is Ellipsis else inner[min(part, len(inner) - 1)]
        elif get_origin(kind) in (list, dict):
            kind = get_args(kind)[-1]
        elif kind is not None and not is_dataclass(kind):
            continue
        else:
            kind = None
        keys.append(_shown(part))
    kind = _plain(kind)
    return ".".join(keys), kind if _is_model(kind) else None


def _shown(key: int | str) -> str:
    return " ".join(str(key).split())[:60]


def _is_model(kind: Any) -> bool:
    return isinstance(kind, type) and issubclass(kind, BaseModel)


def _plain(kind: Any) -> Any:
    """A kind without its annotations and without None; of several, the one that holds others."""
    while True:
        if get_origin(kind) is Annotated:
            kind = get_args(kind)[0]
        elif get_origin(kind) in (Union, UnionType):
            kinds = [_plain(each) for each in get_args(kind) if each is not NoneType]
            return next((each for each in kinds if get_args(each) or _is_model(each)), kinds[0])
        else:
            return kind
