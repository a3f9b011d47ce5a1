from taskslam.report.markers import marker_icon, method_styles


def test_no_two_of_sixty_methods_look_alike():
    styles = method_styles([f"method {number}" for number in range(60)])
    assert len({(style.colour, style.shape) for style in styles.values()}) == 60


def test_a_hollow_marker_is_white_inside():
    style = method_styles(["a"])["a"]
    assert 'fill="#ffffff"' in str(marker_icon(style, "a", filled=False))
    assert f'fill="{style.colour}"' in str(marker_icon(style, "a"))
