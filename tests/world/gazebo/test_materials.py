import numpy as np
import pytest

IMAGE = (10, 20, 30)


@pytest.fixture
def wall(site):
    """A world of one box with a material."""

    def load(material, extra=""):
        shape = "<geometry><box><size>8 1 2</size></box></geometry>"
        part = f"<visual name='v'>{shape}{material}{extra}</visual>"
        return site.load(f"<model name='m'><link name='l'>{part}</link></model>")

    return load


def script(name, uri="file://media/materials/scripts/gazebo.material"):
    return f"<material><script><uri>{uri}</uri><name>{name}</name></script></material>"


OGRE = """// comment { with brace
material Base {
  technique { pass {
    diffuse 0.1 0.2 0.3 1
    texture_unit { texture skin.png
    scale 0.5 0.25 } } }
}
material Child : Base { technique { pass { diffuse 0.4 0.5 0.6 } } }
"""


def test_script_beside_the_textures_folder(site, wall, make_png):
    site.file("models/paint/materials/scripts/a.material", OGRE.replace("skin.png", "../textures/skin.png"))
    site.file("models/paint/materials/textures/skin.png", make_png(IMAGE))
    world = wall(script("Base", "model://paint/materials/scripts/a.material"))
    (material,) = world.materials
    assert material.texture[0, 0].tolist() == list(IMAGE)
    assert material.diffuse == (0.1, 0.2, 0.3, 1.0)
    # Ogre's scale 0.5 0.25 repeats the texture 2 x 4 times on each face
    assert world.visual.uv.max(axis=(0, 1)).tolist() == [2, 4]


def test_folder_of_scripts_and_inheritance(site, wall, make_png):
    site.file("models/paint/materials/scripts/a.material", OGRE)
    site.file("models/paint/materials/textures/skin.png", make_png(IMAGE))
    (material,) = wall(script("Child", "model://paint/materials/scripts")).materials
    assert material.diffuse == (0.4, 0.5, 0.6, 1.0)
    assert material.texture is not None


def test_script_that_cannot_be_found_is_named(wall):
    world = wall(script("Mine/Marble"))
    assert world.warnings == ("Missing and left out: 1 material: Mine/Marble.",)
    assert len(world.visual) == 12


def test_first_material_that_can_be_resolved_counts(wall):
    world = wall(script("Mine/Marble") + script("Gazebo/Grey"))
    assert [m.name for m in world.materials] == ["Gazebo/Grey"]
    assert world.warnings == ()


def test_stock_colours_need_no_file(wall):
    assert wall(script("Gazebo/Red")).materials[0].diffuse == (1, 0, 0, 1)
    assert wall(script("Gazebo/Grey")).materials[0].diffuse == (0.7, 0.7, 0.7, 1)


@pytest.mark.parametrize("name", ["Gazebo/Bricks", "Gazebo/Wood"])
def test_stock_patterns_repeat_at_their_true_size(wall, name):
    world = wall(script(name))
    texture = world.materials[0].texture
    assert texture.std() > 10  # something to see
    # seamless: the step over the border is no larger than steps inside
    inside = np.abs(np.diff(texture.astype(int), axis=1)).mean()
    over = np.abs(texture[:, 0].astype(int) - texture[:, -1]).mean()
    assert over < 2.0 * inside
    # the 8 m side has eight times the repeats of the 1 m side
    long, short = (np.ptp(world.visual.uv[:, :, 0], axis=1).max(), np.ptp(world.visual.uv[:, :, 0], axis=1).min())
    assert long == pytest.approx(8 * short)


def test_plain_colours_and_transparency(wall):
    material = (
        "<material><ambient>1 0 0 1</ambient><diffuse>0 0.5 1 1</diffuse><emissive>0.1 0.2 0.3 1</emissive></material>"
    )
    (look,) = wall(material, "<transparency>0.25</transparency>").materials
    assert look.diffuse == (0, 0.5, 1, 0.75)
    assert look.emissive == (0.1, 0.2, 0.3)


