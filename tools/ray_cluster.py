"""Ray on this one machine, with the processes of several: for tests and for `torture.py`."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator
from typing import Any
from unittest import mock

_STORE = 80 << 20  # bytes of an object store, the smallest that Ray takes
_SURROUNDINGS = {"RAY_USAGE_STATS_ENABLED": "0", "RAY_worker_niceness": "0"}  # or a busy machine would starve workers
_TRIES = 5  # to start a machine, where ours has other work
_NOTICES_SOON = {
    "health_check_period_ms": 300,
    "health_check_failure_threshold": 10,
    "health_check_initial_delay_ms": 0,
}


@contextlib.contextmanager
def ray_cluster() -> Iterator[Any]:
    """A head that drives nothing: a `ray.cluster_utils.Cluster`, to which machines are added."""
    from ray.cluster_utils import Cluster

    head = {"num_cpus": 0, "object_store_memory": _STORE, "include_dashboard": False, "_system_config": _NOTICES_SOON}
    with mock.patch.dict(os.environ, _SURROUNDINGS):
        cluster = Cluster(initialize_head=True, head_node_args=head)
        try:
            yield cluster
        finally:
            cluster.shutdown()


def add_machine(cluster: Any) -> Any:
    """One more, of one core; what `lose_machine` takes."""
    for _ in range(_TRIES - 1):
        with contextlib.suppress(Exception):  # "The current node timed out during startup", after 30 s of Ray's own
            return cluster.add_node(num_cpus=1, memory=4 << 30, object_store_memory=_STORE)
    return cluster.add_node(num_cpus=1, memory=4 << 30, object_store_memory=_STORE)


def lose_machine(cluster: Any, machine: Any) -> None:
    """Kill all of its processes at once."""
    cluster.remove_node(machine, allow_graceful=False)
