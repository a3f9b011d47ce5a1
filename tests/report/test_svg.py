from taskslam.report.svg import Svg, number


def test_text_and_attributes_are_escaped():
    svg = Svg(1, 1, 'a "label" <b>')
    svg.text(0, 0, "<script>", class_='x" onload="y')
    text = str(svg.markup())
    assert "<script>" not in text
    assert "<b>" not in text
    assert 'onload="y' not in text


def test_numbers_are_short():
    assert [number(value) for value in (1.0, -0.001, 0.125, 10, 100.0)] == ["1", "0", "0.12", "10", "100"]
