#!/usr/bin/env python3
"""A model server for color3d that passes each picture on to an image-edit server of yours.

The README in the folder above says how. HTTP (multipart or JSON) and XML-RPC; needs no package but
grpcio.
"""

import argparse
import json
import math
import sys
import threading

import grpc

import edit_client
import png
import serving
from serving import backend_pb2, backend_pb2_grpc

STATUS = {
    "away": grpc.StatusCode.UNAVAILABLE,
    "late": grpc.StatusCode.DEADLINE_EXCEEDED,
    "cancelled": grpc.StatusCode.CANCELLED,
    "refused": grpc.StatusCode.FAILED_PRECONDITION,
}
KINDS = {
    "outpaint": backend_pb2.CAPABILITY_OUTPAINT,
    "animate": backend_pb2.CAPABILITY_ANIMATE,
    "novel_view": backend_pb2.CAPABILITY_NOVEL_VIEW,
}
# A sign of life while the edit server works.
HEARTBEAT_S = 5.0
MAX_SHAPE_DIFFERENCE = 0.02


def outgoing(data):
    """The photo as every edit server reads it: PNG, RGB, 8 bits."""
    try:
        width, height, channels, rows = png.read(data)
    except ValueError as error:
        raise edit_client.EditError("refused", f"the photo is {error}") from None
    return png.write(width, height, 3, png.rgb_rows(channels, rows))


def check_shape(sent, answer):
    (width, height), (w, h) = png.size(sent), png.size(answer)
    rounding = 1.0 / min(width, height, w, h)
    if abs(math.log(w / h * height / width)) > MAX_SHAPE_DIFFERENCE + rounding:
        raise edit_client.EditError(
            "refused",
            f"the edit server answered with {w} x {h} px to a picture of {width} x {height} px; "
            "the shape must be the same",
        )


class EditBackend(backend_pb2_grpc.ColorBackendServicer):
    def __init__(self, server, arguments):
        self._server = server
        self._arguments = arguments
        # An edit server mostly has one graphics card: one call at a time.
        self._turn = threading.Lock()

    def GetInfo(self, request, context):
        try:
            self._server.check()
        except edit_client.EditError as error:
            context.abort(STATUS[error.kind], str(error))
        arguments = self._arguments
        capabilities = [backend_pb2.CAPABILITY_AUTOMATIC, backend_pb2.CAPABILITY_TEXT_PROMPT]
        if not arguments.no_seed:
            capabilities.append(backend_pb2.CAPABILITY_SEED)
        capabilities += [KINDS[kind] for kind in arguments.generate]
        return backend_pb2.BackendInfo(
            name=arguments.name,
            version=arguments.model_version,
            license=arguments.license,
            capabilities=capabilities,
            max_pixels=arguments.max_pixels,
            deterministic=arguments.deterministic,
            ready=True,
        )

    def Colorize(self, request, context):
        make = lambda call: self._colorize(request, call)
        yield from self._work(make, context, backend_pb2.ColorizeUpdate)

    def Generate(self, request, context):
        kinds = {KINDS[kind]: kind for kind in self._arguments.generate}
        if request.kind not in kinds:
            text = "start it with --generate for this kind of picture"
            context.abort(grpc.StatusCode.INVALID_ARGUMENT, text)
        for index in range(request.samples):
            make = lambda call: self._generate(request, kinds[request.kind], index, call)
            yield from self._work(make, context, backend_pb2.GenerateUpdate)

    def _colorize(self, request, call):
        sent = outgoing(request.image)
        answer = self._server.edit(
            sent, request.prompt or self._arguments.prompt, request.seed, call
        )
        check_shape(sent, answer)
        return answer

    def _generate(self, request, kind, index, call):
        prompt = self._arguments.generate_prompt.replace("$kind", kind)
        method = self._arguments.generate_method
        return self._server.edit(
            outgoing(request.image),
            prompt.replace("$index", str(index)),
            request.seed + index,
            call,
            method,
        )

    def _work(self, make, context, update):
        """Runs make(call) on a thread of its own, so that a heartbeat goes out meanwhile."""
        call = edit_client.Call()
        result = {}

        def run():
            try:
                with self._turn:
                    if not call.cancelled:
                        result["image"] = make(call)
            except edit_client.EditError as error:
                result["error"] = error
            except Exception as error:  # told to whoever waits, not to stderr alone
                text = f"{type(error).__name__}: {error}"
                result["error"] = edit_client.EditError("refused", text)

        if not context.add_callback(call.cancel):
            call.cancel()
        thread = threading.Thread(target=run, daemon=True)
        thread.start()
        while True:
            thread.join(HEARTBEAT_S)
            if not thread.is_alive():
                break
            yield update(progress=0.0)
        if "image" in result:
            yield update(image=result["image"])
        elif call.cancelled:
            context.abort(grpc.StatusCode.CANCELLED, "the call was cancelled")
        else:
            context.abort(STATUS[result["error"].kind], str(result["error"]))


