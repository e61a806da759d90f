"""Files to and from the server's blob store, resumable in both directions. Not thread-safe."""

from __future__ import annotations

import hashlib
import os
import stat
import uuid
from pathlib import Path
from typing import Callable, Dict, Iterator, List, Optional

import grpc

from color3d.connection import Backoff, Connection, PathLike
from color3d.errors import DamagedDataError, InputError, RpcError, lost
from color3d.v1 import blob_pb2, blob_pb2_grpc
from color3d.wire import bytestream_pb2, bytestream_pb2_grpc

# Called after each chunk: bytes done, of all bytes.
TransferProgress = Callable[[int, int], None]

_CHUNK_BYTES = 512 << 10
_SLOWEST_BYTES_PER_S = 32 << 10
_MAX_DIGESTS = 10_000


def digest_file(file: PathLike) -> blob_pb2.Digest:
    """Returns SHA-256 and size of a file. Raises InputError if it cannot be read."""
    sha, size = hashlib.sha256(), 0
    try:
        with open(file, "rb") as opened:
            for chunk in iter(lambda: opened.read(1 << 20), b""):
                sha.update(chunk)
                size += len(chunk)
    except OSError as e:
        raise InputError(f"cannot read {file}: {e.strerror}; give an existing file") from None
    return blob_pb2.Digest(sha256=sha.hexdigest(), size_bytes=size)


