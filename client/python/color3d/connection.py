"""Connection to one server: address, credentials, time limits and retries. Thread-safe."""

from __future__ import annotations

import ipaddress
import os
import re
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Callable, Iterable, Iterator, Optional, Union

import grpc

from color3d.errors import InputError, RpcError, UnreachableError, lost

PathLike = Union[str, Path]
DEFAULT_SERVER = "127.0.0.1:50551"

_FIRST_WAIT_S, _LONGEST_WAIT_S = 0.2, 3.0
_CONNECT_LIMIT_S = 4.0
_FULL_SERVER_PATIENCE_S = 600.0
_MAX_MESSAGE_BYTES = 64 << 20  # a scene of 10,000 files with long names
_TRACEPARENT = re.compile("[0-9a-f]{2}-[0-9a-f]{32}-[0-9a-f]{16}-[0-9a-f]{2}")


@dataclass(frozen=True)
class Tls:
    """TLS of a connection: PEM files.

    ca: roots in place of the system's, e.g. the server's own certificate.
    certificate, key: of this client, for servers that require one.
    """

    ca: Optional[PathLike] = None
    certificate: Optional[PathLike] = None
    key: Optional[PathLike] = None


class Backoff:
    """Waits between attempts: 0.2 s, doubling up to 3 s, for `patience_s` after a success."""

    def __init__(self, patience_s: float) -> None:
        self._patience_s = patience_s
        self.reset()

    def reset(self) -> None:
        """Call it after a success."""
        self._next_s, self._since = _FIRST_WAIT_S, time.monotonic()
        self._full_since = self._since

    def wait(self, error: Optional[RpcError] = None, again: bool = False) -> bool:
        """Sleeps before the next attempt.

        Returns False if patience is exhausted, and for errors that are final unless `again`.
        """
        now = time.monotonic()
        if error and error.is_turned_away():
            if now - self._full_since > _FULL_SERVER_PATIENCE_S:
                return False
            time.sleep(error.retry_delay_s)
            self._since = time.monotonic()
            return True
        is_final = error is not None and not again and not error.is_transient()
        if is_final or now - self._since > self._patience_s:
            return False
        time.sleep(max(self._next_s, error.retry_delay_s if error else 0.0))
        self._next_s = min(self._next_s * 2, _LONGEST_WAIT_S)
        return True


