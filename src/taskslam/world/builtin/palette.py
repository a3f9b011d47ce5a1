"""`Palette`: every surface of the house, made once from one seed."""

from __future__ import annotations

from taskslam.world.builtin import pictures, textures
from taskslam.world.builtin.builder import Builder, Surface
from taskslam.world.builtin.noise import Dice, NoiseBank
from taskslam.world.builtin.textures import Colour, Image
from taskslam.world.world import Material

_SHINE = (0.15, 0.15, 0.15)


class Palette:
    """Surfaces by name; methods make one-off pictures."""

    def __init__(self, builder: Builder, seed: int) -> None:
        self._builder = builder
        self._seed = seed
        self._bank = NoiseBank(seed)
        self._count = 0
        self._make_structure()
        self._make_furniture()

    def _dice(self) -> Dice:
        self._count += 1
        return Dice(self._seed, self._count)

    def _add(
        self, name: str, image: Image, extent: tuple[float, float] | None, fibrous: bool = False, shiny: bool = False
    ) -> Surface:
        material = Material(name, (1.0, 1.0, 1.0, 1.0), image, specular=_SHINE if shiny else (0.0, 0.0, 0.0))
        return self._builder.material(material, extent, fibrous)

    def _plaster(self, name: str, colour: Colour, metres: float = 2.6) -> Surface:
        return self._add(name, textures.plaster(self._bank, self._dice(), colour), (metres, metres))

    def _wood(self, name: str, dark: Colour, light: Colour) -> Surface:
        return self._add(name, textures.wood(self._bank, self._dice(), dark, light), (1.2, 1.2), fibrous=True)

    def _fabric(self, name: str, colour: Colour, stripes: list[Colour] | None = None) -> Surface:
        return self._add(name, textures.fabric(self._bank, self._dice(), colour, stripes=stripes), (1.1, 1.1))

    def _enamel(self, name: str, colour: Colour) -> Surface:
        return self._add(name, textures.enamel(self._bank, self._dice(), colour), (0.8, 0.8), shiny=True)

    def _make_structure(self) -> None:
        bank, dice = self._bank, self._dice
        oak = textures.planks(bank, dice(), (120, 82, 50), (206, 164, 116))
        self.oak_floor = self._add("oak floor", oak, (2.4, 2.4))
        walnut = textures.planks(bank, dice(), (66, 44, 32), (142, 100, 70))
        self.walnut_floor = self._add("walnut floor", walnut, (3.0, 3.0))
        cement: list[Colour] = [(222, 216, 204), (120, 138, 144)]
        kitchen = textures.tiles(bank, dice(), cement, (96, 104, 108), count=8, ornament=0.35)
        self.kitchen_floor = self._add("kitchen tiles", kitchen, (2.4, 2.4))
        slate: list[Colour] = [(92, 104, 110), (112, 122, 124), (76, 88, 96)]
        bath = textures.tiles(bank, dice(), slate, (176, 176, 172), count=8, ornament=0.12)
        self.bath_floor = self._add("bath floor tiles", bath, (2.0, 2.0))
        glazed: list[Colour] = [(214, 226, 224), (202, 218, 218), (224, 230, 226)]
        self.bath_wall = self._add(
            "bath wall tiles",
            textures.tiles(bank, dice(), glazed, (120, 150, 154), count=16, ornament=0.06),
            (2.4, 2.4),
        )
        green: list[Colour] = [(124, 156, 138), (146, 172, 152), (108, 142, 130)]
        splash = textures.tiles(bank, dice(), green, (206, 202, 192), count=16, ornament=0.1)
        self.splashback = self._add("splashback", splash, (1.6, 1.6), shiny=True)
        red: list[Colour] = [(158, 82, 62), (140, 66, 50), (176, 104, 80), (150, 92, 72)]
        self.brick = self._add("brick", textures.bricks(bank, dice(), red, (190, 182, 170)), (2.4, 2.4))
        self.facade = self._plaster("facade", (214, 204, 186))
        self.living_wall = self._plaster("living plaster", (236, 228, 214))
        self.kitchen_wall = self._plaster("kitchen plaster", (232, 222, 196))
        self.corridor_wall = self._plaster("corridor plaster", (222, 214, 204), 2.3)
        self.study_wall = self._plaster("study plaster", (140, 160, 148), 2.5)
        leaves: list[Colour] = [(140, 164, 142), (178, 190, 164), (112, 144, 134), (206, 176, 146)]
        self.bedroom_wall = self._add(
            "bedroom wallpaper", textures.wallpaper(bank, dice(), (222, 224, 214), leaves), (2.5, 2.5)
        )
        confetti: list[Colour] = [(236, 168, 88), (112, 170, 190), (214, 110, 100), (150, 180, 110), (240, 214, 120)]
        self.kids_wall = self._add(
            "kids wallpaper", textures.wallpaper(bank, dice(), (238, 230, 212), confetti, count=110), (2.7, 2.7)
        )
        self.ceiling = self._plaster("ceiling", (240, 238, 232), 3.0)
        self.core = self._add("masonry", textures.enamel(bank, dice(), (58, 56, 54)), (1.0, 1.0))
        self.white_wood = self._wood("white wood", (214, 208, 198), (244, 240, 232))

    def _make_furniture(self) -> None:
        bank, dice = self._bank, self._dice
        self.oak = self._wood("oak", (150, 106, 64), (212, 168, 116))
        self.walnut = self._wood("walnut", (62, 40, 28), (128, 86, 58))
        self.teal_wood = self._wood("painted wood, teal", (52, 98, 102), (84, 132, 132))
        self.sage_wood = self._wood("painted wood, sage", (120, 138, 116), (156, 170, 146))
        self.yellow_wood = self._wood("painted wood, yellow", (206, 158, 60), (240, 200, 104))
        self.blue_fabric = self._fabric("blue fabric", (78, 110, 142))
        self.mustard_fabric = self._fabric("mustard fabric", (214, 160, 62))
        self.rust_fabric = self._fabric("rust fabric", (186, 92, 62))
        self.green_fabric = self._fabric("green fabric", (104, 128, 92))
        self.linen = self._fabric("linen", (236, 230, 218))
        self.curtain = self._fabric("curtain", (206, 196, 178), [(150, 120, 96), (176, 160, 130), (196, 140, 110)])
        self.tartan = self._fabric("blanket", (176, 172, 160), [(160, 60, 50), (50, 80, 90), (220, 180, 90)])
        self.kids_quilt = self._fabric("quilt", (150, 190, 200), [(236, 120, 100), (250, 214, 120), (90, 130, 170)])
        self.granite = self._add(
            "granite", textures.stone(bank, dice(), (44, 44, 50), (150, 148, 146)), (1.0, 1.0), shiny=True
        )
        self.terracotta = self._add(
            "terracotta", textures.stone(bank, dice(), (150, 84, 58), (196, 122, 88)), (0.7, 0.7)
        )
        self.porcelain = self._enamel("porcelain", (240, 240, 236))
        self.steel = self._enamel("steel", (150, 154, 158))
        self.black = self._enamel("black lacquer", (44, 44, 48))
        self.shade = self._fabric("lamp shade", (244, 226, 186))
        leaf = textures.blend((34, 70, 34), (120, 160, 76), bank.take("cloud", 256, dice()))
        self.leaf = self._add("leaf", leaf, (0.4, 0.4))
        self.soil = self._add("soil", textures.stone(bank, dice(), (40, 30, 24), (84, 66, 52), 256), (0.4, 0.4))
        self.screen = self._add("screen", pictures.screen(dice()), None)
        glow = Material("lamp glass", (1.0, 0.97, 0.9, 1.0), None, emissive=(0.8, 0.76, 0.66))
        self.lamp_glass = self._builder.material(glow, (1.0, 1.0))
        self.mirror = self._enamel("mirror", (186, 200, 206))

    def painting(self, wide: float, tall: float) -> Surface:
        """Return a new picture for a frame of that many metres, about 3 mm per pixel."""
        image = pictures.painting(self._bank, self._dice(), _pixels(wide, 0.003), _pixels(tall, 0.003))
        return self._add(f"painting {self._count}", image, None)

    def rug(self, wide: float, deep: float) -> Surface:
        """Return a new rug of that many metres."""
        image = pictures.rug(self._bank, self._dice(), _pixels(wide, 0.004), _pixels(deep, 0.004), detail=44)
        return self._add(f"rug {self._count}", image, None)

    def books(self) -> Surface:
        """Return a new metre of book spines."""
        return self._add(f"books {self._count}", pictures.books(self._bank, self._dice()), (1.0, 0.27))

    def view(self) -> Surface:
        """Return a new view from a window, lit by the day outside."""
        image = pictures.window_view(self._bank, self._dice())
        material = Material(f"view {self._count}", (1.0, 1.0, 1.0, 1.0), image, emissive=(0.4, 0.4, 0.4))
        return self._builder.material(material)


def _pixels(metres: float, size: float) -> int:
    return min(max(int(metres / size), 64), 1024)
