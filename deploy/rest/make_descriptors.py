#!/usr/bin/env python3
"""Writes the descriptors of the public API with the HTTP rules of http_rules.yaml, for Envoy.

    make_descriptors.py OUT.pb [--proto FOLDER]

FOLDER: the folder proto of the sources (default) or of an installation (share/color3d/proto). Needs
protoc, python3-protobuf and python3-yaml.
"""

import argparse
import os
import subprocess
import sys

try:
    import yaml
    from google.protobuf import descriptor_pb2
except ImportError as missing:
    sys.exit(f"make_descriptors: {missing}; install python3-protobuf and python3-yaml")

HERE = os.path.dirname(os.path.abspath(__file__))
PROTOS = [
    f"color3d/v1/{name}.proto" for name in ("scene", "blob", "job", "colorizer", "server", "admin")
]
# The details of errors are converted to JSON, too.
PROTOS += ["google/bytestream/bytestream.proto", "google/rpc/error_details.proto"]
# Field numbers of google.api.HttpRule, and of its extension of MethodOptions.
FIELDS = {
    "selector": 1,
    "get": 2,
    "put": 3,
    "post": 4,
    "delete": 5,
    "patch": 6,
    "body": 7,
    "response_body": 12,
}
HTTP = 72295728


def read_rules():
    """The rules of http_rules.yaml."""
    with open(os.path.join(HERE, "http_rules.yaml"), encoding="utf-8") as file:
        return yaml.safe_load(file)["http"]["rules"]


def varint(value):
    """A number in protobuf's encoding."""
    data = b""
    while value >= 128:
        data += bytes([value & 127 | 128])
        value >>= 7
    return data + bytes([value])


def field(number, data):
    """A field with bytes in protobuf's encoding."""
    return varint(number << 3 | 2) + varint(len(data)) + data


def annotate(descriptors, rules):
    """Adds the rules to the options of their methods. Exits if one has no method."""
    wanted = {rule["selector"]: rule for rule in rules}
    if len(wanted) != len(rules):
        sys.exit("make_descriptors: http_rules.yaml has two rules for one method")
    for file in descriptors.file:
        for service in file.service:
            for method in service.method:
                rule = wanted.pop(f"{file.package}.{service.name}.{method.name}", None)
                if rule:
                    data = b"".join(field(FIELDS[key], text.encode()) for key, text in rule.items())
                    method.options.MergeFromString(field(HTTP, data))
    if wanted:
        sys.exit(
            f"make_descriptors: there is no method {', '.join(sorted(wanted))}; correct "
            "http_rules.yaml"
        )


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawTextHelpFormatter
    )
    parser.add_argument("out")
    parser.add_argument("--proto", default=os.path.join(HERE, "..", "..", "proto"))
    arguments = parser.parse_args()
    # What `services` of envoy.yaml names must be in the file, with all that it imports.
    command = [
        "protoc",
        "-I",
        arguments.proto,
        "--include_imports",
        "--descriptor_set_out=/dev/stdout",
    ]
    made = subprocess.run(command + PROTOS, capture_output=True, check=False)
    if made.returncode != 0:
        sys.exit(f"make_descriptors: protoc: {made.stderr.decode().strip()}; give --proto FOLDER")
    descriptors = descriptor_pb2.FileDescriptorSet.FromString(made.stdout)
    annotate(descriptors, read_rules())
    with open(arguments.out, "wb") as file:
        file.write(descriptors.SerializeToString())


if __name__ == "__main__":
    main()
