"""Asks an image-edit server over HTTP or XML-RPC; standard library only."""

import base64
import binascii
import http.client
import json
import socket
import threading
import time
import urllib.parse
import xml.parsers.expat
import xmlrpc.client

import png

_CHUNK = 1 << 16
_QUOTED = 200


class EditError(Exception):
    """What went wrong, in one line. `kind`: "away", "late", "cancelled" or "refused"."""

    def __init__(self, kind, text):
        super().__init__(text)
        self.kind = kind


def _quote(data):
    text = data[:_QUOTED].decode("utf-8", "replace") if isinstance(data, bytes) else str(data)
    return '"' + " ".join(text[:_QUOTED].split()) + '"'


def fill(template, values):
    """A JSON template with "$image", "$prompt" and "$seed" replaced: alone in a string by the value
    itself (a seed stays a number), within a longer one by its text."""
    if isinstance(template, dict):
        return {key: fill(value, values) for key, value in template.items()}
    if isinstance(template, list):
        return [fill(value, values) for value in template]
    if not isinstance(template, str):
        return template
    if template in values:
        return values[template]
    # Only what the template itself says is replaced, never what a value brought in.
    parts, rest = [], template
    while True:
        found = [(rest.find(name), name) for name in values if name in rest]
        if not found:
            return "".join(parts) + rest
        at, name = min(found)
        parts += [rest[:at], str(values[name])]
        rest = rest[at + len(name) :]


def dig(value, path):
    """The element of a JSON value at "a.0.b"; raises EditError naming what is missing."""
    for step in path.split("."):
        try:
            value = value[int(step)] if isinstance(value, list) else value[step]
        except (KeyError, IndexError, TypeError, ValueError):
            raise EditError("refused", f"its answer has no {_quote(path)}") from None
    return value


def picture_of(value):
    """The bytes of a picture that may be base64 text or a data: URL."""
    if isinstance(value, xmlrpc.client.Binary):
        return value.data
    if isinstance(value, (bytes, bytearray)):
        return bytes(value)
    if not isinstance(value, str):
        kind = type(value).__name__
        raise EditError("refused", f"it answered with {kind} where a picture was due")
    text = value.partition(",")[2] if value.startswith("data:") else value
    try:
        return base64.b64decode("".join(text.split()), validate=True)
    except (binascii.Error, ValueError):
        why = f"it answered with {_quote(text)} where base64 was due"
        raise EditError("refused", why) from None


