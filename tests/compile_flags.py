#!/usr/bin/env python3
"""Prints the include paths and macros of all targets as a response file of GCC and Clang (@FILE).

    tests/compile_flags.py BUILD

BUILD must be configured: reads BUILD/compile_commands.json.
"""
import json
import os
import shlex
import sys

flags = {}
for entry in json.load(open(os.path.join(sys.argv[1], "compile_commands.json"), encoding="utf-8")):
    words = iter(shlex.split(entry["command"]))
    for word in words:
        if word == "-isystem":
            folder = next(words)
            # Compilers find /usr/include by themselves, and only in its own place.
            if os.path.realpath(folder) != "/usr/include":
                flags[f"-isystem {shlex.quote(folder)}"] = None
        elif word.startswith(("-I", "-D")):
            flags[shlex.quote(word)] = None
print("\n".join(flags))
