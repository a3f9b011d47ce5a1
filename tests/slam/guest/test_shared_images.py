import mmap
import os
import zlib

import numpy as np
import pytest

from taskslam.measurements import StereoImages
from taskslam.processes.messages import WireError
from taskslam.slam.guest import host as host_module
from taskslam.slam.guest.shared_images import SLOTS, ImageSlots, ImageWindow

PERIOD = 33_333_333


@pytest.fixture
def camera(rig):
    return rig.stereo.model_copy(update={"width": 64, "height": 48})


@pytest.fixture
def ends(camera):
    slots = ImageSlots([camera])
    yield slots, ImageWindow(os.dup(slots.fileno), slots.slot_size)
    slots.close()


def pair(seed, shape=(48, 64)):
    rng = np.random.default_rng(seed)
    return {side: rng.integers(0, 256, shape, dtype=np.uint8) for side in ("left", "right")}


def test_pixels_arrive_and_may_be_written(ends):
    slots, window = ends
    sent = pair(1)
    got = window.arrays(slots.put(sent))
    for side, image in sent.items():
        np.testing.assert_array_equal(got[side], image)
        assert got[side].flags.writeable


def test_images_of_any_type_and_number_arrive(ends):
    slots, window = ends
    rng = np.random.default_rng(3)
    sent = {
        "depth": rng.random((20, 50), np.float32),
        "millimetres": rng.integers(0, 1 << 16, (7, 9), dtype=np.uint16),
        "color": rng.integers(0, 256, (11, 13, 3), dtype=np.uint8),
    }
    got = window.arrays(slots.put(sent))
    assert [(name, image.dtype) for name, image in got.items()] == [(name, image.dtype) for name, image in sent.items()]
    for name, image in sent.items():
        np.testing.assert_array_equal(got[name], image)


def test_a_slot_is_the_childs_until_nothing_refers_to_its_pixels(ends):
    slots, window = ends
    got = window.arrays(slots.put(pair(1)))
    row = got["left"][3]
    kept = row.copy()
    del got
    assert window.released() == []
    others = [window.arrays(slots.put(pair(n))) for n in range(SLOTS - 1)]
    assert slots.put(pair(9)) is None
    np.testing.assert_array_equal(row, kept)
    del row
    released = window.released()
    assert len(released) == 1
    slots.release(released)
    assert slots.put(pair(9)) is not None
    assert len(others) == SLOTS - 1


def test_what_does_not_fit_takes_the_pipe(ends):
    slots, _ = ends
    assert slots.put(pair(1, (49, 64))) is None
    assert slots.put({"left": np.zeros((48, 64, 3), np.float32)}) is None


def test_a_slot_that_the_child_has_not_cannot_be_handed_back(ends):
    slots, _ = ends
    shared = slots.put(pair(1))
    for wrong in (shared["slot"] + 1, "0", True, None):
        with pytest.raises(WireError, match="not handed out"):
            slots.release([wrong])
    slots.release([shared["slot"]])
    with pytest.raises(WireError, match="not handed out"):
        slots.release([shared["slot"]])


def test_a_message_cannot_point_outside_the_memory(ends):
    _, window = ends
    outside = [("|u1", [4800, 64]), ("<f4", [48, 64, 2]), ("|O", [1]), ("|u1", [-1])]
    wrong = [{"slot": 0, "images": [["left", *image]]} for image in outside]
    for shared in ({"slot": SLOTS, "images": []}, {"slot": -1, "images": []}, {"slot": 0}, {}, *wrong):
        with pytest.raises(WireError):
            window.arrays(shared)


def test_the_child_cannot_shrink_the_memory_under_the_host(ends):
    slots, _ = ends
    with pytest.raises(OSError, match="not permitted"):
        os.ftruncate(slots.fileno, mmap.PAGESIZE)


def crc(measurement):
    text = zlib.crc32(measurement.left.tobytes(), zlib.crc32(measurement.right.tobytes()))
    return (text ^ hash(measurement.left.shape)) % 10_000


@pytest.mark.parametrize("options", [{}, {"keep": 9}, {"slow": 0.01}], ids=["drops", "keeps", "slow"])
@pytest.mark.parametrize("way", ["memory", "pipe"])
def test_every_pair_arrives_bit_for_bit_either_way(host_of, rig, monkeypatch, way, options):
    if way == "pipe":
        monkeypatch.setattr(host_module, "_image_slots", lambda cameras: None)
    host = host_of("cameras:Looks", options)
    host.start()
    shape = (rig.stereo.height, rig.stereo.width)
    expected, seen = [], []
    for n in range(12):
        measurement = StereoImages(n * PERIOD, **pair(n, shape if n % 5 else (40, 30)))
        expected.append(crc(measurement))
        host.feed(measurement)
        seen += [e.T_start_base[0, 3] for e in host.collect(n * PERIOD)]
    assert seen == expected
