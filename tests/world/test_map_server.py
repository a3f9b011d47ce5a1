import os
import zlib
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from PIL import Image

from taskslam.errors import DiskFullError, FloorPlanError
from taskslam.geometry import SE2
from taskslam.world.floor_plan import FREE, OCCUPIED, UNKNOWN, FloorPlan
from taskslam.world.map_server import load_floor_plan, save_floor_plan

DATA = Path(os.environ.get("TASKSLAM_DATA", Path(__file__).parents[3] / "shared" / "data"))
needs_maps = pytest.mark.skipif(not (DATA / "maps").is_dir(), reason=f"no maps at {DATA} (set TASKSLAM_DATA)")


def write_map(folder: Path, pixels: bytes = b"P5\n3 2\n255\n\x00\xfe\xcd\xfe\x00\xcd", /, **changes) -> Path:
    (folder / "plan.pgm").write_bytes(pixels)
    keys = {
        "image": "plan.pgm",
        "resolution": 0.1,
        "origin": "[1.0, 2.0, 0.0]",
        "negate": 0,
        "occupied_thresh": 0.65,
        "free_thresh": 0.196,
    }
    keys |= changes
    path = folder / "plan.yaml"
    path.write_text("".join(f"{key}: {value}\n" for key, value in keys.items() if value is not None))
    return path


def test_the_top_row_of_the_image_is_the_highest_y(tmp_path):
    plan = load_floor_plan(write_map(tmp_path))
    assert plan.cells.tolist() == [[FREE, OCCUPIED, UNKNOWN], [OCCUPIED, FREE, UNKNOWN]]
    assert plan.at(1.05, 2.15) == OCCUPIED
    assert plan.at(1.05, 2.05) == FREE


def test_negate_swaps_black_and_white(tmp_path):
    plan = load_floor_plan(write_map(tmp_path, negate=1))
    assert plan.cells.tolist() == [[OCCUPIED, FREE, OCCUPIED], [FREE, OCCUPIED, OCCUPIED]]


def test_205_is_free_only_when_asked(tmp_path):
    assert UNKNOWN in load_floor_plan(write_map(tmp_path)).cells
    assert UNKNOWN not in load_floor_plan(write_map(tmp_path), free_205=True).cells


def test_205_stays_occupied_in_a_negated_map(tmp_path):
    assert load_floor_plan(write_map(tmp_path, negate=1), free_205=True).at(1.25, 2.05) == OCCUPIED


def test_origin_yaw_turns_the_grid(tmp_path):
    plan = load_floor_plan(write_map(tmp_path, origin="[1.0, 2.0, 1.5707963267948966]"))
    # column 1 of row 0 lies 0.1 to 0.2 m along the grid's x axis, which is the map's y axis
    assert plan.at(0.95, 2.15) == OCCUPIED
    assert plan.at(0.95, 2.05) == FREE


def test_plain_pgm_with_comments_equals_binary(tmp_path):
    binary = load_floor_plan(write_map(tmp_path))
    plain = load_floor_plan(write_map(tmp_path, b"P2 # made by hand\n3 2 # size\n255\n0 254 205 # top\n254 0\n205\n"))
    assert np.array_equal(plain.cells, binary.cells)


def test_sixteen_bit_pgm_is_scaled(tmp_path):
    image = np.array([[0, 65278, 52685], [65278, 0, 52685]], ">u2")
    plan = load_floor_plan(write_map(tmp_path, b"P5 3 2 65535\n" + image.tobytes()))
    assert plan.cells.tolist() == [[FREE, OCCUPIED, UNKNOWN], [OCCUPIED, FREE, UNKNOWN]]


@pytest.mark.parametrize("mode", ["L", "RGB", "P", "1"])
def test_png_of_any_colour_type(tmp_path, mode):
    Image.fromarray(np.array([[0, 255]], np.uint8)).convert(mode).save(tmp_path / "plan.png")
    assert load_floor_plan(write_map(tmp_path, image="plan.png")).cells.tolist() == [[OCCUPIED, FREE]]


def test_scale_mode_reads_transparent_as_unknown(tmp_path):
    pixels = np.array([[[0, 0, 0, 255], [128, 128, 128, 255], [0, 0, 0, 0]]], np.uint8)
    Image.fromarray(pixels).save(tmp_path / "plan.png")
    plan = load_floor_plan(write_map(tmp_path, image="plan.png", mode="scale"))
    assert plan.cells.tolist() == [[OCCUPIED, FREE, UNKNOWN]]


def test_raw_mode_reads_percent(tmp_path):
    plan = load_floor_plan(write_map(tmp_path, b"P5 4 1 255\n\x00\x64\x32\xff", mode="raw"))
    assert plan.cells.tolist() == [[FREE, OCCUPIED, FREE, UNKNOWN]]


def test_an_exponent_that_yaml_takes_for_text_is_a_number(tmp_path):
    assert load_floor_plan(write_map(tmp_path, resolution="5e-2")).resolution == 0.05