def test_pbr_albedo_map(site, wall, make_png):
    site.file("worlds/skin.png", make_png(IMAGE))
    (look,) = wall("<material><pbr><metal><albedo_map>skin.png</albedo_map></metal></pbr></material>").materials
    assert look.texture[0, 0].tolist() == list(IMAGE)
    assert look.diffuse == (1, 1, 1, 1)


@pytest.mark.parametrize(
    ("reference", "place"),
    [
        ("skin.png", "models/thing/meshes/skin.png"),
        ("../materials/textures/skin.png", "models/thing/materials/textures/skin.png"),
        ("skin.png", "models/thing/materials/textures/skin.png"),
        ("../../../../photos/skin.png", "photos/skin.png"),
        (r"file://C:\Users\me\skin.png", "models/thing/materials/textures/skin.png"),
        ("my%20skin.png", "models/thing/meshes/my skin.png"),
    ],
)
def test_places_where_a_mesh_finds_its_texture(site, make_dae, make_png, reference, place):
    site.file("models/thing/meshes/a.dae", make_dae(image=reference))
    site.file(place, make_png(IMAGE))
    mesh = "<geometry><mesh><uri>model://thing/meshes/a.dae</uri></mesh></geometry>"
    world = site.load(f"<model name='m'><link name='l'><visual name='v'>{mesh}</visual></link></model>")
    assert world.warnings == ()
    assert world.materials[0].texture[0, 0].tolist() == list(IMAGE)
    assert world.materials[0].diffuse == (1, 1, 1, 1)


@pytest.fixture
def textured(site, make_dae):
    def load(image):
        site.file("models/thing/meshes/a.dae", make_dae(image="skin.png"))
        if image is not None:
            site.file("models/thing/meshes/skin.png", image)
        mesh = "<geometry><mesh><uri>model://thing/meshes/a.dae</uri></mesh></geometry>"
        return site.load(f"<model name='m'><link name='l'><visual name='v'>{mesh}</visual></link></model>")

    return load


def test_missing_texture_is_a_warning(textured):
    world = textured(None)
    assert world.warnings == ("Missing and left out: 1 texture: skin.png.",)
    assert len(world.visual) == 4


def test_truncated_texture_is_a_warning(textured, make_png):
    whole = make_png(IMAGE, (64, 64))
    world = textured(whole[: len(whole) * 2 // 3])
    assert world.warnings == ("Damaged and left out: 1 texture: skin.png.",)
    assert world.materials[0].texture is None


def test_postscript_dressed_as_a_texture_is_not_run(textured):
    program = b"%!PS-Adobe-3.0 EPSF-3.0\n%%BoundingBox: 0 0 8 8\n%%EndComments\nshowpage\n%%EOF\n"
    assert textured(program).warnings == ("Damaged and left out: 1 texture: skin.png.",)


def test_large_textures_are_reduced_and_opaque_alpha_is_dropped(textured, make_png):
    assert textured(make_png((1, 2, 3, 255), (2048, 512))).materials[0].texture.shape == (256, 1024, 3)


def test_transparent_texture_keeps_its_alpha(textured, make_png):
    assert textured(make_png((1, 2, 3, 100))).materials[0].texture[0, 0].tolist() == [1, 2, 3, 100]


def test_equal_files_share_one_array(site, make_dae, make_png):
    links = ""
    for name in ("a", "b"):
        site.file(f"models/{name}/meshes/{name}.dae", make_dae(image=f"{name}.png"))
        site.file(f"models/{name}/meshes/{name}.png", make_png(IMAGE))
        mesh = f"<geometry><mesh><uri>model://{name}/meshes/{name}.dae</uri></mesh></geometry>"
        links += f"<link name='{name}'><visual name='v'>{mesh}</visual></link>"
    world = site.load(f"<model name='m'>{links}</model>")
    first, second = (m.texture for m in world.materials)
    assert first is second
