"""`taskslam tags`: print AprilTags and read them back."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from taskslam.cli.console import say

app = typer.Typer(
    help="AprilTags: print them to exact millimetres, and see in a photograph that they are read.", no_args_is_help=True
)

_Family = Annotated[str, typer.Option(help="Tag family: tag36h11, tag36h10 or tag25h9.")]


class Kind(StrEnum):
    """What a sheet is for."""

    SINGLE = "single"
    BUNDLE = "bundle"
    PLATE = "plate"


@app.command()
def make(
    ids: Annotated[str, typer.Argument(metavar="IDS", help="Which tags: 0, 0-3 or 0,4,9.")],
    kind: Annotated[
        Kind,
        typer.Option(help="single: one tag a page. bundle: four at a time, for a ceiling. plate: for a robot's top."),
    ] = Kind.SINGLE,
    size: Annotated[
        float | None, typer.Option(metavar="MM", help="Side of the black square; by default the largest that fits.")
    ] = None,
    paper: Annotated[str, typer.Option(help="A4, A3, Letter or WIDTHxHEIGHT in mm.")] = "A4",
    plate: Annotated[
        str, typer.Option(metavar="WIDTHxHEIGHT", help="Size of the plate, mm: a line to cut along is drawn.")
    ] = "",
    spacing: Annotated[
        float | None,
        typer.Option(
            metavar="MM", help="Between the centres of neighbours in a bundle; by default as the page allows."
        ),
    ] = None,
    family: _Family = "tag36h11",
    out: Annotated[Path, typer.Option("--out", "-o", help="The PDF to write.")] = Path("tags.pdf"),
) -> None:
    """Write tags as a vector PDF in exact millimetres, with a ruler to check the printer's scale.

    A bundle that is wider than the paper comes as one page per tag and a plan.

    Examples:
    `taskslam tags make 7 --kind plate --size 170 --paper A3 --plate 280x280`

    `taskslam tags make 20-23 --kind bundle --size 150 --spacing 600`
    """
    from taskslam.files import write_whole
    from taskslam.realworld.tags.pdf import write_pdf
    from taskslam.realworld.tags.tag_sheets import (
        Sheet,
        bundle_pages,
        largest_bundle,
        largest_spacing,
        parse_ids,
        plate_page,
        tag_page,
    )

    numbers = parse_ids(ids)
    sheet = Sheet.of(paper, plate)
    if kind is Kind.BUNDLE:
        side = size or largest_bundle(sheet, family, spacing)
        apart = spacing or largest_spacing(sheet, family, side)
        groups = [numbers[i : i + 4] for i in range(0, len(numbers), 4)]
        pages = [page for group in groups for page in bundle_pages(sheet, family, group, side, apart)]
    else:
        side = size or sheet.largest_tag(family)
        one = plate_page if kind is Kind.PLATE else tag_page
        pages = [one(sheet, family, number, side) for number in numbers]
    write_whole(out, write_pdf(pages, f"AprilTags {family} {ids}, {side:g} mm"))
    apart_text = f", centres {apart:g} mm apart" if kind is Kind.BUNDLE else ""
    say(f"{out}: {len(pages)} page{'s' * (len(pages) > 1)}, {family}, {side:g} mm{apart_text}; print at 100 %")
    if kind is Kind.BUNDLE:
        for group in groups:
            say(f"In the setup file: square: {{ids: {group}, size: {side / 1000:g}, spacing: {apart / 1000:g}}}")


@app.command()
def check(
    photo: Annotated[Path, typer.Argument(metavar="PHOTO", help="A picture in which tags are to be read.")],
    family: _Family = "tag36h11",
    maxhamming: Annotated[int, typer.Option(min=0, max=3, help="Code bits that may be corrected.")] = 2,
    refine: Annotated[
        bool, typer.Option("--refine/--no-refine", help="Fit the edges again at full resolution, as measuring does.")
    ] = False,
    decimate: Annotated[float, typer.Option(min=1.0, max=8.0, help="Shrink the picture by this to look.")] = 1.0,
    json: Annotated[bool, typer.Option("--json", help="A JSON list of id, family and corners.")] = False,
) -> None:
    """Read the tags in a photograph: which, where, and how surely.

    The settings are those that find most, edges unrefined and two bits corrected: they give all reference detections
    of the AprilTag library's own test pictures. Measuring is stricter: `--refine --maxhamming 1` shows what it sees.
    Corners are pixels, top left, top right, bottom right, bottom left of the artwork; (0, 0) is the centre of the
    picture's first pixel.

    Examples: `taskslam tags check photo.jpg`, `taskslam tags check photo.jpg --json`
    """
    import numpy as np

    from taskslam.realworld.cameras.images import read_grey
    from taskslam.realworld.tags.detector import Detector
    from taskslam.realworld.tags.look_again import what_is_there

    image = read_grey(photo)
    with Detector(family, maxhamming=maxhamming, refine_edges=refine, decimate=decimate) as detector:
        tags = detector.detect(image, str(photo))
    if json:
        import json as json_module

        found = [{"id": t.id, "family": t.family, "corners": np.round(t.corners, 4).tolist()} for t in tags]
        say(json_module.dumps(found))
        return
    if not tags:
        say(f"{photo}: no tag of {family}")
        for sentence in what_is_there(image, family, maxhamming):
            say(f"There is {sentence}.")
        raise typer.Exit(1)
    say(f"{'id':>5} {'centre px':>16} {'side px':>8} {'margin':>7} {'bits corrected':>15}")
    for tag in tags:
        x, y = tag.corners.mean(0)
        side = np.linalg.norm(tag.corners - np.roll(tag.corners, 1, 0), axis=1).mean()
        say(f"{tag.id:>5} {x:>8.1f} {y:>7.1f} {side:>8.1f} {tag.margin:>7.0f} {tag.hamming:>15}")