def read_headers(lines):
    headers = {}
    for line in lines:
        name, colon, value = line.strip().partition(":")
        if not colon or not name or any(c in name for c in ' "()<>@'):
            raise ValueError(f"{line!r} is no header like 'Name: value'")
        headers[name] = value.strip()
    return headers


def parse_arguments():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    serving.add_flags(parser, "127.0.0.1:50662")
    add = parser.add_argument
    add("--url", required=True, help="the edit server: http://HOST:PORT/PATH")
    add("--protocol", choices=("xmlrpc", "multipart", "json"), default="xmlrpc")
    add("--method", default="colorize_frame", help="xmlrpc: the method, given (png, prompt, seed)")
    add("--fields", default="image,prompt,seed", help="multipart: their names; empty: left out")
    template = '{"image": "$image", "prompt": "$prompt", "seed": "$seed"}'
    add("--template", default=template, help=f"json: what is sent ({template})")
    add("--answer", default="image", help="json: where the picture is in the answer, e.g. images.0")
    add("--header-file", help="a file with lines 'Name: value', e.g. for Authorization")
    add("--prompt", default="colorize this photo", help="where the job has none")
    add("--generate", action="append", choices=sorted(KINDS), default=[], help="it makes such, too")
    add("--generate-prompt", default="the same scene: $kind $index", help="what it is asked then")
    add("--generate-method", help="xmlrpc: another method for them")
    add("--timeout", type=float, default=540.0, help="seconds for one picture (540)")
    add("--max-pixels", type=int, default=1 << 20, help="larger photos are sent smaller (1048576)")
    add("--max-answer-mib", type=float, default=64.0, help="longer answers are refused (64)")
    add("--no-seed", action="store_true", help="do not claim that the seed counts")
    add("--deterministic", action="store_true", help="claim that equal input gives equal pictures")
    add("--name", default="image-edit server", help="as color3d shows it, with the next two")
    add("--model-version", default="")
    add("--license", default="")
    arguments = parser.parse_args()
    try:
        fields = [name.strip() for name in arguments.fields.split(",")]
        if len(fields) != 3 or not fields[0] or any('"' in name or "\n" in name for name in fields):
            raise ValueError("--fields needs three names: IMAGE,PROMPT,SEED")
        if not 1.0 <= arguments.timeout <= 3600.0:
            raise ValueError("--timeout must be from 1 to 3600 seconds")
        if not 4096 <= arguments.max_pixels <= 50_000_000:
            raise ValueError("--max-pixels must be from 4096 to 50000000")
        if not 0.01 <= arguments.max_answer_mib <= 256.0:
            raise ValueError("--max-answer-mib must be from 0.01 to 256")
        template = json.loads(arguments.template)
        if "$image" not in json.dumps(template):
            raise ValueError("--template has no $image")
        headers = {}
        if arguments.header_file:
            with open(arguments.header_file, encoding="utf-8") as file:
                headers = read_headers(line for line in file if line.strip())
        server = edit_client.EditServer(
            arguments.url,
            arguments.protocol,
            method=arguments.method,
            fields=fields,
            template=template,
            answer=arguments.answer,
            headers=headers,
            timeout_s=arguments.timeout,
            max_answer_bytes=int(arguments.max_answer_mib * (1 << 20)),
        )
    except (ValueError, OSError) as error:
        sys.exit(f"edit_backend.py: {error}")
    return server, arguments


def main():
    server, arguments = parse_arguments()
    serving.serve(EditBackend(server, arguments), arguments)


if __name__ == "__main__":
    main()
