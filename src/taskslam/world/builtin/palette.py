"""`Palette`: the surfaces that buildings share, made once from one seed; each building adds its floors and walls."""

from __future__ import annotations

from abc import ABC, abstractmethod

from taskslam.world.builtin import pictures, prints, textures
from taskslam.world.builtin.builder import Builder, Surface
from taskslam.world.builtin.noise import Dice, NoiseBank
from taskslam.world.builtin.textures import Colour, Image
from taskslam.world.world import Material

_SHINE = (0.15, 0.15, 0.15)


class Palette(ABC):
    """Surfaces by name; methods make one-off pictures. Subclasses (`palettes`) make the structure."""

    def __init__(self, builder: Builder, seed: int) -> None:
        self._builder = builder
        self._seed = seed
        self._bank = NoiseBank(seed)
        self._count = 0
        self._make_structure()
        self._make_common()
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

    def _ceiling_tiles(self) -> Surface:
        """Return a suspended ceiling of 0.6 m tiles, brightened by what the floor throws back."""
        image = textures.tiles(
            self._bank, self._dice(), [(238, 238, 234)], (176, 178, 178), count=4, spread=0.03, wear=0.06
        )
        material = Material("ceiling tiles", (1.0, 1.0, 1.0, 1.0), image, emissive=(0.26, 0.26, 0.26))
        return self._builder.material(material, (2.4, 2.4))

    @abstractmethod
    def _make_structure(self) -> None:
        """Make the floors and walls of one kind of building."""

    def _make_common(self) -> None:
        bank, dice = self._bank, self._dice
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

    def notices(self, wide: float, tall: float) -> Surface:
        """Return a new notice board of that many metres, about 2.5 mm per pixel."""
        image = prints.notice_board(self._bank, self._dice(), _pixels(wide, 0.0025), _pixels(tall, 0.0025))
        return self._add(f"notices {self._count}", image, None)

    def whiteboard(self, wide: float, tall: float) -> Surface:
        """Return a new whiteboard of that many metres, about 3 mm per pixel."""
        image = prints.whiteboard(self._bank, self._dice(), _pixels(wide, 0.003), _pixels(tall, 0.003))
        return self._add(f"whiteboard {self._count}", image, None)

    def sign(self, text: str, ground: Colour = (30, 70, 130), ink: Colour = (250, 250, 246)) -> Surface:
        """Return a plate with a few large characters."""
        return self._add(f"sign {text}", prints.sign(text, ground, ink), None)

    def view(self) -> Surface:
        """Return a new view from a window, lit by the day outside."""
        image = pictures.window_view(self._bank, self._dice())
        material = Material(f"view {self._count}", (1.0, 1.0, 1.0, 1.0), image, emissive=(0.4, 0.4, 0.4))
        return self._builder.material(material)


def _pixels(metres: float, size: float) -> int:
    return min(max(int(metres / size), 64), 1024)
