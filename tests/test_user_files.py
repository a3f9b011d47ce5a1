"""Whatever a user writes is read, or refused in one sentence that names the file and the key."""

from contextlib import suppress
from pathlib import Path
from typing import Annotated, Literal

import pytest
import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from pydantic import BaseModel, ConfigDict, Field, model_validator

from taskslam.errors import InputError
from taskslam.user_files import Shipped, read_mapping, read_model, value_of


class Part(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class Wheel(Part):
    radius: Annotated[float, Field(gt=0, allow_inf_nan=False)]
    side: Literal["left", "right"] = Field(default="left", description="seen from behind")
    tread: float | Literal["none"] = "none"


class Motor(Part):
    power: float = Field(description="watts at the shaft")


class Cart(Part):
    name: str
    wheels: tuple[Wheel, ...]
    motors: dict[str, Motor] = {}
    spare: Wheel | None = None
    size: tuple[float, float] = (1.0, 1.0)

    @model_validator(mode="after")
    def _rolls(self):
        if len(self.wheels) == 1:
            raise ValueError("a cart on one wheel falls over")
        return self


def cart(tmp_path: Path, text: str | bytes) -> Cart:
    path = tmp_path / "cart.yaml"
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    return read_model(path, Cart, "cart", InputError)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("", "not keys with values but empty; expected the keys name, wheels, motors, spare, size"),
        ("- 1", "not keys with values but a list; expected the keys name, wheels, motors, spare, size"),
        ("cart", "not keys with values but a single value; expected the keys name, wheels, motors, spare, size"),
        ("name: a\nwheels: [", "not valid YAML: line 2: expected the node content, but found '<stream end>'"),
        ("name: a\nname: b", "not valid YAML: line 2: the key 'name' is given twice"),
        ("name: &n [*n]", "not valid YAML: line 1: an alias refers to what holds it"),
        ("name: !!python/object:os.system a", "not valid YAML: line 1: could not determine a constructor for the tag"),
        ("name: 2026-13-45", "not valid YAML: month must be in 1..12"),
        ("[" * 5000, "not valid YAML: nested too deeply"),
        ("name: \x01", "not valid YAML: unacceptable character #x0001"),
        (b"name: \xff", "cannot read the cart: not UTF-8 text"),
        (b"#" * (2 << 20), "larger than 1 MB; expected a file that describes the cart"),
        ("wheels: []", "the key 'name' is missing"),
        (
            "nmae: a\nwheels: []",
            "unknown key 'nmae'; expected one of name, wheels, motors, spare, size. Did you mean 'name'?",
        ),
        (
            "name: a\nwheels: []\ncolour: red",
            "unknown key 'colour'; expected one of name, wheels, motors, spare, size.",
        ),
        (
            "name: a\nwheels: [{radius: 1}, {raduis: 1}]",
            "unknown key 'wheels.1.raduis'; expected one of radius, side, tread. Did you mean 'radius'?",
        ),
        (
            "name: a\nwheels: []\nspare: {radius: 1, sied: left}",
            "unknown key 'spare.sied'; expected one of radius, side, tread. Did you mean 'side'?",
        ),
        ("name: a\nwheels: []\nmotors: {front: {}}", "the key 'motors.front.power' is missing: watts at the shaft"),
        ("name: a\nwheels: [{radius: 0}]", "wheels.0.radius: should be greater than 0 (got 0)"),
        ("name: a\nwheels: [{radius: .nan}]", "wheels.0.radius: should be a finite number (got nan)"),
        (
            "name: a\nwheels: [{radius: 1, side: top}]",
            "wheels.0.side: should be 'left' or 'right' (got 'top')",
        ),
        (
            "name: a\nwheels: [{radius: 1, tread: deep}]",
            "wheels.0.tread: should be a valid number, unable to parse string as a number, or should be 'none'",
        ),
        ("name: a\nwheels: []\nsize: [1]", "size: expected more than 1 entries (got [1])"),
        ("name: a\nwheels: [{radius: 1}]", "a cart on one wheel falls over"),
        ('name: a\nwheels: []\n"two\\nlines": 3', "unknown key 'two lines'; expected one of"),
        ("name: a\nwheels: [3]", "wheels.0: should hold the keys radius, side, tread (got 3)"),
        ("name: a\nwheels: 3", "wheels: should be a list (got 3)"),
        ("name: a\nwheels: []\nmotors: 3", "motors: should be keys with values (got 3)"),
        (
            "name: a\nwheels: []\ntread: 3",
            "unknown key 'tread'; expected one of name, wheels, motors, spare, size. Did you mean 'spare.tread'?",
        ),
    ],
)
def test_what_is_wrong_is_said_in_one_sentence_with_file_and_key(tmp_path, text, sentence):
    with pytest.raises(InputError) as caught:
        cart(tmp_path, text)
    assert str(caught.value).startswith(f"{tmp_path / 'cart.yaml'}: {sentence}")
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < len(str(tmp_path)) + 300


