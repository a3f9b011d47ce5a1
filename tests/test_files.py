import pytest

from taskslam.files import write_whole


@pytest.mark.parametrize("content", ["ümlaut\n", "ümlaut\n".encode(), iter(["üml", "", "aut\n"])])
def test_text_bytes_and_pieces_write_the_same_file(tmp_path, content):
    write_whole(tmp_path / "a", content)
    assert (tmp_path / "a").read_bytes() == "ümlaut\n".encode()


def test_a_failure_between_pieces_leaves_the_old_file(tmp_path):
    def pieces():
        yield "new"
        raise OSError(28, "No space left on device")

    write_whole(tmp_path / "a", "old")
    with pytest.raises(Exception, match="No space left"):
        write_whole(tmp_path / "a", pieces())
    assert (tmp_path / "a").read_text() == "old"
    assert [path.name for path in tmp_path.iterdir()] == ["a"]
