# SPDX-License-Identifier: MIT OR Apache-2.0
"""`bentwing merge`: several runs into one map."""

from __future__ import annotations

from pathlib import Path  # noqa: TC003 - typer reads the annotations
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from bentwing.run.merging import Merged


def merge_command(
    runs: Annotated[list[Path], typer.Argument(help="Folders written by `bentwing map`.")],
    *,
    out: Annotated[Path, typer.Option("-o", "--out", help="Folder to write into.")],
    map_format: Annotated[str, typer.Option(help="laz, las, ply, pcd or e57.")] = "laz",
    map_spacing: Annotated[
        float, typer.Option(help="Keep one point per voxel of this edge in metres; 0 keeps all.")
    ] = 0.0,
    keep_moving: Annotated[
        bool,
        typer.Option(
            "--keep-moving", help="Keep what beams went through at other times or in other runs."
        ),
    ] = False,
    keep_mixed: Annotated[
        bool, typer.Option("--keep-mixed", help="Keep returns between two surfaces.")
    ] = False,
    threads: Annotated[int | None, typer.Option(help="Default: all cores.", min=1)] = None,
    quiet: Annotated[bool, typer.Option("--quiet", help="Say nothing but errors.")] = False,
) -> None:
    """Put several runs into one map, without a guess where they lie.

    Runs that have no place in common become maps of their own, in folders of their own.
    """
    # slow to import, so only when it is needed
    from bentwing.base.progress import create_progress
    from bentwing.map.clean import CleanSettings
    from bentwing.run.merging import merge

    merged = merge(
        runs,
        out,
        map_format=map_format,
        map_spacing=map_spacing,
        cleaning=CleanSettings(mixed_pixels=not keep_mixed, moving=not keep_moving),
        threads=threads,
        progress=create_progress(quiet=quiet),
    )
    if not quiet:
        say_maps(merged)


def say_maps(merged: Merged) -> None:
    """Tell the maps, and which runs are in them."""
    if len(merged.maps) > 1:
        typer.echo(f"not all runs have places in common: {len(merged.maps)} separate maps")
    for one in merged.maps:
        typer.echo(f"{one.out}: {', '.join(one.names)}; open {one.out / 'report.html'}")
