#!/usr/bin/env python3
"""The smallest image-edit server: what edit_backend.py can talk to when no real one is at hand.

It knows no model: warm below, cool above, as hand-tinted postcards were, and the colour that the
prompt names (red, green, blue) everywhere. Standard library only.
  XML-RPC   POST /RPC2     colorize_frame(png, prompt, seed), generate_frame(png, prompt, seed)
  multipart POST /edit     fields image, prompt, seed; answers with the PNG
  JSON      POST /edit     {"image": base64, "prompt": text, "seed": N}; answers {"image": base64}
"""

import argparse
import base64
import email.parser
import email.policy
import http.server
import json
import os
import xmlrpc.client

import png

MAX_BYTES = 64 << 20
# Shifts of red, green and blue at mid grey.
TINTS = {"red": (40, -20, -20), "green": (-20, 30, -20), "blue": (-30, -5, 40)}
COOL, WARM = (-16, 0, 24), (28, 2, -30)


def tint(data, prompt, seed):
    """The picture in colour; the seed makes it a little stronger or weaker."""
    width, height, channels, rows = png.read(data)
    named = [shift for word, shift in TINTS.items() if word in prompt.lower()]
    strength = 0.9 + 0.2 * (seed % 8) / 7
    colored = []
    for y, row in enumerate(png.rgb_rows(channels, rows)):
        share = y / max(1, height - 1)
        shift = named[0] if named else [c + share * (w - c) for c, w in zip(COOL, WARM)]
        for c in range(3):
            # None at black and white, so that the picture's own light stays.
            lift = strength * shift[c] / 16256
            moved = (v + lift * v * (255 - v) for v in range(256))
            table = bytes(max(0, min(255, round(v))) for v in moved)
            row[c::3] = row[c::3].translate(table)
        colored.append(row)
    return png.write(width, height, 3, colored)


def mirror(data, prompt, seed):
    """The picture at half its size in one corner (the seed tells which), mirrored beyond."""
    del prompt
    width, height, channels, rows = png.read(data)
    rows = png.rgb_rows(channels, rows)

    def places(side, at_end):
        """Where in the picture each pixel of a mirrored side comes from."""
        half = [2 * i for i in range((side + 1) // 2)]
        count = side - len(half)
        beyond = half[:count][::-1] if at_end else half[::-1][:count]
        return beyond + half if at_end else half + beyond

    columns = places(width, seed % 2)
    made = []
    for y in places(height, seed // 2 % 2):
        made.append(b"".join(rows[y][3 * x : 3 * x + 3] for x in columns))
    return png.write(width, height, 3, made)


def form_of(content_type, body):
    """The fields of multipart/form-data as bytes."""
    head = f"Content-Type: {content_type}\r\n\r\n".encode()
    message = email.parser.BytesParser(policy=email.policy.HTTP).parsebytes(head + body)
    return {
        part.get_param("name", header="content-disposition"): part.get_payload(decode=True)
        for part in message.iter_parts()
    }


class Handler(http.server.BaseHTTPRequestHandler):
    def do_POST(self):
        try:
            length = int(self.headers.get("Content-Length") or -1)
            if not 0 <= length <= MAX_BYTES:
                raise ValueError(f"a request of {length} bytes; at most {MAX_BYTES}")
            content_type = self.headers.get("Content-Type") or ""
            kind, answer = self._answer(content_type, self.rfile.read(length))
        except Exception as error:  # whatever was wrong with the request
            self._send(400, "text/plain", f"{type(error).__name__}: {error}".encode())
        else:
            self._send(200, kind, answer)

    def _answer(self, content_type, body):
        if self.path.startswith("/RPC2"):
            return "text/xml", self._call(body)
        if content_type.startswith("multipart/form-data"):
            form = form_of(content_type, body)
            return "image/png", tint(form["image"], form["prompt"].decode(), int(form["seed"]))
        request = json.loads(body)
        picture = tint(base64.b64decode(request["image"]), request["prompt"], request["seed"])
        answer = {"image": base64.b64encode(picture).decode()}
        return "application/json", json.dumps(answer).encode()

    def _call(self, body):
        methods = {"colorize_frame": tint, "generate_frame": mirror}
        try:
            (image, prompt, seed), method = xmlrpc.client.loads(body)
            if method not in methods:
                raise ValueError(f"there is no method {method}")
            picture = xmlrpc.client.Binary(methods[method](image.data, prompt, seed))
            return xmlrpc.client.dumps((picture,), methodresponse=True).encode()
        except Exception as error:
            return xmlrpc.client.dumps(xmlrpc.client.Fault(1, str(error))).encode()

    def _send(self, status, kind, body):
        self.send_response(status)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--port", type=int, default=8000, help="0: any free one (8000)")
    parser.add_argument("--port-file", help="write the address here once it is bound")
    arguments = parser.parse_args()
    server = http.server.ThreadingHTTPServer(("127.0.0.1", arguments.port), Handler)
    address = f"http://127.0.0.1:{server.server_port}"
    if arguments.port_file:
        with open(arguments.port_file + ".new", "w", encoding="utf-8") as file:
            file.write(address + "\n")
        os.replace(arguments.port_file + ".new", arguments.port_file)
    print(f"example_edit_server.py listens on {address}", flush=True)
    server.serve_forever()


if __name__ == "__main__":
    main()
