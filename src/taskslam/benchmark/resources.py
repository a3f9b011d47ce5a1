"""What a run may take of a machine: cores and memory, for all runs of a campaign or for those of single methods."""

from __future__ import annotations

from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field

GIGABYTE = 1 << 30
Cores = Annotated[int, Field(ge=1, le=1024)]
Memory = Annotated[float, Field(gt=0, le=65536)]  # GB


class _Part(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class Share(_Part):
    """What one run takes. memory: GB, of all its processes together."""

    cores: Cores = 1
    memory: Memory = 2.0

    @property
    def memory_bytes(self) -> int:
        """The same in bytes."""
        return round(self.memory * GIGABYTE)


class PartialShare(_Part):
    """What a method's runs take where that is not what others do."""

    cores: Cores | None = None
    memory: Memory | None = None


class Resources(Share):
    """cores, memory: of a run; methods: by name, where one takes something else."""

    methods: dict[str, PartialShare] = {}

    def of(self, method: str) -> Share:
        """What a run of this method takes."""
        own = self.methods.get(method, PartialShare())
        return Share(cores=own.cores or self.cores, memory=own.memory or self.memory)
