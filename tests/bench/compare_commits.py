#!/usr/bin/env python3
"""Compares the run time and error of this tree with those of an earlier commit, on the same machine.

    tests/bench/compare_commits.py REV SCENE... [--rounds 3] [--out DIR] [--build DIR] [-- OPTIONS]

Builds REV in DIR/REV (default: build-compare). Each round runs `color3d colorize SCENE --benchmark`
with both builds, in turn, each on a fresh server. Prints, for each scene, the medians of seconds,
error and PSNR and the ratio of the seconds, and to stderr those of the stages. OPTIONS: further options of `color3d colorize`; both
commits must know them. Let nothing else run meanwhile.
"""
import argparse
import json
import os
import shutil
import statistics
import subprocess
import sys
import tempfile
import time

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
PROGRAMS = ["color3d", "color3d-server", "color3d-worker"]
SERVER_START_SECONDS = 30


def built(folder, rev):
    """Folder with the programs of `rev`, which are built if need be."""
    source = os.path.join(folder, rev)
    build = os.path.join(source, "build")
    if not os.path.exists(source):
        os.makedirs(folder, exist_ok=True)
        subprocess.run(["git", "-C", ROOT, "worktree", "add", "--detach", source, rev], check=True)
    subprocess.run(
        ["cmake", "-S", source, "-B", build, "-G", "Ninja", "-DCMAKE_BUILD_TYPE=Release",
         "-DCOLOR3D_TESTS=OFF"], check=True, stdout=subprocess.DEVNULL)
    subprocess.run(["cmake", "--build", build, "--target", *PROGRAMS], check=True,
                   stdout=sys.stderr)
    return os.path.join(build, "bin")


def run(programs, scene, out, options):
    """Seconds and metrics of one run on a fresh server."""
    shutil.rmtree(out, ignore_errors=True)
    with tempfile.TemporaryDirectory() as data:
        address = os.path.join(data, "address")
        with open(os.path.join(data, "server.log"), "w", encoding="utf-8") as log:
            server = subprocess.Popen(
                [os.path.join(programs, "color3d-server"), "serve", "--listen", "127.0.0.1:0",
                 "--data-dir", os.path.join(data, "store"), "--port-file", address],
                stdout=log, stderr=log)
        try:
            give_up = time.monotonic() + SERVER_START_SECONDS
            while not (os.path.exists(address) and os.path.getsize(address)):
                if server.poll() is not None or time.monotonic() > give_up:
                    sys.exit(f"compare_commits: {programs}/color3d-server did not start")
                time.sleep(0.05)
            with open(address, encoding="utf-8") as file:
                environment = dict(os.environ, COLOR3D_SERVER=file.read().strip())
            start = time.monotonic()
            done = subprocess.run(
                [os.path.join(programs, "color3d"), "colorize", scene, "-o", out, "--benchmark",
                 *options], check=False, env=environment, capture_output=True, text=True)
            seconds = time.monotonic() - start
            if done.returncode != 0:
                sys.exit(f"compare_commits: {programs}/color3d failed:\n{done.stderr}")
        finally:
            server.terminate()
            server.wait()
    with open(os.path.join(out, "metrics.json"), encoding="utf-8") as file:
        return seconds, json.load(file)


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("rev")
    parser.add_argument("scenes", nargs="+", metavar="scene")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--out", default="compare-out")
    parser.add_argument("--build", default="build-compare")
    arguments = sys.argv[1:]
    options = []
    if "--" in arguments:
        options = arguments[arguments.index("--") + 1:]
        arguments = arguments[:arguments.index("--")]
    args = parser.parse_args(arguments)
    rev = subprocess.run(["git", "-C", ROOT, "rev-parse", "--short", args.rev], check=True,
                         capture_output=True, text=True).stdout.strip()
    here = subprocess.run(["git", "-C", ROOT, "describe", "--always", "--dirty"], check=True,
                          capture_output=True, text=True).stdout.strip()
    commits = [(rev, built(os.path.abspath(args.build), rev)),
               (here, os.path.join(ROOT, "build", "bin"))]
    print("| scene | commit | seconds | error | PSNR of L, dB |\n|---|---|--:|--:|--:|")
    for scene in args.scenes:
        runs = {commit: [] for commit, _ in commits}
        for number in range(args.rounds):
            # The order changes, so that a machine that slows down favours neither.
            for commit, programs in commits[:: 1 if number % 2 == 0 else -1]:
                out = os.path.join(args.out, os.path.basename(scene), f"{commit}-{number}")
                runs[commit].append(run(programs, scene, out, options))
        median = {}
        for commit, _ in commits:
            median[commit] = statistics.median(seconds for seconds, _ in runs[commit])
            of_runs = [metrics for _, metrics in runs[commit]]
            error = statistics.median(metrics["delta_e00_chroma"] for metrics in of_runs)
            psnr = statistics.median(metrics["psnr_l"] for metrics in of_runs)
            print(f"| {os.path.basename(scene)} | {commit} | {median[commit]:.1f} | {error:.2f} "
                  f"| {psnr:.2f} |", flush=True)
        print(f"| {os.path.basename(scene)} | ratio | {median[rev] / median[here]:.2f} | | |",
              flush=True)
        stages = [name for name in runs[here][0][1] if name.startswith("seconds_")]
        for name in stages:
            both = [statistics.median(metrics.get(name, 0.0) for _, metrics in runs[commit])
                    for commit in (rev, here)]
            print(f"  {name[len('seconds_'):]}: {both[0]:.1f}, {both[1]:.1f} s", file=sys.stderr)


if __name__ == "__main__":
    main()