class Transfer:
    """Uploads and downloads over a connection. Broken streams resume where they ended, until the
    connection's patience passes without progress."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection
        self._blobs = blob_pb2_grpc.BlobServiceStub(connection.channel)
        self._bytes = bytestream_pb2_grpc.ByteStreamStub(connection.channel)

    def upload_missing(
        self, files: Dict[Path, blob_pb2.Digest], progress: Optional[TransferProgress] = None
    ) -> None:
        """Sends the files that the server lacks, each once.

        Raises RpcError, UnreachableError; InputError if a file has changed since its digest was
        computed.
        """
        by_sha = {digest.sha256: (file, digest) for file, digest in files.items()}
        digests = [digest for _, digest in by_sha.values()]
        missing: List[blob_pb2.Digest] = []
        for start in range(0, len(digests), _MAX_DIGESTS):
            request = blob_pb2.FindMissingBlobsRequest(
                digests=digests[start : start + _MAX_DIGESTS]
            )
            missing += self._connection.call(self._blobs.FindMissingBlobs, request).missing
        report = progress or (lambda done, total: None)
        total, done = sum(digest.size_bytes for digest in missing), 0
        for digest in missing:
            self._upload(by_sha[digest.sha256][0], digest, lambda sent: report(done + sent, total))
            done += digest.size_bytes
        report(total, total)

    def _upload(self, file: Path, digest: blob_pb2.Digest, progress: Callable[[int], None]) -> None:
        resource = f"uploads/{uuid.uuid4()}/{_resource(digest)}"
        query = bytestream_pb2.QueryWriteStatusRequest(resource_name=resource)
        limit_s = 60.0 + digest.size_bytes / _SLOWEST_BYTES_PER_S
        backoff = Backoff(self._connection.patience_s)
        committed, complete = 0, False
        while not complete:
            error: Optional[RpcError] = None
            try:
                chunks = _chunks(file, digest.size_bytes, resource, committed, progress)
                answer = self._connection.send(self._bytes.Write, chunks, limit_s)
                if answer.committed_size == digest.size_bytes:
                    return
            except RpcError as e:
                error = e
            if error and error.reason in ("DIGEST_MISMATCH", "SIZE_MISMATCH"):
                raise InputError(f"{file} changed while it was read; call again")
            if not backoff.wait(error, _may_resume(error)):
                raise _final(error, self._connection.address)
            status = self._connection.call(self._bytes.QueryWriteStatus, query)
            if status.committed_size > committed:
                backoff.reset()
            committed, complete = status.committed_size, status.complete

    def download(
        self,
        digest: blob_pb2.Digest,
        path: PathLike,
        progress: Optional[Callable[[int], None]] = None,
    ) -> None:
        """Writes a blob to `path` atomically.

        Writes into a hidden file beside it, which a later call resumes; then verifies and renames
        it. Sends no request if `path` already has these bytes. Raises RpcError, UnreachableError,
        DamagedDataError if other bytes arrive, OSError if the disk is full.
        """
        path = Path(path)
        if len(digest.sha256) != 64 or not set(digest.sha256) <= set("0123456789abcdef"):
            raise DamagedDataError(f"the server sent a malformed digest of {path.name}")
        if path.is_file() and not path.is_symlink() and digest_file(path) == digest:
            return
        path.parent.mkdir(parents=True, exist_ok=True)
        part = path.parent / f".color3d-{digest.sha256[:16]}.part"
        _remove_unless_plain(part)
        self._receive(digest, part, progress)
        if digest_file(part) != digest:  # e.g. what an earlier call left was damaged
            part.unlink()
            self._receive(digest, part, progress)
        if digest_file(part) != digest:
            part.unlink()
            raise DamagedDataError(
                f"the bytes received for {path.name} do not have the digest {digest.sha256}; call "
                "again"
            )
        with open(part, "rb") as written:
            os.fsync(written.fileno())
        os.replace(part, path)

    def _receive(
        self, digest: blob_pb2.Digest, part: Path, progress: Optional[Callable[[int], None]]
    ) -> None:
        """Appends to the part file until it has at least the size of the blob."""
        backoff = Backoff(self._connection.patience_s)
        limit_s = 300.0 + digest.size_bytes / _SLOWEST_BYTES_PER_S
        part.touch()
        received = part.stat().st_size
        while received < digest.size_bytes:
            before, error = received, None
            request = bytestream_pb2.ReadRequest(
                resource_name=_resource(digest), read_offset=received
            )
            try:
                with open(part, "ab") as output:
                    for answer in self._connection.stream(self._bytes.Read, request, limit_s):
                        output.write(answer.data)
                        received += len(answer.data)
                        if progress:
                            progress(received)
            except RpcError as e:
                error = e
            if received > before:
                backoff.reset()
            if received < digest.size_bytes and not backoff.wait(error, _may_resume(error)):
                raise _final(error, self._connection.address)


def _chunks(
    file: Path, size: int, resource: str, start: int, progress: Callable[[int], None]
) -> Iterator[bytestream_pb2.WriteRequest]:
    """Requests from the committed size to the end. The server refuses a file that has changed."""
    with open(file, "rb") as opened:
        opened.seek(start)
        offset, last = start, False
        while not last:
            data = opened.read(min(_CHUNK_BYTES, size - offset))
            last = not data or offset + len(data) == size
            yield bytestream_pb2.WriteRequest(
                resource_name=resource if offset == start else "",
                write_offset=offset,
                finish_write=last,
                data=data,
            )
            offset += len(data)
            progress(offset)


def _may_resume(error: Optional[RpcError]) -> bool:
    again = (grpc.StatusCode.ABORTED, grpc.StatusCode.DEADLINE_EXCEEDED)
    return error is None or error.code in again or error.reason == "OFFSET_MISMATCH"


def _final(error: Optional[RpcError], address: str) -> Exception:
    if error is None or (error.is_transient() and not error.reason):
        return lost(address, error)
    return error


def _resource(digest: blob_pb2.Digest) -> str:
    return f"blobs/{digest.sha256}/{digest.size_bytes}"


def _remove_unless_plain(path: Path) -> None:
    """Removes `path` unless it is a regular file with one name: writing must change no other."""
    if path.is_symlink() or path.exists():
        found = path.lstat()
        if not stat.S_ISREG(found.st_mode) or found.st_nlink != 1:
            path.unlink()


def safe_path_below(out: Path, name: str) -> Path:
    """Returns out/NAME and creates its folder.

    Raises DamagedDataError if the server's name is not a safe relative path, InputError if a
    folder in the path is a symbolic link or a file.
    """
    parts = name.split("/")
    if any(p in ("", ".", "..") for p in parts) or any(ord(c) < 32 or c in "\\\x7f" for c in name):
        raise DamagedDataError(f"the server names a file {name!r}, which is not safe to write")
    out.mkdir(parents=True, exist_ok=True)
    folder = out
    for part in parts[:-1]:
        folder = folder / part
        if folder.is_symlink() or (folder.exists() and not folder.is_dir()):
            raise InputError(
                f"{folder} is no folder; remove it, or name another folder for results"
            )
        folder.mkdir(exist_ok=True)
    return out / name
