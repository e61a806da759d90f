"""Model servers in Python as real processes, with real edit servers behind them, good and bad.

Exits with 77 (skipped) where grpcio or the protocol's compiler is missing.
"""

import base64
import contextlib
import gzip
import http.server
import json
import os
import struct
import subprocess
import sys
import tempfile
import threading
import time
import unittest
import xmlrpc.client
import zlib

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, HERE)
sys.dont_write_bytecode = True

try:
    import grpc
    import serving
except ImportError as missing:
    print(f"SKIPPED: {missing} (python3-grpcio and python3-protobuf are needed)")
    sys.exit(77)
except SystemExit as missing:
    print(f"SKIPPED: {missing}")
    sys.exit(77)
import edit_client
import png
from serving import backend_pb2, backend_pb2_grpc

DAMAGED = "a damaged PNG"


def gray16(width=48, height=32):
    """A photo as color3d sends it."""
    rows = b"".join(
        b"\0" + b"".join(struct.pack(">H", (x * 3 + y * 2) * 257) for x in range(width))
        for y in range(height)
    )
    return raw_png(width, height, 16, 0, rows)


def raw_png(width, height, depth, color, rows):
    data = png.SIGNATURE
    header = struct.pack(">IIBBBBB", width, height, depth, color, 0, 0, 0)
    for kind, part in ((b"IHDR", header), (b"IDAT", zlib.compress(rows)), (b"IEND", b"")):
        data += struct.pack(">I", len(part)) + kind + part
        data += struct.pack(">I", zlib.crc32(kind + part))
    return data


def means(data):
    """Mean red, green and blue."""
    width, height, channels, rows = png.read(data)
    assert channels == 3
    return [sum(sum(row[c::3]) for row in rows) / (width * height) for c in range(3)]


@contextlib.contextmanager
def started(script, *flags):
    """The address of one of this folder's servers."""
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "address")
        command = [sys.executable, os.path.join(HERE, script), "--port-file", path, *flags]
        log = open(os.path.join(folder, "log"), "wb")
        with log, subprocess.Popen(command, stdout=log, stderr=log) as process:
            try:
                end = time.monotonic() + 60
                while not os.path.exists(path):
                    assert process.poll() is None and time.monotonic() < end, f"{command} ended"
                    time.sleep(0.05)
                with open(path, encoding="utf-8") as file:
                    yield file.read().strip()
            finally:
                process.kill()


@contextlib.contextmanager
def backend(*flags):
    with started("edit_backend.py", "--listen", "127.0.0.1:0", *flags) as address:
        with grpc.insecure_channel(address) as channel:
            yield backend_pb2_grpc.ColorBackendStub(channel)


@contextlib.contextmanager
def answering(answer):
    """The URL of a server whose POST handler is answer(handler)."""

    class Handler(http.server.BaseHTTPRequestHandler):
        def do_POST(self):
            self.rfile.read(int(self.headers["Content-Length"]))
            with contextlib.suppress(OSError):
                answer(self)

        def log_message(self, *_):
            pass

    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    try:
        yield f"http://127.0.0.1:{server.server_port}/"
    finally:
        server.shutdown()
        server.server_close()


def sends(body, kind="image/png", status=200, **headers):
    def answer(handler):
        handler.send_response(status)
        for name, value in {"Content_Type": kind, "Content_Length": len(body), **headers}.items():
            handler.send_header(name.replace("_", "-"), str(value))
        handler.end_headers()
        handler.wfile.write(body)

    return answer


