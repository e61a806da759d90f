#!/usr/bin/env python3
"""Runs color3d-load-bench and fails if the service is slower than the limits below.

  load_limits.py PROGRAM [ARGUMENT...]
"""
import json
import subprocess
import sys

MIN_CALLS_PER_SECOND = 5000
MAX_GET_P99_MS = 50
MAX_CREATE_P99_MS = 20


def problems(result):
    get, create = result["get_job"], result["create_job"]
    if get["calls_per_second"] < MIN_CALLS_PER_SECOND:
        yield f"{get['calls_per_second']:.0f} calls of GetJob per second; the minimum is {MIN_CALLS_PER_SECOND}"
    if get["p99_ms"] >= MAX_GET_P99_MS:
        yield f"GetJob's p99 is {get['p99_ms']:.1f} ms; the maximum is {MAX_GET_P99_MS}"
    if create["p99_ms"] >= MAX_CREATE_P99_MS:
        yield f"CreateJob's p99 is {create['p99_ms']:.1f} ms; the maximum is {MAX_CREATE_P99_MS}"
    if result["failed_calls"] > 0:
        yield f"{result['failed_calls']} calls failed"


def main():
    run = subprocess.run(sys.argv[1:], stdout=subprocess.PIPE, check=True)
    print(run.stdout.decode(), end="")
    found = list(problems(json.loads(run.stdout)))
    for problem in found:
        print("load_limits:", problem, file=sys.stderr)
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
