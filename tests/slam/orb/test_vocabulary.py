import io

import numpy as np
import pytest

from taskslam.errors import InputError
from taskslam.slam.orb.vocabulary import Vocabulary, check_text, load, save, shipped_vocabulary, write_text

TREE = Vocabulary(
    branches=2,
    depth=6,
    parent=np.array([0, 0, 1, 1], np.int32),
    descriptor=np.arange(4 * 32, dtype=np.uint8).reshape(4, 32),
    images_with=np.array([0, 8, 2, 1], np.int32),
    images=8,
)


def test_words_are_weighted_by_how_rare_they_are():
    np.testing.assert_array_equal(TREE.is_word, [False, True, True, True])
    np.testing.assert_allclose(TREE.weights(), [0.0, 0.0, np.log(4), np.log(8)])


def test_the_text_is_what_orb_slam3_reads(tmp_path):
    write_text(TREE, tmp_path / "voc.txt")
    lines = (tmp_path / "voc.txt").read_bytes().split(b"\n")
    assert lines[0] == b"2 6 0 0"
    assert len(lines) == 5  # and none that is empty
    parent, leaf, *descriptor, weight = lines[3].split()
    assert (parent, leaf) == (b"1", b"1")
    assert list(map(int, descriptor)) == list(range(64, 96))
    assert float(weight) == pytest.approx(np.log(4))
    check_text(tmp_path / "voc.txt")


def test_saved_and_loaded_it_is_the_same():
    file = io.BytesIO()
    save(TREE, file)
    file.seek(0)
    again = load(file)
    assert (again.branches, again.depth, again.images) == (2, 6, 8)
    for name in ("parent", "descriptor", "images_with"):
        np.testing.assert_array_equal(getattr(again, name), getattr(TREE, name))


def test_the_shipped_vocabulary_is_a_tree_of_words_that_tell_places_apart():
    shipped = shipped_vocabulary()
    nodes = np.arange(1, len(shipped.parent) + 1)
    assert (shipped.parent < nodes).all()
    children = np.bincount(shipped.parent)
    assert children.max() <= shipped.branches == 10
    level = np.zeros(len(nodes) + 1, int)
    for node, parent in zip(nodes, shipped.parent, strict=True):
        level[node] = level[parent] + 1
    words = shipped.is_word
    # ORB-SLAM3 matches features within nodes of the second level: every word needs one above it.
    assert level[1:][words].min() >= 3
    assert level.max() <= shipped.depth
    assert 5_000 < words.sum() < 100_000
    assert np.median(shipped.weights()[words]) > 2.0


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (None, "cannot read the vocabulary: No such file"),
        (b"", "expected the text format of ORBvoc.txt"),
        (b"\x93NUMPY\x01\x00v\x00", "expected the text format"),
        (b"10 6 0 0\n0 0 1 2 3\n", "expected the text format"),
        (b"10 60 0 0\n0 1 " + b"7 " * 32 + b"1.0", "expected the text format"),
    ],
)
def test_a_file_that_is_no_vocabulary_is_refused_before_orb_slam3_ends_on_it(tmp_path, text, words):
    path = tmp_path / "voc.txt"
    if text is not None:
        path.write_bytes(text)
    with pytest.raises(InputError, match=r"voc\.txt") as caught:
        check_text(path)
    assert words in str(caught.value)
