"""Floors and walls of each building."""

from __future__ import annotations

import numpy as np

from taskslam.world.builtin import prints, textures
from taskslam.world.builtin.builder import Surface
from taskslam.world.builtin.palette import Palette
from taskslam.world.builtin.textures import Colour
from taskslam.world.world import Material


class HousePalette(Palette):
    """A home: wood and tiles underfoot, every room with a wall of its own."""

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


class WarehousePalette(Palette):
    """A warehouse: concrete underfoot, block walls, painted steel, cardboard."""

    def _make_structure(self) -> None:
        bank, dice = self._bank, self._dice
        floor = prints.concrete(bank, dice(), (176, 174, 168))
        self.concrete = self._add("concrete floor", floor, (5.0, 5.0))
        grey: list[Colour] = [(186, 186, 180), (176, 178, 174), (194, 192, 186)]
        blocks = textures.bricks(bank, dice(), grey, (150, 150, 146), spread=0.14)
        self.blockwork = self._add("concrete blocks", blocks, (4.4, 6.4))
        self.facade = self._add("cladding", prints.ribs(bank, dice(), (150, 160, 168)), (2.0, 2.0))
        self.roof = self._add("roof sheets", prints.ribs(bank, dice(), (206, 208, 206), 24), (5.0, 5.0))
        self.shutter = self._add("roller shutter", prints.ribs(bank, dice(), (160, 170, 176), 20), (2.0, 2.0))
        self.hazard = self._add("hazard stripes", prints.hazard(bank, dice()), (0.5, 0.5))
        self.yellow_tape = self._add("yellow marking", prints.tape(bank, dice(), (240, 196, 40)), (0.6, 0.6))
        self.white_tape = self._add("white marking", prints.tape(bank, dice(), (236, 236, 230)), (0.6, 0.6))
        self.rack_blue = self._enamel("rack blue", (44, 84, 148))
        self.rack_orange = self._enamel("rack orange", (226, 106, 36))
        self.yellow_paint = self._enamel("yellow paint", (238, 186, 40))
        self.red_paint = self._enamel("red paint", (190, 44, 40))
        self.rubber = self._enamel("rubber", (36, 36, 38))
        self.deal = self._wood("rough deal", (150, 116, 76), (208, 174, 126))
        kraft: list[Colour] = [(188, 146, 98), (174, 132, 88), (204, 166, 118), (166, 124, 80)]
        self.cartons = [
            self._add(f"carton {k}", prints.carton(bank, dice(), kraft[k % len(kraft)]), None) for k in range(12)
        ]
        tubs: list[Colour] = [(40, 92, 164), (196, 56, 48), (64, 132, 80), (232, 172, 48), (110, 116, 122)]
        self.tubs = [self._enamel(f"plastic tub {k}", colour) for k, colour in enumerate(tubs)]


class HospitalPalette(Palette):
    """A hospital: linoleum, plain paint with hardly any structure in the corridors, curtains, enamel."""

    def _make_structure(self) -> None:
        bank, dice = self._bank, self._dice
        chips: list[Colour] = [(150, 160, 160), (236, 238, 234), (120, 136, 142)]

        def lino(name: str, ground: Colour) -> Surface:
            return self._add(name, prints.fleck(bank, dice(), ground, chips), (1.6, 1.6))

        self.corridor_floor = lino("linoleum, grey", (196, 202, 200))
        self.ward_floor = lino("linoleum, blue", (158, 184, 196))
        self.care_floor = lino("linoleum, green", (172, 196, 178))
        self.office_floor = lino("linoleum, sand", (208, 194, 168))
        self.ceiling_tiles = self._ceiling_tiles()
        stone: list[Colour] = [(206, 200, 190)]
        lobby = textures.tiles(bank, dice(), stone, (150, 144, 136), count=4, spread=0.09)
        self.lobby_floor = self._add("lobby tiles", lobby, (2.4, 2.4))
        oak = textures.planks(bank, dice(), (130, 94, 60), (214, 174, 126))
        self.oak_floor = self._add("oak floor", oak, (2.4, 2.4))
        glazed: list[Colour] = [(206, 224, 222), (196, 216, 214), (214, 228, 226)]
        theatre = textures.tiles(bank, dice(), glazed, (150, 172, 172), count=8)
        self.theatre_wall = self._add("theatre tiles", theatre, (2.4, 2.4))
        self.facade = self._plaster("facade", (226, 222, 212))
        self.plain_wall = self._add("plain paint", textures.enamel(bank, dice(), (232, 232, 224), 512), (4.0, 4.0))
        self.dado = self._add("wall guard", textures.enamel(bank, dice(), (162, 190, 190), 512), (3.0, 3.0))
        self.lobby_wall = self._plaster("lobby plaster", (236, 228, 214))
        self.blue_wall = self._plaster("blue plaster", (196, 214, 226), 2.8)
        self.green_wall = self._plaster("green plaster", (204, 220, 200), 2.7)
        self.yellow_wall = self._plaster("yellow plaster", (238, 226, 188), 2.9)
        self.peach_wall = self._plaster("peach plaster", (238, 214, 196), 3.1)
        self.drape = self._fabric("drape", (132, 178, 182), [(206, 222, 218), (98, 150, 160)])
        self.blanket = self._fabric("hospital blanket", (190, 206, 222), [(220, 228, 236)])
        self.vinyl = self._enamel("vinyl", (54, 110, 140))
        self.scrub_green = self._fabric("theatre cloth", (70, 140, 124))
        self.guide_blue = self._add("guide line, blue", prints.tape(bank, dice(), (60, 120, 180)), (0.6, 0.6))
        self.red_paint = self._enamel("red paint", (190, 44, 40))
        self.files = self._add("files", prints.shelf_of_files(bank, dice()), (0.9, 0.3))
        self.views = [self.view() for _ in range(4)]
        panel = Material("ceiling light", (1.0, 1.0, 1.0, 1.0), None, emissive=(0.85, 0.87, 0.86))
        self.light_panel = self._builder.material(panel, (1.0, 1.0))


