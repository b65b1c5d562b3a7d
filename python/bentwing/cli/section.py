# SPDX-License-Identifier: MIT OR Apache-2.0
"""`bentwing section`: a drawing of what a plane cuts of a map."""

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from bentwing.cli import options
from bentwing.cli.options import RESULT, option

if TYPE_CHECKING:
    from bentwing.products.plane import CutPlane

EXAMPLES = (
    "bentwing section run -o plan.dxf",
    "bentwing section run --plan 1.2 --scale 50 -o plan.pdf",
    "bentwing section run --plane 0,2,15,2 -o section.svg",
    "bentwing section run --plan 1 --thickness 1.6 -o plan.yaml",
)
CUT = "Cut"


def command(
    run: options.Run,
    *,
    plan: Annotated[
        float | None,
        option(
            CUT,
            metavar="HEIGHT",
            help="Level cut at so many metres above the floor.",
            show_default="1.0",
        ),
    ] = None,
    level: Annotated[
        float | None,
        option(CUT, metavar="HEIGHT", help="Level cut at a height in the map's coordinates, m."),
    ] = None,
    plane: Annotated[
        str | None,
        option(
            CUT,
            metavar="NUMBERS",
            help="Upright cut from a point to another, X,Y,X,Y, or any plane by a point and its "
            "normal, X,Y,Z,NX,NY,NZ.",
        ),
    ] = None,
    thickness: Annotated[
        float, option(CUT, metavar="METRES", help="Thickness of the slab that is drawn.")
    ] = 0.1,
    out: Annotated[
        Path,
        options.out_file(
            "Drawing as .dxf, .svg, .png or .pdf, or occupancy grid for Nav2 as .yaml."
        ),
    ],
    scale: Annotated[
        int | None,
        option(
            RESULT,
            metavar="N",
            help="Scale 1:N of the drawing.",
            show_default="the largest round one on A3",
        ),
    ] = None,
    cell: Annotated[
        float, option(RESULT, metavar="METRES", help="Edge of a cell of the occupancy grid.")
    ] = 0.05,
    quiet: options.Quiet = False,
) -> None:
    """Draw what a plane cuts of a map: points, walls, grid and title at a round scale."""
    # slow to import, so only when it is needed
    from bentwing.base.progress import create_progress
    from bentwing.products.occupancy import write_occupancy
    from bentwing.products.section import write_section

    cut = _plane(plan, level, plane)
    progress = create_progress(quiet=quiet)
    if out.suffix.lower() == ".yaml":
        grid = write_occupancy(run, out, cut, thickness=thickness, cell=cell, progress=progress)
        said = grid.sentence()
    else:
        found, paper = write_section(
            run, out, cut, thickness=thickness, scale=scale, progress=progress
        )
        said = f"{paper}; {found.sentence()}"
    if not quiet:
        typer.echo(f"{out}: {said}")


def _plane(plan: float | None, level: float | None, plane: str | None) -> "CutPlane | float":
    from bentwing.base.errors import UsageError
    from bentwing.products.plane import CutPlane

    if sum(given is not None for given in (plan, level, plane)) > 1:
        msg = "--plan, --level and --plane each say where to cut; give one of them"
        raise UsageError(msg)
    if plane is not None:
        return _parsed(plane)
    if level is not None:
        return CutPlane.level(_finite("--level", level))
    return 1.0 if plan is None else _finite("--plan", plan)


def _finite(name: str, value: float) -> float:
    from bentwing.base.errors import UsageError

    if not math.isfinite(value):
        msg = f"{name} {value} cannot be used; give a height in metres"
        raise UsageError(msg)
    return value


def _parsed(given: str) -> "CutPlane":
    from bentwing.base.errors import UsageError
    from bentwing.products.plane import CutPlane

    try:
        numbers = [float(word) for word in given.split(",")]
        if len(numbers) == 4:
            return CutPlane.upright(numbers[:2], numbers[2:])
        if len(numbers) == 6:
            return CutPlane.through(numbers[:3], numbers[3:])
    except ValueError:
        pass
    msg = (
        f"--plane {given!r} is no plane; give two different points X,Y,X,Y, or a point and a normal "
        "X,Y,Z,NX,NY,NZ, in metres"
    )
    raise UsageError(msg)
