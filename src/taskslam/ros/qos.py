"""Quality of service, as ROS 2 has it: what a topic's two ends want of each other, and where that does not fit."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field


class Quality(BaseModel):
    """Of one end of a topic. depth: how many messages are kept, 0 for all."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    reliability: Literal["reliable", "best_effort"] = "reliable"
    durability: Literal["volatile", "transient_local"] = "volatile"
    depth: Annotated[int, Field(ge=0)] = 100


LATCHED = Quality(durability="transient_local", depth=1)


def mismatch(offered: Quality, asked: Quality) -> str:
    """Why a reader that asks for this hears nothing of a publisher that offers that; empty where it does."""
    if (offered.reliability, asked.reliability) == ("best_effort", "reliable"):
        return "it is published best_effort and read reliable"
    if (offered.durability, asked.durability) == ("volatile", "transient_local"):
        return "it is published volatile and read transient_local"
    return ""