def test_an_absolute_image_path_and_unknown_keys_are_fine(tmp_path):
    write_map(tmp_path)
    path = write_map(tmp_path, image=tmp_path / "plan.pgm", map_type="grid")
    assert load_floor_plan(path).cells.shape == (2, 3)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"image": "absent.pgm"}, r"absent\.pgm: cannot read the image of .*plan\.yaml: No such file"),
        ({"image": None}, "'image' is missing"),
        ({"image": "."}, "found a folder"),
        ({"image": '"a\\0b"'}, "null byte"),
        ({"resolution": None}, "'resolution' is missing"),
        ({"resolution": -0.1}, r"resolution: should be greater than or equal to 0.000001 \(got -0.1\)"),
        ({"resolution": ".nan"}, "resolution: should be a finite number"),
        ({"resolution": "fine"}, r"resolution: .*number \(got 'fine'\)"),
        ({"resolution": "true"}, r"resolution: should be a number \(got True\)"),
        ({"origin": None}, "'origin' is missing"),
        ({"origin": "[1, 2]"}, r"origin: expected more than 2 entries \(got \[1, 2\]\)"),
        ({"origin": "[1, 2, .inf]"}, r"origin\.2: should be a finite number"),
        ({"occupied_thresh": 0.1}, "occupied_thresh 0.1 is below free_thresh 0.196"),
        ({"free_thresh": 65}, "free_thresh: should be less than or equal to 1"),
        ({"negate": "maybe"}, r"negate: .*boolean.*'maybe'"),
        ({"mode": "fancy"}, "mode: should be 'trinary', 'scale' or 'raw'"),
    ],
)
def test_a_wrong_key_is_named_in_one_sentence(tmp_path, changes, message):
    path = write_map(tmp_path, **changes)
    with pytest.raises(FloorPlanError, match=message) as caught:
        load_floor_plan(path)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("image", "message"),
    [
        (b"P5\n3 2\n255\n\x00\xfe\xcd", "truncated: 3 x 2 pixels promised, 3 found"),
        (b"P5\n3", "ends before its height"),
        (b"", "ends before its magic number"),
        (b"P5\n3 0\n255\n", "broken header: 3 x 0"),
        (b"P5\n3 -2\n255\n", "height is b'-2'"),
        (b"P5\n3 99999999999\n255\n", "height is"),
        (b"P7\n1 1\n255\n\x00\x00\x00", "expected a grey map"),
        (b"P2\n2 1\n255\n1 x\n", "a pixel is b'x'"),
        (b"P2\n2 1\n15\n1 16\n", "above the stated maximum 15"),
        (b"\x89PNG\r\n\x1a\nbroken", "not a whole picture"),
    ],
)
def test_a_broken_image_is_refused(tmp_path, image, message):
    with pytest.raises(FloorPlanError, match=message):
        load_floor_plan(write_map(tmp_path, image))


@pytest.mark.parametrize("text", ["", "just words", "- 1\n- 2", "image: [unclosed", "\x00", "[" * 5000])
def test_a_yaml_that_is_no_map_is_refused(tmp_path, text):
    path = tmp_path / "plan.yaml"
    path.write_text(text)
    with pytest.raises(FloorPlanError, match=r"plan\.yaml: not"):
        load_floor_plan(path)


def test_a_missing_yaml_is_named(tmp_path):
    with pytest.raises(FloorPlanError, match=r"absent\.yaml: cannot read the floor plan: No such file"):
        load_floor_plan(tmp_path / "absent.yaml")


def test_a_plan_that_cannot_be_saved_is_infrastructure(tmp_path, full_disk):
    plan = FloorPlan(np.zeros((1, 1), np.uint8), 0.1, SE2())
    with pytest.raises(DiskFullError, match="cannot be written"):
        save_floor_plan(plan, tmp_path / "absent" / "plan.yaml")
    with full_disk(), pytest.raises(DiskFullError, match="cannot be written"):
        save_floor_plan(plan, tmp_path / "plan.yaml", "png")
    assert list(tmp_path.iterdir()) == []


number = st.floats(-1e6, 1e6)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=60)
@given(
    cells=arrays(np.uint8, st.tuples(st.integers(1, 9), st.integers(1, 9)), elements=st.sampled_from([0, 100, 255])),
    resolution=st.floats(1e-6, 100.0),
    origin=st.tuples(number, number, number),
    image=st.sampled_from(["pgm", "png"]),
)
def test_a_saved_plan_comes_back_bit_for_bit(tmp_path, cells, resolution, origin, image):
    plan = FloorPlan(cells, resolution, SE2(*origin))
    save_floor_plan(plan, tmp_path / "plan.yaml", image)
    again = load_floor_plan(tmp_path / "plan.yaml")
    assert np.array_equal(again.cells, plan.cells)
    assert (again.resolution, again.origin) == (plan.resolution, plan.origin)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=100)
