#!/usr/bin/env python3
"""What a container engine would send for `podman build`: the sources, and nothing that was built here.

    tests/integration/image_test.py SOURCES

Reads .dockerignore as engines do (patterns from the root, '*' within a name, '**' across folders) and the
Containerfile's COPY lines. Needs no engine.
"""
import os
import re
import sys

# Files of a local build.
BUILT = ["build/CMakeCache.txt", "build/bin/color3d", "build-tsan/CMakeCache.txt", "build-fuzz/x.o",
         ".git/config", ".cache/clangd/index", "tests/.npm/x", "a/b/node_modules/x.js",
         "tests/__pycache__/x.pyc"]


def to_regex(pattern):
    out = ""
    for part in re.split(r"(\*\*/|\*\*|\*|\?)", pattern.strip("/")):
        out += {"**/": "(?:.*/)?", "**": ".*", "*": "[^/]*", "?": "[^/]"}.get(part, re.escape(part))
    return re.compile(out + "(?:/.*)?$")


def sources(root):
    for folder, folders, files in os.walk(root):
        folders[:] = [f for f in folders if folder != root or not (f.startswith("build") or f in (".git", ".cache"))]
        folders[:] = [f for f in folders if f not in ("node_modules", "__pycache__", ".npm")]
        for name in files:
            yield os.path.relpath(os.path.join(folder, name), root)


def main(root):
    problems = []
    with open(os.path.join(root, ".dockerignore")) as file:
        lines = [line.strip() for line in file if line.strip() and not line.startswith("#")]
    if any(line.startswith("!") for line in lines):
        problems.append(".dockerignore has an exception ('!'), which this test does not support")
    patterns = [to_regex(line) for line in lines]
    is_ignored = lambda path: any(pattern.match(path) for pattern in patterns)
    problems += [f".dockerignore does not exclude {path}" for path in BUILT if not is_ignored(path)]
    problems += [f"{path} is a source, but .dockerignore excludes it" for path in sources(root)
                 if is_ignored(path) and not path.endswith(".swp")]
    with open(os.path.join(root, "deploy", "Containerfile")) as file:
        text = file.read().replace("\\\n", " ")
    for line in text.splitlines():
        words = line.split()
        if words[:1] != ["COPY"] or words[1].startswith("--from"):
            continue
        for path in words[1:-1]:
            if not os.path.exists(os.path.join(root, path)) or is_ignored(path):
                problems.append(f"Containerfile: COPY {path}, which does not exist")
    # The image's build would continue in the build folder of another machine.
    if not re.search(r"cmake -S \. -B /", text):
        problems.append("Containerfile: the build folder is inside the sources")
    for problem in problems:
        print("image_test:", problem, file=sys.stderr)
    print("image_test:", "failed" if problems else "ok")
    return 1 if problems else 0


sys.exit(main(sys.argv[1]))
