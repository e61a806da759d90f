#!/usr/bin/env python3
"""Draws comments, test names, error messages and helps of commands at random, to be read as a stranger.

    tests/draw_samples.py --seed N [--color3d PATH]

Prints ten comments, ten test names, five error messages and the help of five commands, each with its
place. The same seed and the same tree give the same draw.
"""
import argparse
import os
import random
import re
import subprocess
import sys

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
SLASH_COMMENTS = (".h", ".cc", ".proto", ".mjs", ".js")
HASH_COMMENTS = (".py", ".sh", ".cmake", "CMakeLists.txt")
NO_PROSE = re.compile(r"^[\s/#*=-]*$|NOLINT|clang-format|^namespace( |$)|fmt: |^! ")
TEST = re.compile(r"^\s*TEST(?:_F|_P)?\(\s*(\w+),\s*(\w+)", re.MULTILINE)
THROW = re.compile(
    r"\b(?:throw\s+[\w:]+|return\s+(?:\w+::)*(?:Error|ServiceError|InvalidArgument|Status))\s*\("
)
LITERAL = re.compile(r'"(?:[^"\\\n]|\\.)*"')
COMMAND = re.compile(r"^  ([a-z][\w-]*) ", re.MULTILINE)


def tracked_files():
    listed = subprocess.check_output(["git", "-C", ROOT, "ls-files", "-z"], text=True)
    return sorted(path for path in listed.split("\0") if path and os.path.isfile(os.path.join(ROOT, path)))


def read(path):
    with open(os.path.join(ROOT, path), encoding="utf-8", errors="replace") as file:
        return file.read()


def comments(path, text):
    """Comments of a file as (place, text); neighbouring lines are one comment."""
    marker = "//" if path.endswith(SLASH_COMMENTS) else "#" if path.endswith(HASH_COMMENTS) else None
    if not marker:
        return
    whole_line = re.compile(rf"^\s*{marker}+ ?(.*)$")
    behind_code = re.compile(rf'^[^"\']*[^"\'\s:][^"\']*\s{marker} (.*)$')
    block, begin = [], 0
    for number, line in enumerate(text.split("\n") + [""], 1):
        match = None if line.startswith("#!") else whole_line.match(line)
        if match:
            block, begin = block + [match.group(1)], begin or number
            continue
        if block:
            yield f"{path}:{begin}", " ".join(block)
            block, begin = [], 0
        match = behind_code.match(line)
        if match:
            yield f"{path}:{number}", match.group(1)


def arguments(text, begin):
    """The text from `begin` to the parenthesis that closes the call, strings skipped."""
    depth, at = 1, begin
    while at < len(text) and depth:
        literal = LITERAL.match(text, at)
        if literal:
            at = literal.end()
            continue
        depth += {"(": 1, ")": -1}.get(text[at], 0)
        at += 1
    return text[begin : at - 1]


def error_messages(path, text):
    for match in THROW.finditer(text):
        call = arguments(text, match.end())
        if LITERAL.search(call):
            call = re.sub(r'"\s*\n\s*"', "", call)  # adjacent literals are one
            yield f"{path}:{text.count(chr(10), 0, match.start()) + 1}", " ".join(call.split())


def help_of(program, command):
    return subprocess.run([program, *command, "--help"], capture_output=True, text=True, check=True).stdout


def commands(program, command=()):
    """All commands of the program with their helps; a group of commands counts as one, too."""
    text = help_of(program, command)
    yield " ".join(("color3d", *command)), text
    listed = text.partition("Subcommands:")[2].partition("\n\n")[0]
    for name in COMMAND.findall(listed):
        yield from commands(program, (*command, name))


def draw(generator, title, samples, count):
    samples = list(samples)
    print(f"== {title}: {min(count, len(samples))} of {len(samples)}\n")
    for place, text in generator.sample(samples, min(count, len(samples))):
        print(f"{place}\n    " + text.rstrip().replace("\n", "\n    ") + "\n")


def main():
    parser = argparse.ArgumentParser(
        description="Draw comments, test names, error messages and helps of commands at random."
    )
    parser.add_argument("--seed", type=int, required=True, help="seed of the draw")
    parser.add_argument("--color3d", metavar="PATH", help="client program; without it no helps are drawn")
    options = parser.parse_args()

    generator = random.Random(options.seed)
    files = [(path, read(path)) for path in tracked_files() if path.endswith(SLASH_COMMENTS + HASH_COMMENTS)]
    tests = [(path, text) for path, text in files if path.endswith("_test.cc")]
    product = [(path, text) for path, text in files if path.endswith(".cc") and not path.startswith("tests/")]
    product = [(path, text) for path, text in product if not path.endswith("_test.cc")]

    prose = (comment for path, text in files for comment in comments(path, text))
    draw(generator, "comments", (sample for sample in prose if not NO_PROSE.search(sample[1])), 10)
    names = ((path, f"{suite}.{case}") for path, text in tests for suite, case in TEST.findall(text))
    draw(generator, "test names", names, 10)
    draw(generator, "error messages", (m for path, text in product for m in error_messages(path, text)), 5)
    if options.color3d:
        draw(generator, "helps of commands", commands(options.color3d), 5)
    else:
        print("== helps of commands: none drawn, --color3d was not given")
    return 0


if __name__ == "__main__":
    sys.exit(main())
