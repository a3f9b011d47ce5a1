import math

import pytest

from taskslam.errors import WorldError

QUARTER = math.pi / 2


def at(frame, pose="0 0 0 0 0 0"):
    return f"<pose relative_to='{frame}'>{pose}</pose>"


def centre(world, extent_of):
    box = extent_of(world.visual)
    return ((box[:3] + box[3:]) / 2).round(3).tolist()


def test_poses_of_model_link_and_visual_compose(site, link, extent_of):
    body = link(pose=f"<pose>1 0 0 0 0 {QUARTER}</pose>", visual="<pose>0 3 0 0 0 0</pose>")
    world = site.load(f"<model name='m'><pose>10 0 0 0 0 {QUARTER}</pose>{body}</model>")
    # link at (10, 1) turned by 180 degrees in all, so that its y points down
    assert centre(world, extent_of) == [10, -2, 0]


def test_relative_to_another_model(site, link, extent_of):
    body = (
        "<model name='base'><pose>5 0 0 0 0 0</pose><link name='l'/></model>"
        f"<model name='m'><pose relative_to='base'>1 2 0 0 0 0</pose>{link()}</model>"
    )
    assert centre(site.load(body, "1.7"), extent_of) == [6, 2, 0]


def test_relative_to_a_link_of_a_nested_model(site, link, extent_of):
    nested = "<model name='inner'><pose>0 3 0 0 0 0</pose><link name='tip'><pose>0 0 7 0 0 0</pose></link></model>"
    body = f"<model name='m'>{nested}{link(pose=at('inner::tip', '1 0 0 0 0 0'))}</model>"
    assert centre(site.load(body, "1.8"), extent_of) == [1, 3, 7]


def test_frame_elements_attach_and_chain(site, link, extent_of):
    frames = (
        "<link name='arm'><pose>2 0 0 0 0 0</pose></link>"
        "<frame name='a' attached_to='arm'><pose>0 1 0 0 0 0</pose></frame>"
        "<frame name='b'><pose relative_to='a'>0 0 4 0 0 0</pose></frame>"
    )
    body = f"<model name='m'>{frames}{link(pose=at('b'))}</model>"
    assert centre(site.load(body, "1.7"), extent_of) == [2, 1, 4]


def test_visual_may_be_relative_to_another_link(site, link, extent_of):
    body = (
        "<model name='m'><link name='other'><pose>0 0 5 0 0 0</pose></link>"
        f"{link(pose='<pose>9 9 9 0 0 0</pose>', visual=at('other', '1 0 0 0 0 0'))}</model>"
    )
    assert centre(site.load(body, "1.7"), extent_of) == [1, 0, 5]


def test_joint_stands_in_its_child(site, link, extent_of):
    joint = "<link name='door'><pose>3 0 0 0 0 0</pose></link><joint name='hinge' type='revolute'><parent>w</parent>"
    joint += "<child>door</child><pose>0 1 0 0 0 0</pose></joint>"
    body = f"<model name='m'>{joint}{link(pose=at('hinge'))}</model>"
    assert centre(site.load(body, "1.7"), extent_of) == [3, 1, 0]


def test_legacy_frame_attribute(site, link, extent_of):
    body = (
        "<model name='base'><pose frame=''>5 0 0 0 0 0</pose><link name='l'/></model>"
        f"<model name='m'><pose frame='base'>1 0 0 0 0 0</pose>{link()}</model>"
    )
    assert centre(site.load(body, "1.5"), extent_of) == [6, 0, 0]


def test_placement_frame_is_what_the_pose_places(site, link, extent_of):
    foot = f"<frame name='foot'><pose>0 0 -2 0 0 0</pose></frame>{link()}"
    body = f"<model name='m' placement_frame='foot'><pose>4 0 0 0 0 0</pose>{foot}</model>"
    assert centre(site.load(body, "1.8"), extent_of) == [4, 0, 2]


def test_poses_in_a_circle_are_refused(site, link):
    frames = "<frame name='a'><pose relative_to='b'/></frame><frame name='b'><pose relative_to='a'/></frame>"
    with pytest.raises(WorldError, match="depend on themselves: a -> b -> a"):
        site.load(f"<model name='m'>{frames}{link(pose=at('a'))}</model>", "1.7")


def test_unknown_frame_is_named(site, link):
    with pytest.raises(WorldError, match=r"model 'm' in .* relative to 'nowhere', but there is no such frame"):
        site.load(f"<model name='m'>{link(pose=at('nowhere'))}</model>", "1.7")
