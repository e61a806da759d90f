#!/usr/bin/env python3
"""The objects of deploy/kubernetes against the schemas that Kubernetes and KEDA publish, from npm.

    tests/deploy/kubernetes_schemas_test.py FOLDER

FOLDER: where npm installs the schemas. Exits with 77 (skipped) without python3-yaml, npm or its registry.
"""

import copy
import json
import os
import shutil
import subprocess
import sys

sys.dont_write_bytecode = True
HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, HERE)
try:
    import kubernetes_checks as kube
except ImportError as missing:
    print(f"SKIPPED: {missing} (Debian's python3-yaml is needed)")
    sys.exit(77)

KUBERNETES = os.path.join(HERE, "..", "..", "deploy", "kubernetes")
PACKAGES = ("kubernetes-models@4.5.1", "@kubernetes-models/keda@0.4.2")
# Reads objects, one a line, and prints the complaints of each.
CHECK = """
const readline = require("readline").createInterface({input: process.stdin});
readline.on("line", line => {
  const thing = JSON.parse(line);
  const root = thing.apiVersion.startsWith("keda.sh/") ? "@kubernetes-models/keda" : "kubernetes-models";
  const Model = require(`${root}/${thing.apiVersion}`)[thing.kind];
  try { new Model(thing).validate(); console.log("ok"); }
  catch (e) { console.log(String(e.message).replace(/\\s+/g, " ")); }
});
"""


def install(folder):
    """Why the schemas are not there; empty: they are."""
    if not shutil.which("npm") or not shutil.which("node"):
        return "no npm"
    stamp = os.path.join(folder, "installed")
    if os.path.exists(stamp):
        with open(stamp, encoding="utf-8") as file:
            if file.read() == " ".join(PACKAGES):
                return ""
    os.makedirs(folder, exist_ok=True)
    result = subprocess.run(
        ["npm", "install", "--prefix", folder, "--no-audit", "--no-fund", "--loglevel=error", *PACKAGES],
        capture_output=True, text=True, check=False)  # fmt: skip
    if result.returncode != 0:
        return "npm cannot install " + " ".join(PACKAGES) + ": " + result.stderr[-300:]
    with open(stamp, "w", encoding="utf-8") as file:
        file.write(" ".join(PACKAGES))
    return ""


def check(folder, objects):
    """What is wrong with each object; "ok": nothing."""
    lines = "".join(json.dumps(thing) + "\n" for thing in objects)
    # From within the folder, so that node finds the packages.
    result = subprocess.run(
        ["node", "-e", CHECK], input=lines, cwd=folder, capture_output=True, text=True, check=True)  # fmt: skip
    said = result.stdout.splitlines()
    assert len(said) == len(objects), said
    return said


def main(folder):
    why_not = install(folder)
    if why_not:
        print("SKIPPED:", why_not)
        sys.exit(77)
    objects = []
    for name in ("base", "autoscaling", "kueue"):
        path = os.path.join(KUBERNETES, name)
        objects += kube.build_by_kubectl(path) or kube.build(path)
    problems = [f"{kube.name_of(thing)}: {said}" for thing, said in zip(objects, check(folder, objects)) if said != "ok"]
    if problems:
        sys.exit("\n".join(problems))
    # Faults are noticed in each kind.
    spoiled = [copy.deepcopy(thing) for thing in {thing["kind"]: thing for thing in objects}.values()]
    for thing in spoiled:
        thing["spec" if thing["kind"] != "Namespace" else "metadata"] = ["no object"]
    noticed = sum(said != "ok" for said in check(folder, spoiled))
    if noticed != len(spoiled):
        sys.exit(f"only {noticed} of {len(spoiled)} faults were noticed")
    print(f"{len(objects)} objects of {len(spoiled)} kinds are valid")


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit("usage: kubernetes_schemas_test.py FOLDER")
    main(sys.argv[1])
