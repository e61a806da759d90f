#!/usr/bin/env python3
"""Chooses the photos to colour, and reads the scores of jobs as a table.

    key_views.py choose PHOTOS -o OUT [--count N]   their names; OUT/key_view.png is the first
    key_views.py table JOB...                       one row for each job of colorize, as CSV

The table has the key views of each job, its scores if true colours were given (delta_e00_chroma:
mean CIEDE2000 of the chroma of held-out views), and the photo to colour next with the error that is
expected then.
"""

import argparse
import csv
import json
import sys

import color3d

COLUMNS = [
    "key_views",
    "delta_e00_chroma",
    "delta_e00_gray",
    "psnr_rgb",
    "share_seen",
    "share_guessed",
    "seconds_total",
    "next_key_view",
    "expected_error_now",
    "expected_error_with_next",
]


def choose(client, arguments):
    """Prints the chosen photos, the best first."""
    scene = client.upload(arguments.photos).name
    [job] = client.wait([client.select_key_views(scene, arguments.count).name])
    client.download(job, arguments.out)
    for view in client.chosen_views(job):
        print(view)


def table(client, arguments):
    """Prints one row for each job."""
    writer = csv.writer(sys.stdout, lineterminator="\n")
    writer.writerow(["job", *COLUMNS])
    for name in arguments.jobs:
        metrics = json.loads(client.read_artifact(name, "metrics.json"))
        metrics["key_views"] = " ".join(metrics["key_views"])
        writer.writerow([name] + [metrics.get(column, "") for column in COLUMNS])


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    commands = parser.add_subparsers(dest="command", required=True)
    chooser = commands.add_parser("choose")
    chooser.add_argument("photos")
    chooser.add_argument("-o", "--out", required=True)
    chooser.add_argument("--count", type=int, default=1)
    chooser.set_defaults(run=choose)
    reader = commands.add_parser("table")
    reader.add_argument("jobs", nargs="+", metavar="JOB")
    reader.set_defaults(run=table)
    arguments = parser.parse_args()
    try:
        with color3d.Client() as client:
            arguments.run(client, arguments)
    except color3d.Error as e:
        sys.exit(f"key_views: {e}")


if __name__ == "__main__":
    main()
