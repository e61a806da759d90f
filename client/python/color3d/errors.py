"""Errors of the client. Each message names what is wrong and the remedy."""

from __future__ import annotations

from typing import List, Optional, Tuple

import grpc

from color3d.v1 import job_pb2
from color3d.wire import error_details_pb2, status_pb2


class Error(Exception):
    """Base of all errors of this package."""


class InputError(Error, ValueError):
    """Wrong input, found before anything was sent: a missing file, an unknown option, ..."""


class UnreachableError(Error, ConnectionError):
    """No server answers. Accepted jobs and uploaded files are kept; call again later."""


class DamagedDataError(Error):
    """The server sent other bytes, or an unsafe file name. Nothing was written."""


class JobFailedError(Error):
    """A job has failed or was cancelled.

    job: its last state. blamed: the first failed stage, or the job itself.
    """

    def __init__(self, message: str, job: job_pb2.Job, blamed: job_pb2.Job) -> None:
        super().__init__(message)
        self.job = job
        self.blamed = blamed


class RpcError(Error):
    """A call that the server has refused.

    code: grpc.StatusCode, e.g. NOT_FOUND.
    reason: stable name of the cause, e.g. "BLOB_MISSING"; empty for errors of the transport. All
        names: core/catalogue/error_reasons.cc.
    violations: (field or file, what is wrong with it), in the server's order.
    retry_delay_s: seconds after which the server accepts the call again; 0: not known.
    """

    def __init__(self, error: grpc.RpcError) -> None:
        self.code: grpc.StatusCode = error.code()
        self.reason = ""
        self.violations: List[Tuple[str, str]] = []
        self.retry_delay_s = 0.0
        trailers = dict(error.trailing_metadata() or ())
        status = status_pb2.Status()
        try:
            status.ParseFromString(trailers.get("grpc-status-details-bin", b""))
        except Exception:  # a proxy's own details: the message alone is shown
            status.Clear()
        for detail in status.details:
            self._read(detail.type_url.rpartition("/")[2], detail.value)
        text = error.details() or "the server gave no reason"
        for field, problem in self.violations:
            if problem not in text:
                text += f"\n  {field}: {problem}"
        own = (grpc.StatusCode.INTERNAL, grpc.StatusCode.DATA_LOSS, grpc.StatusCode.UNKNOWN)
        if self.code in own and "x-request-id" in trailers:
            text += f" (request {trailers['x-request-id']} in the server's log)"
        super().__init__(text)

    def _read(self, kind: str, value: bytes) -> None:
        if kind == "google.rpc.ErrorInfo":
            self.reason = error_details_pb2.ErrorInfo.FromString(value).reason
        elif kind == "google.rpc.RetryInfo":
            delay = error_details_pb2.RetryInfo.FromString(value).retry_delay
            self.retry_delay_s = delay.seconds + delay.nanos * 1e-9
        elif kind == "google.rpc.BadRequest":
            bad = error_details_pb2.BadRequest.FromString(value)
            self.violations += [(v.field, v.description) for v in bad.field_violations]
        elif kind == "google.rpc.QuotaFailure":
            quota = error_details_pb2.QuotaFailure.FromString(value)
            self.violations += [(v.subject, v.description) for v in quota.violations]

    def is_transient(self) -> bool:
        """The connection broke, or the server ended the call: the same call may succeed later."""
        return self.code == grpc.StatusCode.UNAVAILABLE or (
            self.code == grpc.StatusCode.CANCELLED and not self.reason
        )

    def is_turned_away(self) -> bool:
        """The server is busy: the same call may succeed after retry_delay_s."""
        if self.code != grpc.StatusCode.RESOURCE_EXHAUSTED or self.retry_delay_s <= 0:
            return False
        # Only its owner can reduce the amount stored.
        full = any(f.endswith(("stored_bytes", " scenes")) for f, _ in self.violations)
        return self.reason in ("QUEUE_FULL", "TOO_MANY_STREAMS") or (
            self.reason == "QUOTA_EXCEEDED" and not full
        )


def lost(address: str, error: Optional[RpcError] = None) -> UnreachableError:
    """The error for a server that answered before."""
    why = f" ({error})" if error else ""
    return UnreachableError(
        f"lost the server at {address}{why}; call again when it is back (uploaded files and "
        "accepted jobs are kept)"
    )
