"""Putting measurements of several topics into stamp order, and images into pairs, with bounded memory."""

from __future__ import annotations

import heapq
from collections import OrderedDict
from collections.abc import Iterator
from typing import Any

import numpy.typing as npt

from taskslam.datasets.dataset import order
from taskslam.measurements import NANOSECONDS, Measurement
from taskslam.skipped import Skipped

_WINDOW = NANOSECONDS  # messages may be recorded so much later than their stamps say, one topic against another
_SYNCHRONOUS = NANOSECONDS // 1000  # two images are one pair if they are this close
_MOST_WAITING = 32


def in_stamp_order(measurements: Iterator[Measurement], skipped: Skipped) -> Iterator[Measurement]:
    """The measurements sorted by `order`; one that is more than a second late is left out and counted."""
    heap: list[tuple[tuple[int, int], int, Measurement]] = []
    newest = released = -1
    for number, measurement in enumerate(measurements):
        if measurement.stamp < released:
            skipped.add("messages more than a second out of order")
            continue
        newest = max(newest, measurement.stamp)
        heapq.heappush(heap, (order(measurement), number, measurement))
        while heap[0][0][0] < newest - _WINDOW:
            released = heap[0][0][0]
            yield heapq.heappop(heap)[2]
    while heap:
        yield heapq.heappop(heap)[2]


class Pairing:
    """Finds the other image of a pair by its stamp; images that wait in vain are counted."""

    def __init__(self, skipped: Skipped) -> None:
        self._waiting: tuple[OrderedDict[int, npt.NDArray[Any]], ...] = (OrderedDict(), OrderedDict())
        self._skipped = skipped

    def add(self, eye: int, stamp: int, image: npt.NDArray[Any]) -> tuple[int, Any, Any] | None:
        """Add an image of camera 0 or 1; the pair that it completes: the stamp of camera 0, its image, the other."""
        others = self._waiting[1 - eye]
        partner = next((at for at in others if abs(at - stamp) <= _SYNCHRONOUS), None)
        if partner is None:
            mine = self._waiting[eye]
            mine[stamp] = image
            if len(mine) > _MOST_WAITING:
                mine.popitem(last=False)
                self._skipped.add("images without a partner")
            return None
        other = others.pop(partner)
        return (stamp, image, other) if eye == 0 else (partner, other, image)

    def end(self) -> None:
        """Count what is left without a partner."""
        if left := sum(map(len, self._waiting)):
            self._skipped.add("images without a partner", count=left)