class PngTest(unittest.TestCase):
    def test_reads_every_filter_and_depth(self):
        width, height = 5, 6
        side = range(3 * width)
        pixels = [bytes((x * 31 + y * 17 + x * y) & 255 for x in side) for y in range(height)]
        packed, above = b"", bytes(3 * width)
        for y, row in enumerate(pixels):
            kind = y % 5
            out = bytearray([kind])
            for i, value in enumerate(row):
                left, up = (row[i - 3] if i >= 3 else 0), above[i]
                corner = above[i - 3] if i >= 3 else 0
                guess = left + up - corner
                paeth = min((left, up, corner), key=lambda v: abs(guess - v))
                out.append((value - (0, left, up, (left + up) // 2, paeth)[kind]) & 255)
            packed, above = packed + out, row
        self.assertEqual(
            png.read(raw_png(width, height, 8, 2, packed)),
            (width, height, 3, [bytearray(row) for row in pixels]),
        )
        width, height, channels, rows = png.read(gray16())
        self.assertEqual((width, height, channels, rows[1][2]), (48, 32, 1, 8))
        again = png.write(width, height, 3, png.rgb_rows(channels, rows))
        self.assertEqual(png.read(again)[3][1][6:9], bytes([8, 8, 8]))

    def test_refuses_what_it_cannot_read(self):
        good = gray16()
        flipped = good[:60] + bytes([good[60] ^ 1]) + good[61:]
        for data, words in (
            (b"", "no PNG"),
            (b"\xff\xd8\xff\xe0" + good, "no PNG"),
            (good[:70], DAMAGED),
            (flipped, DAMAGED),
            (good[:-12], "breaks off"),
            (raw_png(48, 32, 16, 0, b"\0" * 10), "breaks off"),
            (raw_png(4, 4, 8, 3, b"\0" * 20), "palette"),
            (raw_png(100_000, 100_000, 8, 0, b""), "pixels"),
            (raw_png(2, 1, 8, 0, b"\x07\1\1"), DAMAGED),
        ):
            with self.assertRaisesRegex(ValueError, words):
                png.read(data)


class ClientTest(unittest.TestCase):
    def test_templates(self):
        values = {"$image": "abc", "$prompt": "a $seed", "$seed": 7}
        template = {"images": ["$image"], "text": "so: $prompt, $seed", "seed": "$seed", "n": 2}
        self.assertEqual(
            edit_client.fill(template, values),
            {"images": ["abc"], "text": "so: a $seed, 7", "seed": 7, "n": 2},
        )
        self.assertEqual(edit_client.dig({"a": [{"b": 3}]}, "a.0.b"), 3)
        for path in ("a.1", "a.x", "c", "a.0.b.d"):
            with self.assertRaisesRegex(edit_client.EditError, "has no"):
                edit_client.dig({"a": [{"b": 3}]}, path)

    def test_refuses_bad_addresses(self):
        for url in ("ftp://host/", "127.0.0.1:8000", "http://", "http://h:x/", "http://me:pw@h/"):
            with self.assertRaises(ValueError):
                edit_client.EditServer(url, "json")

    def test_breaks_off_at_once(self):
        with answering(lambda handler: time.sleep(20)) as url:
            call = edit_client.Call()
            threading.Timer(0.3, call.cancel).start()
            start = time.monotonic()
            with self.assertRaises(edit_client.EditError) as raised:
                edit_client.EditServer(url, "multipart").edit(gray16(), "", 1, call)
            self.assertEqual(raised.exception.kind, "cancelled")
            self.assertLess(time.monotonic() - start, 5)


class GoodServerTest(unittest.TestCase):
    def colorize(self, stub, **request):
        updates = list(stub.Colorize(backend_pb2.ColorizeRequest(image=gray16(), **request)))
        self.assertTrue(updates[-1].image)
        return updates[-1].image

    def test_every_protocol_carries_picture_prompt_and_seed(self):
        with started("example_edit_server.py", "--port", "0") as url:
            for flags in (
                ["--url", url],
                ["--url", url + "/edit", "--protocol", "multipart"],
                ["--url", url + "/edit", "--protocol", "json"],
            ):
                with self.subTest(flags), backend(*flags) as stub:
                    info = stub.GetInfo(backend_pb2.GetInfoRequest())
                    self.assertTrue(info.ready)
                    self.assertIn(backend_pb2.CAPABILITY_TEXT_PROMPT, info.capabilities)
                    self.assertNotIn(backend_pb2.CAPABILITY_OUTPAINT, info.capabilities)
                    blue = self.colorize(stub, prompt="all blue", seed=1)
                    red = self.colorize(stub, prompt="red, please", seed=1)
                    self.assertEqual(png.size(blue), (48, 32))
                    self.assertGreater(means(blue)[2], means(blue)[0] + 10)
                    self.assertGreater(means(red)[0], means(red)[2] + 10)
                    self.assertEqual(red, self.colorize(stub, prompt="red, please", seed=1))
                    # More than XML-RPC's integers hold.
                    other = self.colorize(stub, prompt="red, please", seed=(1 << 63) + 6)
                    self.assertNotEqual(red, other)

    def test_generates_what_it_claims(self):
        with started("example_edit_server.py", "--port", "0") as url:
            flags = ["--url", url, "--generate", "outpaint", "--generate-method", "generate_frame"]
            with backend(*flags) as stub:
                info = stub.GetInfo(backend_pb2.GetInfoRequest())
                self.assertIn(backend_pb2.CAPABILITY_OUTPAINT, info.capabilities)
                request = backend_pb2.GenerateRequest(
                    image=self.colorize(stub, prompt="red"),
                    kind=backend_pb2.CAPABILITY_OUTPAINT,
                    samples=4,
                    seed=4,
                )
                pictures = [update.image for update in stub.Generate(request) if update.image]
                self.assertEqual(len(set(pictures)), 4)
                request.kind = backend_pb2.CAPABILITY_ANIMATE
                with self.assertRaises(grpc.RpcError) as raised:
                    list(stub.Generate(request))
                self.assertEqual(raised.exception.code(), grpc.StatusCode.INVALID_ARGUMENT)

    def test_fields_template_headers_and_answer_as_the_server_wants_them(self):
        seen = {}
        picture = base64.b64encode(png.write(48, 32, 3, [bytes(144)] * 32)).decode()

        def answer(handler):
            seen.update(handler.headers)
            body = json.dumps({"images": ["data:image/png;base64," + picture]}).encode()
            sends(body, "application/json; charset=utf-8")(handler)

        with tempfile.NamedTemporaryFile("w") as headers, answering(answer) as url:
            headers.write("Authorization: Bearer abc\n")
            headers.flush()
            template = '{"init_images": ["$image"], "prompt": "$prompt", "steps": 20}'
            flags = ["--url", url, "--protocol", "json", "--template", template]
            flags += ["--answer", "images.0", "--header-file", headers.name]
            with backend(*flags) as stub:
                self.assertEqual(png.size(self.colorize(stub)), (48, 32))
        self.assertEqual(seen["Authorization"], "Bearer abc")


class BadServerTest(unittest.TestCase):
    def expect(self, answer, code, *words, protocol="multipart", flags=()):
        with answering(answer) as url:
            with backend("--url", url, "--protocol", protocol, *flags) as stub:
                with self.assertRaises(grpc.RpcError) as raised:
                    list(stub.Colorize(backend_pb2.ColorizeRequest(image=gray16())))
        self.assertEqual(raised.exception.code(), code, raised.exception.details())
        for word in words:
            self.assertIn(word, raised.exception.details())
        self.assertNotIn("\n", raised.exception.details())

    def test_away(self):
        with answering(sends(b"")) as url:
            pass
        with backend("--url", url) as stub:
            for call in (
                lambda: stub.GetInfo(backend_pb2.GetInfoRequest()),
                lambda: list(stub.Colorize(backend_pb2.ColorizeRequest(image=gray16()))),
            ):
                with self.assertRaises(grpc.RpcError) as raised:
                    call()
                self.assertEqual(raised.exception.code(), grpc.StatusCode.UNAVAILABLE)
                for word in (url, "cannot be reached", "refused", "start it"):
                    self.assertIn(word, raised.exception.details())

    def test_answers_that_are_no_picture(self):
        refused = grpc.StatusCode.FAILED_PRECONDITION
        page = b"<html>\nHello"
        self.expect(sends(page, "text/html"), refused, "no PNG", "<html> Hello")
        self.expect(sends(b"\xff\xd8\xff\xe0JFIF", "image/jpeg"), refused, "no PNG", "image/jpeg")
        self.expect(sends(b""), refused, "no PNG")
        self.expect(sends(gzip.compress(gray16()), Content_Encoding="gzip"), refused, "packed")
        self.expect(sends(b"{}", "application/json"), refused, "has no \"image\"")
        self.expect(sends(b"{", "application/json"), refused, "no JSON")
        self.expect(sends(b"[" * 100_000, "application/json"), refused, "no JSON")
        self.expect(sends(b'{"image": "@@"}', "application/json"), refused, "base64")
        self.expect(sends(b'{"image": 3}', "application/json"), refused, "int")
        self.expect(sends(page, "text/xml"), refused, "no XML-RPC", protocol="xmlrpc")
        fault = xmlrpc.client.dumps(xmlrpc.client.Fault(1, "no memory on the card")).encode()
        self.expect(sends(fault, "text/xml"), refused, "no memory on the card", protocol="xmlrpc")

    def test_pictures_of_another_shape_or_length(self):
        refused = grpc.StatusCode.FAILED_PRECONDITION
        square = png.write(32, 32, 3, [bytes(96)] * 32)
        self.expect(sends(square), refused, "32 x 32 px", "48 x 32 px", "shape")
        flags = ["--max-answer-mib", "0.01"]
        self.expect(sends(gray16() + bytes(20_000)), refused, "more than 10485 bytes", flags=flags)
        cut = sends(gray16(), Content_Length=100_000)
        self.expect(cut, grpc.StatusCode.UNAVAILABLE, "broke off")

    def test_statuses(self):
        unavailable, refused = grpc.StatusCode.UNAVAILABLE, grpc.StatusCode.FAILED_PRECONDITION
        self.expect(sends(b"loading", status=503), unavailable, "busy", "loading")
        self.expect(sends(b"no such model", status=404), refused, "404", "no such model")
        self.expect(sends(b"", status=302, Location="/ui"), refused, "302", "/ui")

    def test_a_server_that_takes_too_long(self):
        def drip(handler):
            sends(b"", Content_Length=1000)(handler)
            for _ in range(100):
                handler.wfile.write(b"x")
                time.sleep(0.2)

        late = grpc.StatusCode.DEADLINE_EXCEEDED
        self.expect(lambda handler: time.sleep(8), late, "in 1 s", flags=["--timeout", "1"])
        self.expect(drip, late, "in 1 s", flags=["--timeout", "1"])

    def test_flags(self):
        for flags, words in (
            (["--url", "localhost"], "no address"),
            (["--url", "http://h/", "--fields", "a,b"], "three names"),
            (["--url", "http://h/", "--template", "{"], "edit_backend.py:"),
            (["--url", "http://h/", "--template", "{}"], "no $image"),
            (["--url", "http://h/", "--timeout", "nan"], "--timeout"),
            (["--url", "http://h/", "--max-pixels", "5"], "--max-pixels"),
            (["--url", "http://h/", "--header-file", "/nowhere"], "/nowhere"),
            (["--url", "http://h/", "--header-file", __file__], "no header"),
        ):
            command = [sys.executable, os.path.join(HERE, "edit_backend.py"), *flags]
            result = subprocess.run(command, capture_output=True, text=True, check=False)
            self.assertEqual(result.returncode, 1)
            self.assertIn(words, result.stderr)
            self.assertEqual(result.stderr.count("\n"), 1, result.stderr)


if __name__ == "__main__":
    unittest.main()
