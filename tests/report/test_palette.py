"""Colours of the page, on paper and in the dark. Contrast: WCAG 2.2, "relative luminance" and "contrast ratio"."""

import re

import pytest

from taskslam.report import palette, write_report


def luminance(colour):
    parts = [int(colour[at : at + 2], 16) / 255 for at in (1, 3, 5)]
    red, green, blue = (part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in parts)
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue


def contrast(a, b):
    brighter, darker = sorted((luminance(a), luminance(b)), reverse=True)
    return (brighter + 0.05) / (darker + 0.05)


def dark(light):
    return dict(palette.PAGE.values())[light]


def test_black_on_white_has_the_largest_contrast():
    assert contrast("#000000", "#ffffff") == pytest.approx(21)


@pytest.mark.parametrize("colour", palette.METHODS)
def test_every_method_stands_out_in_the_dark_also_on_a_tint(colour):
    assert contrast(dark(colour), dark(palette.PAPER)) >= 3
    assert contrast(dark(colour), dark(palette.TINT)) >= 3


def test_methods_stay_apart_in_the_dark():
    assert len({dark(colour) for colour in palette.METHODS}) == len(palette.METHODS)


@pytest.mark.parametrize("ground", [0, 1], ids=["light", "dark"])
@pytest.mark.parametrize("ink", ["ink", "muted", "failure"])
def test_words_are_readable_on_either_ground(ink, ground):
    for behind in ("paper", "tint"):
        assert contrast(palette.PAGE[ink][ground], palette.PAGE[behind][ground]) >= 4.5


def test_only_a_screen_that_prefers_it_is_dark():
    sheet = palette.style_sheet()
    assert sheet.index("--ink: #1c2430") < sheet.index("@media screen and (prefers-color-scheme: dark)")
    assert sheet.index("@media") < sheet.index(f"--ink: {dark(palette.INK)}")


def test_every_name_that_a_page_uses_has_a_colour_and_no_figure_names_one_by_number(make_run, tmp_path):
    for name in "abc":
        make_run(name, method=name, failed=name == "c")
    page = write_report([tmp_path / "results"], tmp_path / "r.html").read_text()
    known = {*palette.PAGE, "width", "shade"}
    assert set(re.findall(r"var\(--([\w-]+)", page)) <= known
    assert not re.search(r'(fill|stroke)="#', page)
    assert not re.search(r"[\s:(](white|black|#fff|#ffffff|#000)\b", page[page.index("</style>") :])
