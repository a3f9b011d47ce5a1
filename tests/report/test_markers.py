from taskslam.report.markers import CIRCLE, STAR, marker_icon, method_styles
from taskslam.report.palette import on_page


def test_no_two_of_sixty_methods_look_alike():
    styles = method_styles([f"method {number}" for number in range(60)])
    assert len({(style.colour, style.shape) for style in styles.values()}) == 60


def test_a_hollow_marker_is_white_inside():
    style = method_styles(["a"])["a"]
    assert 'fill="var(--paper)"' in str(marker_icon(style, "a", filled=False))
    assert f'fill="{on_page(style.colour)}"' in str(marker_icon(style, "a"))


def test_the_shape_says_which_sensor_a_method_sees_with():
    sensors = {"karto": "laser_scan", "hector": "laser_scan", "orb": "stereo_images", "truth": "true_pose"}
    styles = method_styles([*sensors, "unknown"], sensors)
    assert styles["karto"].shape == styles["hector"].shape == CIRCLE
    assert styles["truth"].shape == STAR
    assert styles["orb"].shape not in (CIRCLE, STAR)


def test_twelve_methods_of_one_sensor_and_sixteen_of_two_look_different():
    names = [f"lidar {number}" for number in range(16)]
    for sensors in (dict.fromkeys(names[:12], "laser_scan"), dict.fromkeys(names, "point_cloud")):
        styles = method_styles(list(sensors), sensors).values()
        assert len({(style.colour, style.shape) for style in styles}) == len(sensors)


def test_the_first_twelve_methods_differ_by_colour_alone():
    sensors = {f"m{number}": ("laser_scan", "point_cloud", "stereo_images")[number % 3] for number in range(12)}
    assert len({style.colour for style in method_styles(list(sensors), sensors).values()}) == 12


def test_a_star_has_ten_corners():
    style = method_styles(["truth"], {"truth": "true_pose"})["truth"]
    corners = str(marker_icon(style, "truth")).split('points="')[1].split('"')[0].split()
    assert len(corners) == 10