@given(st.binary(max_size=60))
def test_any_bytes_give_a_plan_or_a_floor_plan_error(tmp_path, junk):
    path = write_map(tmp_path, b"P5\n3 2\n255\n"[: 3 + len(junk) % 9] + junk)
    refused = ""
    try:
        plan = load_floor_plan(path)
    except FloorPlanError as error:
        refused = str(error)
    assert "plan.pgm" in refused if refused else plan.cells.size > 0


@needs_maps
@pytest.mark.parametrize(
    ("name", "shape", "free_area"),
    [
        ("aws_small_house", (118, 194), 152),
        ("aws_small_warehouse", (213, 143), 231),
        ("aws_hospital", (574, 255), 1137),
        ("fourth_floor_gazebo", (655, 920), 2119),
    ],
)
def test_the_published_plans_load_and_their_start_lies_in_free_floor(name, shape, free_area):
    """Sizes, start poses and connected free areas (m^2) of protocol 6.1 and 6.2."""
    from scipy import ndimage

    plan = load_floor_plan(DATA / "maps" / f"{name}.yaml", free_205=name == "fourth_floor_gazebo")
    assert plan.cells.shape == shape
    start = {"aws_hospital": (0.0, 10.0), "fourth_floor_gazebo": (-40.0, 14.0)}.get(name, (0.0, 0.0))
    regions, _ = ndimage.label(plan.cells == FREE)
    row, column = plan.cells_of(np.array([start]))[0]
    assert plan.cells[row, column] == FREE
    area = np.count_nonzero(regions == regions[row, column]) * plan.resolution**2
    assert area == pytest.approx(free_area, rel=0.02)


def test_a_picture_of_88_million_pixels_is_refused_before_it_is_decoded(tmp_path):
    path = write_map(tmp_path)
    image = next(tmp_path.glob("*.pgm"))
    image.write_bytes(b"P5\n9400 9400\n255\n" + b"\0" * 100)
    with pytest.raises(FloorPlanError, match="9400 x 9400 pixels; expected at most 33554432"):
        load_floor_plan(path)
    rows = zlib.compress(b"\0" * 9401 * 9400)
    size = (9400).to_bytes(4, "big") * 2
    chunks = [(b"IHDR", size + b"\x08\0\0\0\0"), (b"IDAT", rows), (b"IEND", b"")]
    summed = [
        len(data).to_bytes(4, "big") + kind + data + zlib.crc32(kind + data).to_bytes(4, "big") for kind, data in chunks
    ]
    image.write_bytes(b"\x89PNG\r\n\x1a\n" + b"".join(summed))
    with pytest.raises(FloorPlanError, match="9400 x 9400 px; expected at most 33554432"):
        load_floor_plan(path)


@pytest.mark.parametrize(
    ("suffix", "mode"),
    [("bmp", "L"), ("bmp", "RGB"), ("tiff", "L"), ("tiff", "I;16"), ("gif", "L"), ("ppm", "RGB"), ("webp", "RGB"),
     ("png", "L"), ("jpeg", "L")],
)  # fmt: skip
def test_pictures_of_any_common_format_are_plans(tmp_path, suffix, mode):
    grey = np.random.default_rng(1).choice(np.array([0, 205, 254], np.uint8), (12, 16)).repeat(8, 0).repeat(8, 1)
    image = Image.fromarray(grey.astype(np.uint16) * 257) if mode == "I;16" else Image.fromarray(grey).convert(mode)
    image.save(tmp_path / f"plan.{suffix}", **({"lossless": True} if suffix == "webp" else {}))
    Image.fromarray(grey).save(tmp_path / "reference.pgm")
    read = load_floor_plan(write_map(tmp_path, image=f"plan.{suffix}"))
    expected = load_floor_plan(write_map(tmp_path, image="reference.pgm"))
    assert np.mean(read.cells != expected.cells) <= (0.02 if suffix == "jpeg" else 0)


@pytest.mark.parametrize("magic", ["P1", "P4"])
def test_bitmaps_are_plans(tmp_path, magic):
    pixels = b"P1\n3 1\n1 0 1\n" if magic == "P1" else b"P4\n3 1\n\xa0"
    assert load_floor_plan(write_map(tmp_path, pixels)).cells.tolist() == [[OCCUPIED, FREE, OCCUPIED]]


@pytest.mark.parametrize("mode", ["Trinary", "SCALE", "Raw"])
def test_a_mode_is_known_in_any_letters(tmp_path, mode):
    expected = load_floor_plan(write_map(tmp_path, mode=mode.lower()))
    assert np.array_equal(load_floor_plan(write_map(tmp_path, mode=mode)).cells, expected.cells)


def test_tabs_and_a_home_folder_are_read_as_map_server_reads_them(tmp_path, monkeypatch):
    monkeypatch.setenv("HOME", str(tmp_path))
    path = write_map(tmp_path, image="~/plan.pgm")
    path.write_text(path.read_text().replace("resolution: ", "resolution:\t"))
    assert load_floor_plan(path).cells.shape == (2, 3)
