#!/usr/bin/env python3
"""Prints the test programs that a name or a change concerns, one a line.

    tests/test_targets.py BUILD --name REGEX       programs, test suites or cases that match
    tests/test_targets.py --check-long     fails if a pattern after LONG in a CMakeLists.txt names no case
    tests/test_targets.py BUILD --changed [REV]    programs with sources in the folders that changed
                                                   since REV (default: the commit where this branch
                                                   left main, or the last commit on main)

Reads BUILD/compile_commands.json, so BUILD must be configured, not built.
"""
import argparse
import fnmatch
import json
import os
import re
import subprocess
import sys

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
TARGET = re.compile(r"CMakeFiles/([^/]+)\.dir/")
LONG = re.compile(r"\bLONG\s+([^)]*)\)")
CASE = re.compile(r"^\s*TEST(?:_F|_P)?\(\s*(\w+),\s*(\w+)", re.MULTILINE)


def read(path):
    with open(path, encoding="utf-8", errors="replace") as file:
        return file.read()


def sources_of_tests(build):
    """Sources by test program, relative to the repository."""
    sources = {}
    for entry in json.loads(read(os.path.join(build, "compile_commands.json"))):
        match = TARGET.search(entry.get("output") or entry["command"])
        if not match or not match.group(1).endswith("_test"):
            continue
        files = [os.path.join(entry["directory"], entry["file"])]
        if "/Unity/" in files[0]:  # written at configuration, includes the sources
            files = re.findall(r'#include "([^"]+)"', read(files[0]))
        relative = [os.path.relpath(file, ROOT) for file in files]
        sources.setdefault(match.group(1), []).extend(relative)
    return sources


def targets_by_name(sources, pattern):
    regex = re.compile(pattern)
    for target, files in sources.items():
        cases = (f"{suite}.{case}" for file in files for suite, case in CASE.findall(read(os.path.join(ROOT, file))))
        if regex.search(target) or any(regex.search(case) for case in cases):
            yield target


def git(*arguments):
    return subprocess.check_output(["git", "-C", ROOT, *arguments], text=True).split("\n")


def changed_folders(since):
    if not since:
        base = git("merge-base", "HEAD", "main")[0]
        since = base if base != git("rev-parse", "HEAD")[0] else "HEAD~1"
    files = git("diff", "--name-only", since) + git("ls-files", "--others", "--exclude-standard")
    return {os.path.dirname(file) for file in files if file}


def patterns_without_cases():
    """Patterns after LONG that match no case, because the case was renamed."""
    tests = [read(os.path.join(ROOT, file)) for file in git("ls-files", "*_test.cc") if file]
    cases = [".".join(case) for text in tests for case in CASE.findall(text)]
    for file in git("ls-files", "*CMakeLists.txt"):
        for arguments in LONG.findall(read(os.path.join(ROOT, file))) if file else []:
            for pattern in re.findall(r"[\w*]+\.[\w*]+", arguments):
                if not fnmatch.filter(cases, pattern):
                    yield f"{file}: LONG {pattern} names no case"


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("build", nargs="?")
    parser.add_argument("--check-long", action="store_true")
    parser.add_argument("--name")
    parser.add_argument("--changed", nargs="?", const="")
    arguments = parser.parse_args()
    if arguments.check_long:
        sys.exit("\n".join(patterns_without_cases()) or 0)
    sources = sources_of_tests(arguments.build)
    if arguments.name is not None:
        found = targets_by_name(sources, arguments.name)
    else:
        folders = changed_folders(arguments.changed)
        found = (target for target, files in sources.items() if folders & {os.path.dirname(file) for file in files})
    print("\n".join(sorted(set(found))))


if __name__ == "__main__":
    main()