class Connection:
    """address: HOST:PORT, unix:PATH, or https://HOST:PORT for TLS. token: empty: none.

    patience_s: maximum time to wait for an unreachable server, seconds.
    Waits at most 4 s for the server. Raises UnreachableError; InputError for a malformed address,
    for a token that would travel unencrypted to another machine and for files that cannot be read.
    Calls belong to the trace of the variable TRACEPARENT, as W3C Trace Context defines it.
    """

    def __init__(self, address: str, token: str, tls: Optional[Tls], patience_s: float) -> None:
        self.address = address
        self.patience_s = patience_s
        self._metadata = [("authorization", f"Bearer {token}")] if token else []
        trace = os.environ.get("TRACEPARENT", "").strip()
        if _TRACEPARENT.fullmatch(trace):
            self._metadata.append(("traceparent", trace))
        uses_tls = tls is not None or address.startswith("https://")
        host_port = address[len("https://") :] if address.startswith("https://") else address
        here = _is_loopback(host_port)
        if token and not uses_tls and not here:
            raise InputError(
                f"the token would be sent to {address} unencrypted; give https://{address}, with "
                "tls=Tls(ca=FILE) if the server's certificate is self-signed"
            )
        options = [
            ("grpc.max_receive_message_length", _MAX_MESSAGE_BYTES),
            ("grpc.initial_reconnect_backoff_ms", int(_FIRST_WAIT_S * 1000)),
            ("grpc.min_reconnect_backoff_ms", 1000),
            ("grpc.max_reconnect_backoff_ms", int(_LONGEST_WAIT_S * 1000)),
            # A connection without answers is closed after 20 s, not at the limit of each call.
            ("grpc.keepalive_time_ms", 10_000),
            ("grpc.keepalive_timeout_ms", 10_000),
            ("grpc.http2.max_pings_without_data", 0),
            # http_proxy in the environment does not apply to this machine.
            ("grpc.enable_http_proxy", 0 if here else 1),
        ]
        if uses_tls:
            credentials = grpc.ssl_channel_credentials(*_read_pems(tls or Tls()))
            self.channel = grpc.secure_channel(host_port, credentials, options)
        else:
            self.channel = grpc.insecure_channel(host_port, options)
        try:
            grpc.channel_ready_future(self.channel).result(timeout=_CONNECT_LIMIT_S)
        except grpc.FutureTimeoutError:
            why, remedy = (
                "",
                "start one with `color3d-server serve --data-dir DIR`, or give its address",
            )
            if uses_tls:
                why = f" over TLS: {self._why_unreachable()}"
                remedy = "check the address, ca and, if the server requires one, certificate"
            self.channel.close()
            raise UnreachableError(f"cannot reach a server at {address}{why}; {remedy}") from None

    def _why_unreachable(self) -> str:
        """The error of a call without a connection, e.g. why the certificate is rejected."""
        method = self.channel.unary_unary("/color3d.v1.ServerService/GetServerInfo")
        try:
            method(b"", timeout=2)
        except grpc.RpcError as e:
            return str(e.details())
        return "the server did not answer in time"

    def call(self, method: Callable[..., Any], request: Any, time_limit_s: float = 30.0) -> Any:
        """Makes one unary call, e.g. call(client.jobs.GetJob, request).

        Retries for patience_s while the server is unreachable, and for ten minutes while it is
        busy. Requests that create something must have a request_id, so that retries do nothing
        twice. Raises RpcError, UnreachableError.
        """
        backoff: Optional[Backoff] = None
        while True:
            try:
                return method(request, timeout=time_limit_s, metadata=self._metadata)
            except grpc.RpcError as e:
                error = RpcError(e)
            backoff = backoff or Backoff(self.patience_s)  # the failure may take long to detect
            if backoff.wait(error):
                continue
            if error.code == grpc.StatusCode.UNAVAILABLE and not error.reason:
                raise lost(self.address, error)
            raise error

    def stream(
        self, method: Callable[..., Any], request: Any, time_limit_s: Optional[float] = None
    ) -> Iterator[Any]:
        """Yields the answers of one call, without retries. Cancels it if the caller stops early."""
        answers = method(request, timeout=time_limit_s, metadata=self._metadata)
        try:
            for answer in answers:
                yield answer
        except grpc.RpcError as e:
            raise RpcError(e) from None
        finally:
            answers.cancel()

    def send(self, method: Callable[..., Any], requests: Iterable[Any], time_limit_s: float) -> Any:
        """Sends a stream of requests without retries and returns the answer. Raises RpcError."""
        try:
            return method(iter(requests), timeout=time_limit_s, metadata=self._metadata)
        except grpc.RpcError as e:
            raise RpcError(e) from None


def _is_loopback(address: str) -> bool:
    if address.startswith("unix:"):
        return True
    host, colon, port = address.rpartition(":")
    if "://" in address or not colon or not port.isdigit():
        raise InputError(f"'{address}' is not an address; give HOST:PORT, e.g. {DEFAULT_SERVER}")
    try:
        return ipaddress.ip_address(host.strip("[]")).is_loopback
    except ValueError:
        return host == "localhost"


def _read_pems(tls: Tls) -> Iterator[Optional[bytes]]:
    """The order of grpc.ssl_channel_credentials: roots, key, certificate."""
    for file in (tls.ca, tls.key, tls.certificate):
        try:
            yield Path(file).read_bytes() if file else None
        except OSError as e:
            raise InputError(f"cannot read {file}: {e.strerror}; give a PEM file") from None