class OfficePalette(Palette):
    """An office floor: plain corridors, carpet tiles in the rooms, brick outside."""

    def _make_structure(self) -> None:
        bank, dice = self._bank, self._dice
        chips: list[Colour] = [(126, 122, 116), (226, 222, 214), (96, 100, 104)]
        terrazzo = prints.fleck(bank, dice(), (178, 174, 166), chips)
        self.corridor_floor = self._add("terrazzo", terrazzo, (1.8, 1.8))

        def carpet(name: str, colours: list[Colour]) -> Surface:
            image = textures.tiles(bank, dice(), colours, colours[0], count=4)
            weave = textures.fabric(bank, dice(), (255, 255, 255), 1024)
            woven = (image.astype(np.uint16) * weave // 235).clip(0, 255).astype(np.uint8)
            return self._add(name, woven, (2.0, 2.0))

        self.grey_carpet = carpet("carpet tiles, grey", [(112, 118, 126), (122, 128, 134)])
        self.blue_carpet = carpet("carpet tiles, blue", [(74, 98, 128), (84, 108, 134)])
        self.green_carpet = carpet("carpet tiles, green", [(104, 124, 100), (96, 116, 96)])
        oak = textures.planks(bank, dice(), (130, 94, 60), (214, 174, 126))
        self.oak_floor = self._add("oak floor", oak, (2.4, 2.4))
        self.concrete = self._add("concrete", prints.concrete(bank, dice(), (182, 180, 174)), (4.0, 4.0))
        cement: list[Colour] = [(206, 206, 200), (150, 160, 166)]
        self.wash_floor = self._add("floor tiles", textures.tiles(bank, dice(), cement, (110, 114, 116)), (2.4, 2.4))
        glazed: list[Colour] = [(216, 222, 222), (206, 214, 216)]
        self.wash_wall = self._add(
            "wall tiles", textures.tiles(bank, dice(), glazed, (160, 170, 174), 1024, 12), (2.4, 2.4)
        )
        red: list[Colour] = [(150, 84, 66), (134, 70, 56), (166, 100, 80)]
        self.brick = self._add("brick", textures.bricks(bank, dice(), red, (190, 182, 170), spread=0.3), (2.4, 2.4))
        self.ceiling_tiles = self._ceiling_tiles()
        self.plain_wall = self._add("plain paint", textures.enamel(bank, dice(), (228, 226, 220), 512), (4.0, 4.0))
        self.white_wall = self._plaster("white plaster", (236, 234, 228))
        self.blue_wall = self._plaster("blue plaster", (150, 178, 200), 2.8)
        self.green_wall = self._plaster("green plaster", (170, 192, 160), 2.7)
        self.ochre_wall = self._plaster("ochre plaster", (226, 196, 140), 2.9)
        self.door_wood = self._wood("door, beech", (176, 128, 84), (216, 172, 126))
        self.red_paint = self._enamel("red paint", (190, 44, 40))
        self.files = self._add("files", prints.shelf_of_files(bank, dice()), (0.9, 0.3))
        self.views = [self.view() for _ in range(4)]
        panel = Material("ceiling light", (1.0, 1.0, 1.0, 1.0), None, emissive=(0.85, 0.86, 0.84))
        self.light_panel = self._builder.material(panel, (1.0, 1.0))
