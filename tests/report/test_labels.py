from hypothesis import given
from hypothesis import strategies as st

from taskslam.report.labels import place_labels

AREA = (0.0, 0.0, 300.0, 300.0)
marks = st.lists(st.tuples(st.floats(0, 300), st.floats(0, 300)), max_size=12)


def test_a_label_stands_right_of_its_mark_if_it_can():
    assert place_labels([(100.0, 100.0)], ["karto"], 8.0, 10.0, AREA) == [(111.0, 103.5)]


def test_at_the_right_edge_it_stands_left():
    ((x, _),) = place_labels([(295.0, 100.0)], ["karto"], 8.0, 10.0, AREA)
    assert x + 5 * 5.9 < 295 - 8


def test_without_room_there_is_no_label():
    assert place_labels([(10.0, 10.0)], ["karto"], 8.0, 10.0, (0.0, 0.0, 20.0, 20.0)) == [None]


@given(marks)
def test_labels_hide_neither_marks_nor_one_another(places):
    size, texts = 10.0, [f"m{index:03}" for index in range(len(places))]
    boxes = [(x - 8, y - 8, x + 8, y + 8) for x, y in places]
    for at, text in zip(place_labels(places, texts, 8.0, size, AREA), texts, strict=True):
        if at is None:
            continue
        x, y = at
        box = (x, y - 0.85 * size, x + 0.59 * size * len(text), y + 0.25 * size)
        assert not any(
            box[0] < other[2] and other[0] < box[2] and box[1] < other[3] and other[1] < box[3] for other in boxes
        )
        boxes.append(box)