class EditServer:
    """One image-edit server.

    url: http:// or https://. protocol: "xmlrpc" (calls method(png, prompt, seed)), "multipart"
    (form fields, see `fields`) or "json" (`template`, see fill()). answer: where in the JSON answer
    the picture is, "images.0"; an answer that is a picture itself is taken as it is. timeout_s:
    for the whole call.
    """

    def __init__(
        self,
        url,
        protocol,
        *,
        method="colorize_frame",
        fields=("image", "prompt", "seed"),
        template=None,
        answer="image",
        headers=None,
        timeout_s=540.0,
        max_answer_bytes=64 << 20,
    ):
        self.url = url
        self._parts = urllib.parse.urlsplit(url)
        if self._parts.scheme not in ("http", "https") or not self._parts.hostname:
            raise ValueError(f"{url} is no address like http://127.0.0.1:8000/path")
        if self._parts.username or self._parts.password:
            raise ValueError("give a password as a header, not in the address")
        self._port = self._parts.port  # raises ValueError for one that is none
        path = self._parts.path
        if protocol == "xmlrpc" and path in ("", "/"):
            path = "/RPC2"
        self._path = urllib.parse.urlunsplit(("", "", path or "/", self._parts.query, ""))
        self._protocol = protocol
        self._method, self._fields, self._template, self._answer = method, fields, template, answer
        self._headers = headers or {}
        self._timeout_s = timeout_s
        self._max_answer_bytes = max_answer_bytes

    def check(self, timeout_s=3.0):
        """Raises EditError if no server listens there."""
        port = self._port or (443 if self._parts.scheme == "https" else 80)
        try:
            socket.create_connection((self._parts.hostname, port), timeout_s).close()
        except OSError as error:
            raise self._away(error) from None

    def edit(self, image, prompt, seed, call=None, method=None):
        """The bytes of the answered picture. `image`: a PNG. `call`: a Call, to break it off."""
        call = call or Call()
        body, content_type = self._request(image, prompt, seed, method or self._method)
        content_type, answer = self._post(body, content_type, call)
        picture = self._picture(content_type, answer)
        try:
            png.size(picture)
        except ValueError:
            raise EditError(
                "refused", f"the edit server answered with no PNG but {_quote(picture)}"
            ) from None
        return picture

    def _away(self, error):
        reason = getattr(error, "strerror", None) or str(error) or type(error).__name__
        why = f"the edit server {self.url} cannot be reached ({reason}): start it"
        return EditError("away", why)

    def _request(self, image, prompt, seed, method):
        if self._protocol == "xmlrpc":
            # XML-RPC knows integers of 32 bits.
            values = (xmlrpc.client.Binary(image), _xml_text(prompt), seed & 0x7FFFFFFF)
            return xmlrpc.client.dumps(values, method).encode(), "text/xml"
        if self._protocol == "multipart":
            names = dict(zip(("image", "prompt", "seed"), self._fields))
            return _multipart(names, image, prompt, seed)
        text = base64.b64encode(image).decode()
        values = {"$image": text, "$prompt": prompt, "$seed": seed & 0x7FFFFFFF}
        return json.dumps(fill(self._template, values)).encode(), "application/json"

    def _post(self, body, content_type, call):
        secure = self._parts.scheme == "https"
        connect = http.client.HTTPSConnection if secure else http.client.HTTPConnection
        end = time.monotonic() + self._timeout_s
        connection = connect(self._parts.hostname, self._port, timeout=min(10.0, self._timeout_s))
        try:
            try:
                connection.connect()
            except OSError as error:
                raise self._away(error) from None
            sock = connection.sock  # http.client lets go of it where the server closes afterwards
            call.watch(sock)
            headers = {"Content-Type": content_type, "Accept-Encoding": "identity", **self._headers}
            sock.settimeout(max(0.1, end - time.monotonic()))
            connection.request("POST", self._path, body, headers)
            response = connection.getresponse()
            answer = self._read(response, sock, end)
            return self._checked(response, answer)
        except TimeoutError:
            raise EditError(
                "late", f"the edit server {self.url} did not answer in {self._timeout_s:g} s"
            ) from None
        except (OSError, http.client.HTTPException) as error:
            if call.cancelled:
                raise EditError("cancelled", "the call was cancelled") from None
            raise EditError(
                "away", f"the edit server {self.url} broke off ({type(error).__name__}: {error})"
            ) from None
        finally:
            connection.close()

    def _read(self, response, sock, end):
        parts, count = [], 0
        while True:
            left = end - time.monotonic()
            if left <= 0:
                raise TimeoutError
            if sock.fileno() >= 0:  # it is closed once all is read
                sock.settimeout(left)
            part = response.read1(_CHUNK)
            if not part:
                break
            parts.append(part)
            count += len(part)
            if count > self._max_answer_bytes:
                raise EditError(
                    "refused",
                    f"the edit server answered with more than {self._max_answer_bytes} bytes",
                )
        if response.length:
            raise http.client.IncompleteRead(b"", response.length)
        return b"".join(parts)

    def _checked(self, response, answer):
        if response.status in (429, 502, 503, 504):
            raise EditError(
                "away", f"the edit server is busy (HTTP {response.status}: {_quote(answer)})"
            )
        if response.status != 200:
            place = response.getheader("Location")
            more = f"; it points to {place}" if place else ""
            raise EditError(
                "refused", f"the edit server answered HTTP {response.status} {_quote(answer)}{more}"
            )
        if (response.getheader("Content-Encoding") or "identity") != "identity":
            raise EditError("refused", "the edit server packed its answer though asked not to")
        return response.getheader("Content-Type") or "", answer

    def _picture(self, content_type, answer):
        if answer.startswith(png.SIGNATURE):
            return answer
        if self._protocol == "xmlrpc":
            return _xmlrpc_picture(answer)
        if not content_type.startswith("application/json"):
            raise EditError(
                "refused",
                f"the edit server answered with no PNG but {content_type} {_quote(answer)}",
            )
        try:
            value = json.loads(answer)
        except (ValueError, RecursionError):
            raise EditError("refused", f"its answer is no JSON: {_quote(answer)}") from None
        return picture_of(dig(value, self._answer))


def _xmlrpc_picture(answer):
    try:
        values, _ = xmlrpc.client.loads(answer)
    except xmlrpc.client.Fault as fault:
        raise EditError("refused", f"the edit server failed: {_quote(fault.faultString)}") from None
    except (xml.parsers.expat.ExpatError, xmlrpc.client.Error, ValueError, TypeError, LookupError):
        raise EditError("refused", f"its answer is no XML-RPC: {_quote(answer)}") from None
    return picture_of(values[0] if len(values) == 1 else None)


def _xml_text(text):
    """Without the characters that XML cannot hold."""
    return "".join(c if c in "\t\n\r" or ord(c) >= 32 else " " for c in text)


def _multipart(names, image, prompt, seed):
    boundary = "color3d-" + base64.b16encode(binascii.crc32(image).to_bytes(4, "big")).decode()
    while boundary.encode() in image or boundary in prompt:
        boundary += "x"
    body = b""
    for key, data in (("prompt", prompt.encode()), ("seed", str(seed).encode()), ("image", image)):
        if not names[key]:
            continue
        extra = '; filename="photo.png"\r\nContent-Type: image/png' if key == "image" else ""
        head = f'--{boundary}\r\nContent-Disposition: form-data; name="{names[key]}"{extra}\r\n\r\n'
        body += head.encode() + data + b"\r\n"
    body += f"--{boundary}--\r\n".encode()
    return body, f"multipart/form-data; boundary={boundary}"


class Call:
    """A call that another thread may break off."""

    def __init__(self):
        self.cancelled = False
        self._socket = None
        self._lock = threading.Lock()

    def watch(self, sock):
        with self._lock:
            self._socket = sock
            if self.cancelled:
                raise ConnectionAbortedError

    def cancel(self):
        with self._lock:
            self.cancelled = True
            if self._socket is not None:
                try:
                    self._socket.shutdown(socket.SHUT_RDWR)
                except OSError:
                    pass
