import pytest
from pydantic import BaseModel, ConfigDict, Field

from taskslam.errors import InputError
from taskslam.slam.option_settings import read_options


class Settings(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")
    resolution: float = Field(default=0.05, gt=0)
    levels: int = 2


def test_what_is_not_given_keeps_its_default() -> None:
    assert read_options(Settings, "painter", {"levels": 3}) == Settings(resolution=0.05, levels=3)


def test_an_unknown_option_is_named_with_its_neighbour() -> None:
    with pytest.raises(InputError, match=r"painter has no option 'resolutoin'. Did you mean 'resolution'"):
        read_options(Settings, "painter", {"resolutoin": 1})


def test_a_value_out_of_range_is_named() -> None:
    with pytest.raises(InputError, match=r"painter option resolution: .*greater than 0 \(got -1\)"):
        read_options(Settings, "painter", {"resolution": -1})
