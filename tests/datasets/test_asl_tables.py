from contextlib import suppress

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from taskslam.datasets.asl_tables import read_rows, read_sensor_file
from taskslam.errors import DatasetError


@settings(max_examples=150, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.binary(max_size=300) | st.text("0123456789,.-#\r\n e", max_size=300).map(str.encode))
def test_any_bytes_are_rows_in_order_or_one_sentence(tmp_path, content):
    path = tmp_path / "data.csv"
    path.write_bytes(content)
    stamps: list[int] = []
    with suppress(DatasetError):
        stamps.extend(row.stamp for row in read_rows(path))
    assert stamps == sorted(set(stamps))


@settings(max_examples=150, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.binary(max_size=200) | st.text("a: [{}]-&*!|>\n'\"%1", max_size=100).map(str.encode))
def test_any_bytes_are_keys_or_one_sentence(tmp_path, content):
    path = tmp_path / "sensor.yaml"
    path.write_bytes(content)
    with pytest.raises(DatasetError, match=r"sensor\.yaml"):
        read_sensor_file(path).mount()


def test_a_folder_is_no_table(tmp_path):
    with pytest.raises(DatasetError, match="cannot read the table: found a folder"):
        next(read_rows(tmp_path))
