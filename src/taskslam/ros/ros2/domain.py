"""A domain of ROS 2 for one run alone: on this machine, with shared memory that is large enough, and cleared after it.

Ports of a domain: 7400 + 250 times its number, and 249 more (DDSI-RTPS, 9.6.1.1). Names in /dev/shm, and that a
segment's lock is held for as long as its process lives: Fast DDS, SharedMemSegment and RobustExclusiveLock.
"""

from __future__ import annotations

import fcntl
import os
import random
import re
import socket
from collections import defaultdict
from contextlib import suppress
from pathlib import Path

from taskslam.errors import InputError
from taskslam.processes.confine import SHARED_MEMORY

_FIRST_PORT, _PORTS = 7400, 250
_NUMBERS = range(1, 102)  # below the ports that Linux gives to anybody
_HERE = "127.0.0.1"
_SEGMENT = 64 << 20  # bytes for what a process says; with Fast DDS's own half megabyte images are lost
_LEAST_FREE = 3 * _SEGMENT  # a node's, the bridge's, and room for queues
_PROFILE = f"""<?xml version="1.0" encoding="UTF-8" ?>
<profiles xmlns="http://www.eprosima.com/XMLSchemas/fastRTPS_Profiles">
  <transport_descriptors>
    <transport_descriptor>
      <transport_id>shared_memory</transport_id>
      <type>SHM</type>
      <segment_size>{_SEGMENT}</segment_size>
    </transport_descriptor>
    <transport_descriptor>
      <transport_id>network</transport_id>
      <type>UDPv4</type>
      <interfaceWhiteList><address>127.0.0.1</address></interfaceWhiteList>
    </transport_descriptor>
  </transport_descriptors>
  <participant profile_name="taskslam" is_default_profile="true">
    <rtps>
      <userTransports>
        <transport_id>shared_memory</transport_id>
        <transport_id>network</transport_id>
      </userTransports>
      <useBuiltinTransports>false</useBuiltinTransports>
      <builtin>
        <discovery_config>
          <initialAnnouncements>
            <count>50</count>
            <period><nanosec>100000000</nanosec></period>
          </initialAnnouncements>
        </discovery_config>
      </builtin>
    </rtps>
  </participant>
</profiles>
"""
_OURS = re.compile(r"(?:sem\.)?((?:fastdds|fastrtps)_(?:[0-9a-f]+|port\d+))(?:_el|_sl|_mutex)?")


class Domain:
    """A domain that no other run has, nor anybody else on this machine, until `close`.

    variables: for every process that shall speak in it. folder: where its profile and logs lie. Raises InputError:
    there is none left, or no shared memory.
    """

    def __init__(self, folder: Path) -> None:
        _check_room()
        self.number, self._held = _reserved()
        self._before = abandoned()
        profile = folder / "fastdds.xml"
        profile.write_text(_PROFILE, encoding="utf-8")
        self.variables = {
            "ROS_DOMAIN_ID": str(self.number),
            "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
            "FASTDDS_DEFAULT_PROFILES_FILE": str(profile),
            "ROS_LOG_DIR": str(folder / "log"),
            "ROS_HOME": str(folder),
        }

    def close(self) -> None:
        """Give it back, and remove what its processes left in shared memory. They have ended before. Idempotent."""
        for name in abandoned() - self._before:
            with suppress(OSError):
                (SHARED_MEMORY / name).unlink()
        self._held.close()


def _reserved() -> tuple[int, socket.socket]:
    """A number and the port that holds it: the domain's last, which no process of ROS comes to."""
    numbers = list(_NUMBERS)
    random.SystemRandom().shuffle(numbers)
    for number in numbers:
        first = _FIRST_PORT + _PORTS * number
        held = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            held.bind((_HERE, first + _PORTS - 1))
            with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
                probe.bind(("", first))  # where everybody in the domain listens
        except OSError:
            held.close()
            continue
        return number, held
    raise InputError(f"no domain of ROS 2 is free on this machine: {len(numbers)} are in use")


def _check_room() -> None:
    """Raises InputError: processes would be killed by a full /dev/shm, without a word, while they write there."""
    with suppress(OSError):
        held = os.statvfs(SHARED_MEMORY)
        if (free := held.f_bavail * held.f_frsize) < _LEAST_FREE:
            raise InputError(
                f"{SHARED_MEMORY} has {free >> 20} MB left; expected {_LEAST_FREE >> 20} for a ROS 2 node and its"
                " bridge (containers: docker run --shm-size=1g)"
            )


def abandoned() -> set[str]:
    """Files in shared memory by Fast DDS for which no process lives any more, of anybody's."""
    named: dict[str, list[str]] = defaultdict(list)
    with suppress(OSError):
        for name in os.listdir(SHARED_MEMORY):  # noqa: PTH208 names are all that is asked for
            if found := _OURS.fullmatch(name):
                named[found[1]].append(name)
    return {name for segment, names in named.items() if _is_abandoned(segment) for name in names}


def _is_abandoned(segment: str) -> bool:
    """Whether no process holds a lock of a segment any more."""
    for lock in (SHARED_MEMORY / f"{segment}_el", SHARED_MEMORY / f"{segment}_sl"):
        with suppress(FileNotFoundError):
            descriptor = os.open(lock, os.O_RDONLY)
            try:
                fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError:
                return False
            finally:
                os.close(descriptor)
    return True
