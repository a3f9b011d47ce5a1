"""A bag of binary words as DBoW2 keeps it: a tree of ORB descriptors, as arrays and as ORB-SLAM3's text file.

The vocabulary that ships with this package (`shipped_vocabulary`) was trained on images of the built-in worlds by
`tools/train_orb_vocabulary.py`; how is in `vocabulary_training.py`. The authors' own `ORBvoc.txt` is 139 MB and has its
own licence; whoever has it can use it instead.

Source of tree, weights and format: Galvez-Lopez and Tardos, "Bags of binary words for fast place recognition in image
sequences", IEEE Transactions on Robotics 28(5), 2012, and the reader of the text format in ORB-SLAM3.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import IO

import numpy as np
import numpy.typing as npt

from taskslam.errors import InputError
from taskslam.reading import LARGEST_ARCHIVE, arrays_in, open_file

DESCRIPTOR_BYTES = 32
# As ORBvoc.txt: ORB-SLAM3 compares features that meet in a node 4 levels above the deepest possible word.
DEPTH = 6
_L1_NORM, _TF_IDF = 0, 0
_MOST_BRANCHES, _MOST_LEVELS = 20, 10

Bytes = npt.NDArray[np.uint8]
Ints = npt.NDArray[np.int32]


@dataclass(frozen=True)
class Vocabulary:
    """A tree in breadth-first order without its root; node i + 1 is row i, node 0 the root.

    branches: most children of a node; depth: most levels below the root. parent: (N,) int32 node, always before its
    children. descriptor: (N, 32) uint8. images_with: (N,) int32 images of `images` in which the word occurs; 0 in nodes
    that are no words.
    """

    branches: int
    depth: int
    parent: Ints
    descriptor: Bytes
    images_with: Ints
    images: int

    @property
    def is_word(self) -> npt.NDArray[np.bool_]:
        """(N,) whether a node has no children."""
        leaf = np.ones(len(self.parent) + 1, bool)
        leaf[self.parent] = False
        return leaf[1:]

    def weights(self) -> npt.NDArray[np.float64]:
        """(N,) inverse document frequency of words, ln(images / images with it) (sec. III of the paper); else 0."""
        found = np.maximum(self.images_with, 1)
        weight = np.array([math.log(self.images / n) for n in found.tolist()])
        weight[~self.is_word | (self.images_with == 0)] = 0.0
        return weight


def write_text(vocabulary: Vocabulary, path: Path) -> None:
    """Write ORB-SLAM3's text format: a line of `branches depth scoring weighting`, then a line for each node.

    Raises:
        OSError: the file cannot be written.
    """
    lines = [f"{vocabulary.branches} {vocabulary.depth} {_L1_NORM} {_TF_IDF}"]
    rows = zip(
        vocabulary.parent.tolist(),
        vocabulary.is_word.tolist(),
        vocabulary.descriptor.tolist(),
        vocabulary.weights().tolist(),
        strict=True,
    )
    lines += [
        f"{parent} {int(word)} {' '.join(map(str, descriptor))} {weight:.9g}"
        for parent, word, descriptor, weight in rows
    ]
    # No newline at the end: the reader would take what follows it for one more node.
    path.write_text("\n".join(lines), encoding="ascii")


def save(vocabulary: Vocabulary, file: IO[bytes]) -> None:
    """Write the vocabulary as a compressed archive of plain arrays."""
    np.savez_compressed(
        file,
        allow_pickle=False,
        shape=np.array([vocabulary.branches, vocabulary.depth, vocabulary.images], np.int64),
        parent=vocabulary.parent,
        descriptor=vocabulary.descriptor,
        images_with=vocabulary.images_with,
    )


def load(file: IO[bytes]) -> Vocabulary:
    """The inverse of `save`."""
    arrays = arrays_in(file, LARGEST_ARCHIVE)
    branches, depth, images = (int(number) for number in arrays["shape"])
    return Vocabulary(branches, depth, arrays["parent"], arrays["descriptor"], arrays["images_with"], images)


def shipped_vocabulary() -> Vocabulary:
    """The vocabulary that comes with this package."""
    with (resources.files("taskslam.slam.orb") / "vocabulary.npz").open("rb") as file:
        return load(file)


def check_text(path: Path) -> None:
    """Look at the head of a user's vocabulary: ORB-SLAM3 ends the process on what it cannot read.

    Raises:
        InputError: not readable, or not in ORB-SLAM3's text format.
    """
    with open_file(path, "vocabulary", InputError) as file:
        head, node = file.readline(200), file.readline(1000)
    shape = head.split()
    good = len(shape) == 4 and all(part.isdigit() and len(part) < 4 for part in shape)
    if good:
        branches, depth, scoring, weighting = map(int, shape)
        good = 2 <= branches <= _MOST_BRANCHES and 1 <= depth <= _MOST_LEVELS and scoring <= 5 and weighting <= 3
    if not good or len(node.split()) != 3 + DESCRIPTOR_BYTES:
        raise InputError(
            f"vocabulary {path}: expected the text format of ORBvoc.txt: a line such as '10 6 0 0', then lines of "
            f"parent, leaf, {DESCRIPTOR_BYTES} bytes and weight; got {head[:40]!r}"
        )
