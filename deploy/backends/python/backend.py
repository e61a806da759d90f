#!/usr/bin/env python3
"""A model server for color3d in Python: wrap a colourization model of your own here.

The README in the folder above says how to install and run it. Replace colorize() (and outpaint(), if
you have a generator) by calls of your models; the rest is the protocol
(proto/color3d/backend/v1/backend.proto).
"""

import argparse
import io

import grpc
import numpy as np
from PIL import Image

import serving
from serving import backend_pb2, backend_pb2_grpc

MAX_PIXELS = 50_000_000


def read_gray(png):
    """The photo as height x width floats, 0..1, from 8 or 16 bits."""
    picture = np.asarray(Image.open(io.BytesIO(png)))
    if picture.ndim != 2:
        raise ValueError("the photo is not a grey PNG")
    return picture.astype(np.float32) / (255.0 if picture.dtype == np.uint8 else 65535.0)


def read_rgb(png):
    """The coloured key view as height x width x 3 floats, 0..1."""
    picture = np.asarray(Image.open(io.BytesIO(png)).convert("RGB"))
    return picture.astype(np.float32) / 255.0


def write_rgb(rgb):
    """PNG of height x width x 3 floats, 0..1."""
    stream = io.BytesIO()
    Image.fromarray((np.clip(rgb, 0, 1) * 255 + 0.5).astype(np.uint8)).save(stream, "PNG")
    return stream.getvalue()


def colorize(gray, prompt, seed, report):
    """Your model goes here: height x width greys in, height x width x 3 colours out, both 0..1.

    This one knows no model: sepia, or blueprint blue when the prompt asks for blue. The luminance
    may change a little; color3d puts the photo's own back. Call report(0..1) as you go: it raises
    when the call has been cancelled.
    """
    del seed  # nothing here is random
    tint = (0.85, 1.0, 1.35) if "blue" in prompt.lower() else (1.2, 1.0, 0.72)
    report(0.5)
    return gray[..., None] * np.array(tint, np.float32)


def outpaint(rgb, index, seed):
    """Your generator goes here: another picture of the same scene, any size.

    This one turns the picture into one corner of a canvas and mirrors it beyond its outer sides.
    """
    del seed  # nothing here is random
    height, width = rgb.shape[:2]
    part = rgb[::2, ::2]
    above, left = index // 2 % 2, index % 2
    rows, columns = height - part.shape[0], width - part.shape[1]
    pad = ((rows * above, rows * (1 - above)), (columns * left, columns * (1 - left)), (0, 0))
    return np.pad(part, pad, mode="symmetric")


class Backend(backend_pb2_grpc.ColorBackendServicer):
    def GetInfo(self, request, context):
        return backend_pb2.BackendInfo(
            name="color3d python example",
            version="1",
            license="Apache-2.0",
            capabilities=[
                backend_pb2.CAPABILITY_AUTOMATIC,
                backend_pb2.CAPABILITY_TEXT_PROMPT,
                backend_pb2.CAPABILITY_SEED,
                backend_pb2.CAPABILITY_OUTPAINT,
            ],
            max_pixels=MAX_PIXELS,
            deterministic=True,
            ready=True,  # False while the model loads: color3d asks again
        )

    def Colorize(self, request, context):
        yield backend_pb2.ColorizeUpdate(progress=0.0)
        try:
            gray = read_gray(request.image)
            if gray.size > MAX_PIXELS:
                raise ValueError(f"the photo has {gray.size} pixels; at most {MAX_PIXELS}")

            def report(progress):
                del progress  # a model that runs for minutes should yield it from here
                if not context.is_active():
                    raise RuntimeError("cancelled")

            rgb = colorize(gray, request.prompt, request.seed, report)
        except (ValueError, OSError) as error:
            context.abort(grpc.StatusCode.INVALID_ARGUMENT, str(error))
        if rgb.shape != gray.shape + (3,) or not np.isfinite(rgb).all():
            context.abort(grpc.StatusCode.INTERNAL, f"the model returned shape {rgb.shape}")
        yield backend_pb2.ColorizeUpdate(image=write_rgb(rgb))

    def Generate(self, request, context):
        if request.kind != backend_pb2.CAPABILITY_OUTPAINT:
            context.abort(grpc.StatusCode.INVALID_ARGUMENT, "this server only outpaints")
        try:
            rgb = read_rgb(request.image)
        except (ValueError, OSError) as error:
            context.abort(grpc.StatusCode.INVALID_ARGUMENT, str(error))
        for index in range(request.samples):
            if not context.is_active():
                return
            picture = outpaint(rgb, index, request.seed)
            yield backend_pb2.GenerateUpdate(image=write_rgb(picture))


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    serving.add_flags(parser, "127.0.0.1:50662")
    serving.serve(Backend(), parser.parse_args())


if __name__ == "__main__":
    main()
