#!/usr/bin/env python3
"""Colours several scenes, each from a coloured picture of one of its photos, with progress.

    batch.py PHOTOS=COLOURED... -o OUT [--preset NAME]

Writes the results of a folder PHOTOS to OUT/NAME, where NAME is the last part of its path. A scene
that fails does not stop the others; the exit status is then 1. Run again, it continues: the server
answers finished work from its cache, and complete files are kept.
"""

import argparse
import sys
from pathlib import Path

import color3d
from color3d.v1 import job_pb2


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("scenes", nargs="+", metavar="PHOTOS=COLOURED")
    parser.add_argument("-o", "--out", required=True)
    parser.add_argument("--preset", default="fast")
    arguments = parser.parse_args()
    jobs, failures = {}, []
    with color3d.Client() as client:
        for text in arguments.scenes:
            photos, _, coloured = text.partition("=")
            name = Path(photos).resolve().name
            try:
                scene = client.upload(photos).name
                spec = client.colorize_spec(scene, key_color=coloured, preset=arguments.preset)
                jobs[client.submit(spec).name] = name
            except (color3d.InputError, color3d.RpcError) as e:
                failures.append(f"{name}: {e}")
        ended = (job_pb2.Job.STATE_SUCCEEDED, job_pb2.Job.STATE_FAILED, job_pb2.Job.STATE_CANCELLED)
        for event in client.watch(list(jobs)) if jobs else []:
            job = event.job
            progress = job.progress
            if job.name in jobs and job.state in ended:
                print(f"{jobs[job.name]}: {job_pb2.Job.State.Name(job.state)}", flush=True)
            elif job.parent in jobs and event.kind == job_pb2.JobEvent.KIND_PROGRESS:
                print(
                    f"{jobs[job.parent]}: {job.kind} {progress.step} of {progress.total_steps}, "
                    f"{max(progress.eta_seconds, 0):.0f} s left in this stage",
                    flush=True,
                )
        for job_name, name in jobs.items():
            try:
                [job] = client.wait([job_name])
                files = client.download(job, Path(arguments.out) / name)
                print(f"{name}: {len(files)} files in {Path(arguments.out) / name}")
            except (color3d.JobFailedError, color3d.InputError) as e:
                failures.append(f"{name}: {e}")
    for failure in failures:
        print(f"batch: {failure}", file=sys.stderr)
    return 1 if failures else 0


if __name__ == "__main__":
    try:
        sys.exit(main())
    except color3d.Error as error:
        sys.exit(f"batch: {error}")
