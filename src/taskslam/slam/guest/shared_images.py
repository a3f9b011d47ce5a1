"""Images travel to the method in shared memory: copied once into a slot, of which only the number goes down the pipe.

The host makes a memory file of a few slots, each as large as all images that a camera of the rig takes at once, seals
its size and passes its descriptor to the child. A slot belongs to the child from the message that names it until the
child says that nothing refers to its pixels any more; a method may therefore keep an image as long as it likes. While
no slot is free, and for images of an unexpected size, the pixels go through the pipe as any other array: nothing
depends on which way they came.
"""

from __future__ import annotations

import fcntl
import math
import mmap
import os
import weakref
from collections.abc import Iterable

import numpy as np

from taskslam.processes.messages import DTYPES, Arrays, Header, WireError
from taskslam.robot import Part

SLOTS = 4  # one in work, one waiting, one being written, one that a method keeps for comparison
_ALIGNMENT = 64
_SEALS = fcntl.F_SEAL_SHRINK | fcntl.F_SEAL_GROW | fcntl.F_SEAL_SEAL  # a shrunk file would kill who writes into it

Declared = list[tuple[str, str, tuple[int, ...]]]


class ImageSlots:
    """The host's end. cameras: whose images travel; fileno: descriptor of the memory file, for the child to inherit.

    Raises:
        OSError: the kernel gives no memory file.
    """

    def __init__(self, cameras: Iterable[Part], slots: int = SLOTS) -> None:
        self._slot_size = max(sum(map(_aligned, camera.image_bytes())) for camera in cameras)
        self._free = list(range(slots))
        self._taken: set[int] = set()
        self.fileno = os.memfd_create("taskslam-images", os.MFD_CLOEXEC | os.MFD_ALLOW_SEALING)
        try:
            os.ftruncate(self.fileno, self._slot_size * slots)
            fcntl.fcntl(self.fileno, fcntl.F_ADD_SEALS, _SEALS)
            self._memory = mmap.mmap(self.fileno, self._slot_size * slots)
        except OSError:
            os.close(self.fileno)
            raise

    @property
    def slot_size(self) -> int:
        """Bytes of one slot."""
        return self._slot_size

    def put(self, arrays: Arrays) -> dict[str, object] | None:
        """Copy images into a free slot; what the message says of it, or None if they must take the pipe."""
        need = sum(_aligned(array.nbytes) for array in arrays.values())
        if not self._free or need > self._slot_size:
            return None
        slot = self._free.pop()
        self._taken.add(slot)
        at = slot * self._slot_size
        declared: Declared = []
        for name, array in arrays.items():
            np.ndarray(array.shape, array.dtype, self._memory, at)[...] = array
            declared.append((name, array.dtype.str, array.shape))
            at += _aligned(array.nbytes)
        return {"slot": slot, "images": declared}

    def release(self, slots: Iterable[object]) -> None:
        """Take slots back that the child is done with.

        Raises:
            WireError: a slot that the child did not have.
        """
        for slot in slots:
            if type(slot) is not int or slot not in self._taken:
                raise WireError(f"image slot {slot!r:.80} handed back, which was not handed out")
            self._taken.remove(slot)
            self._free.append(slot)

    def close(self) -> None:
        """Give the memory back; the child may still have its own mapping."""
        self._memory.close()
        os.close(self.fileno)


class ImageWindow:
    """The child's end, on the inherited descriptor, which is closed."""

    def __init__(self, fileno: int, slot_size: int) -> None:
        self._mapping = mmap.mmap(fileno, os.fstat(fileno).st_size)
        self._memory = memoryview(self._mapping)
        self._slot_size = slot_size
        self._released: list[int] = []
        os.close(fileno)

    def arrays(self, shared: Header) -> Arrays:
        """The arrays of a message that names a slot: writable, in place.

        Raises:
            WireError: it names bytes that the slot does not have.
        """
        try:
            slot, declared = shared["slot"], shared["images"]
            begin = slot * self._slot_size
            images = [(str(name), DTYPES[dtype], tuple(shape)) for name, dtype, shape in declared]
            sizes = [math.prod(shape) * dtype.itemsize for _, dtype, shape in images]
        except (KeyError, TypeError, ValueError) as error:
            raise WireError(f"not an image slot: {error}") from error
        if (
            min(sizes, default=0) < 0
            or begin < 0
            or sum(map(_aligned, sizes)) > self._slot_size
            or begin + self._slot_size > len(self._memory)
        ):
            raise WireError(f"images of {[shape for *_, shape in images]} do not fit into slot {slot}")
        # Every image, and whatever a method cuts out of one, is a view of `pixels` and keeps it alive.
        pixels = np.frombuffer(self._memory[begin : begin + self._slot_size], np.uint8)
        weakref.finalize(pixels, self._released.append, slot).atexit = False
        arrays: Arrays = {}
        at = 0
        for (name, dtype, shape), size in zip(images, sizes, strict=True):
            arrays[name] = pixels[at : at + size].view(dtype).reshape(shape)
            at += _aligned(size)
        return arrays

    def close(self) -> None:
        """Let go of the memory, for a method that gets no images."""
        self._memory.release()
        self._mapping.close()

    def released(self) -> list[int]:
        """Slots that nothing refers to any more, each told once."""
        done: list[int] = []
        while self._released:
            done.append(self._released.pop())
        return done


def _aligned(size: int) -> int:
    return -(-size // _ALIGNMENT) * _ALIGNMENT
