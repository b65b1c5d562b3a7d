# SPDX-License-Identifier: MIT OR Apache-2.0
"""`bentwing live`: odometry while the sensors deliver, among the topics of ROS 2."""

import time
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from bentwing.base.errors import UsageError
from bentwing.cli import options
from bentwing.cli.options import INPUT, RESULT, RUNNING, option

if TYPE_CHECKING:
    from collections.abc import Iterator

    from bentwing.flight import Odometry
    from bentwing.flight.ros2.bridge import Bridge

MOST_PORT = 65535
EXAMPLES = (
    "bentwing live --ros2 -p payload.yaml",
    "bentwing live --ros2 -p payload.yaml --estimator kalman -o trajectory.txt",
    "bentwing live --ros2 -p payload.yaml --foxglove 8765",
)


def command(  # noqa: PLR0917 - one parameter per option
    payload: Annotated[Path, options.payload()],
    ros2: Annotated[bool, option(INPUT, "--ros2", help="Read and write topics of ROS 2.")] = False,  # noqa: FBT002
    domain: Annotated[
        int,
        option(INPUT, metavar="N", min=0, max=232, envvar="ROS_DOMAIN_ID", help="Domain of ROS 2."),
    ] = 0,
    patience: Annotated[
        float, option(INPUT, metavar="SECONDS", min=0, help="How long to wait for the topics.")
    ] = 30.0,
    estimator: options.Estimator = None,
    out: Annotated[
        Path | None, options.out_file("Write the trajectory at the end, TUM; it must not exist.")
    ] = None,
    rate: Annotated[
        float, option(RESULT, metavar="HZ", min=0.1, help="Most poses to write in a second.")
    ] = 50.0,
    foxglove: Annotated[
        str | None,
        option(
            RESULT,
            metavar="[HOST:]PORT",
            help="Show it in Foxglove, which connects there; without a host from this computer only.",
        ),
    ] = None,
    duration: Annotated[
        float | None,
        option(RUNNING, metavar="SECONDS", min=0, show_default="Ctrl-C", help="End after this."),
    ] = None,
    threads: options.Threads = None,
    quiet: options.Quiet = False,  # noqa: FBT002
) -> None:
    """Run odometry live: sensors' topics in, odometry, /tf and path out."""
    # slow to import, so only when it is needed
    from bentwing.base.new_file import require_new
    from bentwing.flight import FoxgloveServer, Odometry
    from bentwing.flight.ros2.bridge import Bridge, find_roles
    from bentwing.flight.ros2.node import Ros2Node
    from bentwing.recording.payload import Payload

    if not ros2:
        msg = "`bentwing live` reads topics of ROS 2 only: give --ros2"
        raise UsageError(msg)
    if out is not None:
        require_new(out)
    head = Payload.load(payload)
    host, port = _address(foxglove or "0")
    node = Ros2Node(domain)
    roles = find_roles(node, head, patience)
    if not quiet:
        for role, topic in roles._asdict().items():
            typer.echo(f"{role:8} {topic.name if topic else 'none'}")
    with ExitStack() as opened:
        odometry = opened.enter_context(
            Odometry(head, estimator=estimator or "continuous", threads=threads)
        )
        servers = [] if foxglove is None else [FoxgloveServer(port, host=host)]
        viewers = [opened.enter_context(server) for server in servers]
        bridge = Bridge(node, odometry, head, roles, rate=rate, viewers=viewers)
        end = time.monotonic() + duration if duration is not None else float("inf")
        with suppress(KeyboardInterrupt):  # how a live run ends
            for status in _changes(bridge, odometry, end):
                if not quiet:
                    typer.echo(status)
        estimate = odometry.finish()
        if out is not None:
            estimate.trajectory.write_tum(out, bridge.feeds.start_ns or 0)
    if not quiet:
        for name, n in sorted({**bridge.feeds.counts, **odometry.counts}.items()):
            typer.echo(f"{name:28} {n:,}")


def _address(text: str) -> tuple[str, int]:
    host, _, port = text.rpartition(":")
    if not port.isdecimal() or int(port) > MOST_PORT:
        msg = f"--foxglove: expected a port, or a host and a port such as 0.0.0.0:8765, got {text}"
        raise UsageError(msg)
    return host or "127.0.0.1", int(port)


def _changes(bridge: "Bridge", odometry: "Odometry", end: float) -> "Iterator[str]":
    """Run until the end, and yield each new status."""
    said = ""
    while time.monotonic() < end:
        bridge.step()
        if odometry.status != said:
            said = odometry.status
            yield said
