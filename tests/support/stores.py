# SPDX-License-Identifier: MIT OR Apache-2.0
"""An object store on this machine, and a connection to it that breaks."""

from __future__ import annotations

import socket
from contextlib import contextmanager, suppress
from threading import Thread
from typing import TYPE_CHECKING
from urllib.parse import urlsplit
from urllib.request import Request, urlopen

import pytest

if TYPE_CHECKING:
    from collections.abc import Iterator

ABSENT = "moto and s3fs are not installed"


class Bucket:
    """A bucket of S3 in this process.

    Attributes
    ----------
    endpoint : address of the store
    url : of the bucket
    """

    def __init__(self, endpoint: str) -> None:
        import boto3

        self.endpoint, self.url = endpoint, "s3://flights"
        # It keeps what earlier servers of this process were given.
        urlopen(Request(f"{endpoint}/moto-api/reset", method="POST")).close()
        self._client = boto3.client("s3", endpoint_url=endpoint)
        self._client.create_bucket(Bucket="flights")

    def put(self, name: str, content: bytes | str) -> None:
        """Write an object."""
        body = content.encode() if isinstance(content, str) else content
        self._client.put_object(Bucket="flights", Key=name, Body=body)

    def read(self, name: str) -> bytes:
        """Read an object."""
        return self._client.get_object(Bucket="flights", Key=name)["Body"].read()

    def remove(self, name: str) -> None:
        """Remove an object."""
        self._client.delete_object(Bucket="flights", Key=name)

    def written(self) -> dict[str, str]:
        """When each object was written, with its hash."""
        pages = self._client.get_paginator("list_objects_v2").paginate(Bucket="flights")
        objects = [one for page in pages for one in page.get("Contents", [])]
        return {one["Key"]: f"{one['LastModified']} {one['ETag']}" for one in objects}


@contextmanager
def s3_store(monkeypatch: pytest.MonkeyPatch) -> Iterator[Bucket]:
    """Yield an empty bucket that `s3://` finds."""
    pytest.importorskip("s3fs", reason=ABSENT)
    server = pytest.importorskip("moto.server", reason=ABSENT).ThreadedMotoServer(
        ip_address="127.0.0.1", port=0, verbose=False
    )
    for name in ("AWS_ACCESS_KEY_ID", "AWS_SECRET_ACCESS_KEY"):
        monkeypatch.setenv(name, "anything")
    monkeypatch.setenv("AWS_DEFAULT_REGION", "us-east-1")
    server.start()
    try:
        endpoint = "http://{}:{}".format(*server.get_host_and_port())
        monkeypatch.setenv("AWS_ENDPOINT_URL", endpoint)
        forget_connections()
        yield Bucket(endpoint)
    finally:
        server.stop()
        forget_connections()


def forget_connections() -> None:
    """Let what is opened next find its store anew."""
    import s3fs

    s3fs.S3FileSystem.clear_instance_cache()


@contextmanager
def breaking(endpoint: str, n_breaks: int, after: int) -> Iterator[str]:
    """Yield the address of a way to a store that breaks some times, each after so many bytes of an answer."""
    listener = socket.create_server(("127.0.0.1", 0))
    left = [n_breaks]

    def serve(near: socket.socket) -> None:
        host = urlsplit(endpoint)
        with near, socket.create_connection((host.hostname, host.port)) as far:
            Thread(target=_forward, args=(near, far, [0], after), daemon=True).start()
            _forward(far, near, left, after)

    def accept() -> None:
        with suppress(OSError):
            while True:
                Thread(target=serve, args=(listener.accept()[0],), daemon=True).start()

    Thread(target=accept, daemon=True).start()
    try:
        yield f"http://127.0.0.1:{listener.getsockname()[1]}"
    finally:
        listener.close()


def _forward(source: socket.socket, sink: socket.socket, left: list[int], after: int) -> None:
    """Hand on bytes until the end, or until the connection breaks."""
    n_bytes = 0
    with suppress(OSError):
        while block := source.recv(2**16):
            n_bytes += len(block)
            if left[0] and n_bytes > after:
                left[0] -= 1
                break
            sink.sendall(block)
        for one in (source, sink):
            one.shutdown(socket.SHUT_RDWR)