def test_a_sound_file_is_read_with_its_aliases_and_merges(tmp_path):
    text = "%YAML:1.0\n---\nname: a\nwheels: [&w {radius: 1}, *w, {<<: *w, side: right}]\n"
    read = cart(tmp_path, text)
    assert [(wheel.radius, wheel.side) for wheel in read.wheels] == [(1, "left"), (1, "left"), (1, "right")]


@pytest.mark.parametrize("step", ["[{}]", "{{<<: [{}]}}", "{{k: [{}]}}"])
def test_aliases_that_multiply_are_refused_before_they_fill_memory(step):
    lines = ["a0: &a0 {x: 1}"]
    lines += [f"a{i}: &a{i} " + step.format(", ".join([f"*a{i - 1}"] * 9)) for i in range(1, 30)]
    with pytest.raises(InputError, match="aliases multiply to more than a million values"):
        value_of("\n".join(lines), "bomb", InputError)


def test_a_missing_file_a_folder_and_an_impossible_name_are_sentences(tmp_path):
    for path, why in ((tmp_path / "no", "No such file"), (tmp_path, "found a folder"), (Path("a\0b"), "null byte")):
        with pytest.raises(InputError, match=f"cannot read the cart: .*{why}"):
            read_mapping(path, "cart", InputError, "the keys of a cart")


def test_a_shipped_name_is_guessed_and_a_file_wins_by_its_ending(tmp_path):
    shipped = Shipped("robot", "taskslam.robot", "presets", InputError)
    assert "turtlebot2" in shipped.names()
    with pytest.raises(
        InputError, match=r"robot 'turtlebot' is neither shipped \(.*\) nor .*Did you mean 'turtlebot2'"
    ):
        shipped.load("turtlebot", Cart)
    with pytest.raises(InputError, match="robot turtlebot2: "):
        shipped.load("turtlebot2", Cart)
    (tmp_path / "mine.yml").write_text("name: a\nwheels: []")
    assert shipped.load(str(tmp_path / "mine.yml"), Cart).name == "a"


_INTEGERS = st.integers(-(2**63), 2**63 - 1)
_KEYS = st.sampled_from(["name", "wheels", "radius", "side", "motors", "spare", "power", "size", "raduis"])
_VALUES = st.recursive(
    st.none() | st.booleans() | _INTEGERS | st.floats() | st.text(max_size=5) | st.dates(),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(_KEYS | _INTEGERS | st.booleans(), inner, max_size=4),
    max_leaves=12,
)


@settings(max_examples=200, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    _VALUES.map(lambda value: yaml.safe_dump(value).encode())
    | st.text("a:[]{}&*!<-\n '\"%?|1.", max_size=60).map(str.encode)
    | st.binary(max_size=60)
)
def test_anything_is_a_cart_or_one_sentence(tmp_path, content):
    try:
        cart(tmp_path, content)
    except InputError as error:
        told = str(error)
    else:
        return
    assert told.startswith(f"{tmp_path / 'cart.yaml'}: ")
    assert "\n" not in told


@settings(max_examples=200, deadline=None)
@given(_VALUES)
def test_what_is_written_is_what_is_read(value):
    text = yaml.safe_dump(value)
    assert repr(value_of(text, "here", InputError)) == repr(yaml.safe_load(text))


@settings(max_examples=200, deadline=None)
@given(
    st.from_regex(r"!!(int|float|bool|timestamp|binary|omap|pairs|set|merge|value|null) ['\"]?[0-9a-z:_ -]{0,8}['\"]?")
)
def test_no_tag_of_yaml_lets_another_error_out(text):
    with suppress(InputError):
        value_of(text, "here", InputError)


@pytest.mark.parametrize("text", ["a: 9223372036854775808", "a: -9223372036854775809", "a: [0x" + "f" * 300 + "]"])
def test_an_integer_of_more_than_64_bits_is_refused(text):
    with pytest.raises(InputError, match="line 1: an integer of more than 64 bits"):
        value_of(text, "here", InputError)


def test_a_megabyte_of_brackets_and_values_is_refused_in_seconds():
    with pytest.raises(InputError, match="more than 100000 values and brackets"):
        value_of("a: [" + "1,[]," * 200_000 + "]", "here", InputError)
