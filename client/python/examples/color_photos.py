#!/usr/bin/env python3
"""Colours a folder of monochrome photos from one coloured picture, and writes the results.

    color_photos.py PHOTOS COLOURED -o OUT [--key-view NAME] [--set stage.field=value]...

COLOURED has the name and the size of one of the photos, unless --key-view names the photo. The
server is that of COLOR3D_SERVER (default 127.0.0.1:50551); COLOR3D_TOKEN is its token.
"""

import argparse
import json
import sys
from pathlib import Path

import color3d
from color3d.v1 import job_pb2


def option(text):
    """("max_side_px", 400) for "max_side_px=400"."""
    name, _, value = text.partition("=")
    try:
        return name, json.loads(value)  # numbers, true, false
    except ValueError:
        return name, value


def show(event):
    """Prints each stage that begins or ends."""
    job, kind = event.job, job_pb2.JobEvent.KIND_STATE
    if event.kind == kind and job.parent:
        state = job_pb2.Job.State.Name(job.state).replace("STATE_", "").lower()
        print(f"{job.kind:24}{state}", flush=True)


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("photos")
    parser.add_argument("coloured")
    parser.add_argument("-o", "--out", required=True)
    parser.add_argument("--key-view", default="")
    parser.add_argument("--set", dest="options", type=option, action="append", default=[])
    arguments = parser.parse_args()
    try:
        with color3d.Client() as client:
            job = client.colorize(
                arguments.photos,
                arguments.out,
                key_color=arguments.coloured,
                key_view=arguments.key_view,
                options=dict(arguments.options),
                on_event=show,
            )
    except color3d.Error as e:
        sys.exit(f"color_photos: {e}")
    metrics = json.loads((Path(arguments.out) / "metrics.json").read_text(encoding="utf-8"))
    print(f"{job.name}: {metrics['share_seen']:.0%} of the colours were seen in the key view")
    print(f"report: {Path(arguments.out) / 'report.html'}")


if __name__ == "__main__":
    main()
