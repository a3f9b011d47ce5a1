def test_world_light_with_everything(site, link):
    light = (
        "<light name='lamp' type='spot'><pose>1 2 3 0 0 0</pose>"
        "<diffuse>0.5 0.6 0.7 1</diffuse><direction>0 1 -1</direction>"
        "<attenuation><range>20</range><constant>0.3</constant><linear>0.01</linear><quadratic>0.03</quadratic></attenuation>"
        "</light>"
    )
    (lamp,) = site.load(f"<model name='m'>{link()}</model>{light}").lights
    assert (lamp.name, lamp.type, lamp.direction) == ("lamp", "spot", (0, 1, -1))
    assert lamp.pose[:3, 3].tolist() == [1, 2, 3]
    assert lamp.diffuse == (0.5, 0.6, 0.7)
    assert (lamp.attenuation_range, lamp.attenuation) == (20, (0.3, 0.01, 0.03))


def test_light_on_a_link_moves_with_it(site, link):
    lamp = (
        "<link name='l'><pose>0 0 2 0 0 0</pose><light name='lamp' type='point'><pose>1 0 0 0 0 0</pose></light></link>"
    )
    world = site.load(f"<model name='m'><pose>5 0 0 0 0 0</pose>{link('body')}{lamp}</model>")
    assert world.lights[0].pose[:3, 3].tolist() == [6, 0, 2]


def test_state_moves_a_light_and_switches_are_obeyed(site, link):
    lights = "<light name='a' type='point'/><light name='b' type='point'><light_on>false</light_on></light>"
    state = "<state world_name='default'><light name='a'><pose>0 0 9 0 0 0</pose></light></state>"
    world = site.load(f"<model name='m'>{link()}</model>{lights}{state}")
    assert [(light.name, light.pose[2, 3]) for light in world.lights] == [("a", 9)]


def test_scene_colours(site, link):
    scene = "<scene><ambient>0.1 0.2 0.3 1</ambient><background>0.4 0.5 0.6</background></scene>"
    world = site.load(f"{scene}<model name='m'>{link()}</model>")
    assert world.ambient == (0.1, 0.2, 0.3)
    assert world.background == (0.4, 0.5, 0.6)


def test_unknown_type_costs_no_more_than_the_light(site, link):
    world = site.load(f"<model name='m'>{link()}</model><light name='x' type='laser'/>")
    assert (len(world.visual), world.lights) == (12, ())
    (warning,) = world.warnings
    assert warning.startswith("Damaged and left out: 1 light. First: The type of light 'x' ")
    assert warning.endswith("is 'laser'; expected directional, point, spot.")
