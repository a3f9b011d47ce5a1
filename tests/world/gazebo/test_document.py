import pytest

from taskslam.errors import WorldError
from taskslam.world.loading import load_world

BOMB = """<?xml version="1.0"?><!DOCTYPE lolz [<!ENTITY a "lol"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;">]>
<sdf version="1.6"><world name="w">&b;</world></sdf>"""


def test_entity_bomb_is_refused_in_one_sentence(site):
    path = site.file("worlds/bomb.world", BOMB)
    with pytest.raises(WorldError, match=r"bomb\.world declares XML entities") as caught:
        load_world(path)
    assert "\n" not in str(caught.value)


def test_entity_bomb_in_a_mesh_is_refused(site):
    site.file("worlds/bomb.dae", BOMB)
    mesh = "<geometry><mesh><uri>bomb.dae</uri></mesh></geometry>"
    with pytest.raises(WorldError, match=r"bomb\.dae declares XML entities"):
        site.load(f"<model name='m'><link name='l'><visual name='v'>{mesh}</visual></link></model>")


def test_malformed_xml_names_the_file_and_the_place(site):
    path = site.file("worlds/broken.world", "<sdf version='1.6'><world></sdf>")
    with pytest.raises(WorldError, match=r"broken\.world is not well-formed XML: .*line 1"):
        load_world(path)


@pytest.mark.parametrize("version", ["1.2", "0.9"])
def test_versions_before_1_3_are_refused(site, link, version):
    with pytest.raises(WorldError, match=rf"SDF version '{version}'; expected 1.3 to 1.12"):
        site.load(f"<model name='m'>{link()}</model>", version)


@pytest.mark.parametrize("version", ["1.13", "2.0", "latest", ""])
def test_unknown_versions_are_tried_with_a_warning(site, link, version):
    world = site.load(f"<model name='m'>{link()}</model>", version)
    assert len(world.visual) == 12
    assert world.warnings == (f"test.world is SDF version '{version}': read as 1.12, the newest that is known.",)


@pytest.mark.parametrize("version", ["1.3", "1.4", "1.5", "1.7", "1.9", "1.11", "1.12"])
def test_versions_1_3_to_1_12_are_read(site, link, version):
    world = site.load(f"<model name='m'>{link()}</model>", version)
    assert (len(world.visual), world.warnings) == (12, ())


@pytest.mark.parametrize(
    ("root", "message"),
    [
        ("<html/>", "its root is <html>, expected <sdf>"),
        ("<robot name='r'/>", "is a URDF: convert it first"),
    ],
)
def test_other_xml_is_not_a_world(site, root, message):
    path = site.file("worlds/robot.sdf", root)
    with pytest.raises(WorldError, match=message):
        load_world(path)


def test_pose_of_three_numbers_is_a_position_and_says_so(site, link, extent_of):
    world = site.load(f"<model name='m'><pose>2 0 0.5</pose>{link()}</model><model name='n'>{link()}</model>")
    assert extent_of(world.visual).tolist() == [-0.5, -0.5, -0.5, 2.5, 0.5, 1.0]
    (warning,) = world.warnings
    assert warning.startswith("1 of the poses in test.world have three numbers")
    assert "first: 2 0 0.5" in warning


@pytest.mark.parametrize("pose", ["nan 0 0 0 0 0", "0 0", "0 0 0 0 0 inf", "a b c d e f"])
def test_pose_that_is_not_six_finite_numbers_names_its_element(site, link, pose):
    with pytest.raises(WorldError, match=r"<pose> in model 'm' .* expected 6"):
        site.load(f"<model name='m'><pose>{pose}</pose>{link()}</model>")


def test_bare_ampersand_in_a_model_config_is_text(site, link, extent_of):
    site.model("lift", link(), config="<sdf version='1.6'>model.sdf</sdf><description>door & car</description>")
    world = site.load("<include><uri>model://lift</uri></include>")
    assert extent_of(world.visual).tolist() == [-0.5, -0.5, -0.5, 0.5, 0.5, 0.5]


def test_degrees_and_quaternions_of_sdf_1_9(site, link, extent_of):
    turned = "<pose degrees='true'>0 0 0 0 0 90</pose>"
    world = site.load(f"<model name='m'>{turned}{link(size=(4, 1, 1))}</model>", "1.9")
    assert extent_of(world.visual).tolist() == [-0.5, -2, -0.5, 0.5, 2, 0.5]
    turned = "<pose rotation_format='quat_xyzw'>0 0 0 0 0 1 1</pose>"
    world = site.load(f"<model name='m'>{turned}{link(size=(4, 1, 1))}</model>", "1.9")
    assert extent_of(world.visual).tolist() == [-0.5, -2, -0.5, 0.5, 2, 0.5]


@pytest.mark.parametrize(
    "change",
    [
        lambda text: "\n\n" + "<?xml version='1.0'?>" + text,
        lambda text: "\ufeff<?xml version='1.0' encoding='utf-8'?>\n" + text,
        lambda text: text.replace("<link", "<!-- a -- b --- <link> --><link"),
        lambda text: text.replace("<link", "<!-- <![CDATA[ --><link").replace("</link>", "<!-- ]]> --></link>"),
        lambda text: text.replace("<link", "<gz:priority a:b='1'>7</gz:priority><link"),
        lambda text: text.replace("<link", "<gz::system::priority>7</gz::system::priority><link"),
        lambda text: text.replace("<link", "<plugin name='a&b'>x && y &nbsp; &amp;</plugin><link"),
        lambda text: text.replace("<link", "<!-- caf\xe9 --><plugin name='caf\xe9'/><link").encode("latin-1"),
        lambda text: f"<?xml version='1.0' encoding='UTF-16'?>{text}".encode("utf-16"),
        lambda text: text.replace("<link", "<plugin><![CDATA[ <!-- kept --> ]]></plugin><link"),
    ],
)
def test_what_tinyxml_reads_is_read(site, link, change):
    path = site.world(f"<model name='m'>{link()}</model>")
    changed = change(path.read_text())
    path.write_bytes(changed.encode() if isinstance(changed, str) else changed)
    world = load_world(path, use_cache=False)
    assert (len(world.visual), world.warnings) == (12, ())


def test_a_mistake_is_named_with_its_line_whatever_was_mended_above_it(site):
    text = "\n\n<?xml version='1.0'?>\n<!-- one -- \n two -->\n<sdf version='1.6'>\n<world a='1' a='2'/>\n</sdf>"
    with pytest.raises(WorldError, match="line 7: an element has the same attribute twice, which Gazebo refuses too"):
        load_world(site.file("worlds/twice.sdf", text), use_cache=False)


def test_a_plugin_that_speaks_of_links_and_models_holds_nothing_solid(site, link):
    plugin = "<plugin name='p'><model>m</model><link>l</link></plugin>"
    assert site.load(f"<model name='m'>{plugin}{link()}</model>{plugin}").warnings == ()
