from taskslam.report.names import short_names


def test_a_short_name_stays_and_a_long_one_loses_its_middle():
    assert short_names(["karto", "a_very_long_method"], 9) == ["karto", "a_ver…hod"]


def test_names_that_differ_stay_different():
    names = [f"the same beginning {number:03d} the same end" for number in range(120)]
    short = short_names(names, 8)
    assert len(set(short)) == len(names)
    assert max(map(len, short)) <= 8
