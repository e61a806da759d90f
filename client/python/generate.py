#!/usr/bin/env python3
"""Generates the modules of the API, color3d/v1 and color3d/wire, and source tarballs with them.

    generate.py modules FOLDER    writes FOLDER/v1 and FOLDER/wire
    generate.py tarball FOLDER    writes FOLDER/color3d-VERSION.tar.gz, for machines without protoc

Needs protoc and gRPC's Python plugin (Debian: protobuf-compiler, protobuf-compiler-grpc; or pip's
grpcio-tools); tarballs also need setuptools. COLOR3D_PROTO: folder with color3d/v1/*.proto.
"""

import os
import re
import shutil
import subprocess
import sys
import tempfile

HERE = os.path.dirname(os.path.abspath(__file__))
API = [
    "option",
    "blob",
    "scene",
    "key_view",
    "stage",
    "colorize_scene",
    "job",
    "colorizer",
    "server",
    "admin",
]
# Programs may load these protos from other packages, too. One process may have only one of each
# name, so they get names of their own: the bytes on the wire stay the same.
WIRE = {
    "google/rpc/status.proto": "google.rpc",
    "google/rpc/error_details.proto": "google.rpc",
    "google/bytestream/bytestream.proto": "google.bytestream",
}
PACKAGED = ["color3d", "examples", "pyproject.toml", "setup.py", "generate.py", "README.md"]


def proto_folder():
    """The folder of the protos, or an error with the remedy."""
    folder = os.environ.get("COLOR3D_PROTO", os.path.join(HERE, "..", "..", "proto"))
    if not os.path.exists(os.path.join(folder, "color3d", "v1", "job.proto")):
        sys.exit(f"generate: there is no color3d/v1/job.proto in {folder}; set COLOR3D_PROTO")
    return folder


def copy_protos(source, target):
    """Copies the protos of the public API with the names that WIRE asks for."""
    own = {path: f"color3d/wire/{os.path.basename(path)}" for path in WIRE}
    for path in [f"color3d/v1/{name}.proto" for name in API] + list(WIRE):
        with open(os.path.join(source, path), encoding="utf-8") as file:
            text = file.read()
        for old, new in own.items():
            text = text.replace(f'import "{old}"', f'import "{new}"')
        for package in set(WIRE.values()):
            text = re.sub(rf"\b{re.escape(package)}\b(?=[.;])", "color3d.wire", text)
        path = os.path.join(target, own.get(path, path))
        os.makedirs(os.path.dirname(path), exist_ok=True)
        with open(path, "w", encoding="utf-8") as file:
            file.write(text)


def without_service(folder, names):
    """The plugin writes a module for each proto; returns those that have nothing in them."""
    empty = []
    for name in names:
        if name.endswith("_pb2_grpc.py"):
            with open(os.path.join(folder, name), encoding="utf-8") as file:
                empty += [name] if "Stub(object)" not in file.read() else []
    return empty


def generate(package):
    """Writes the modules below the folder `package`."""
    protoc, plugin = shutil.which("protoc"), shutil.which("grpc_python_plugin")
    command = [protoc, f"--plugin=protoc-gen-grpc_python={plugin}"]
    if not protoc or not plugin:
        command = [sys.executable, "-m", "grpc_tools.protoc"]
    with tempfile.TemporaryDirectory(prefix="color3d-proto-") as folder:
        protos, made = os.path.join(folder, "protos"), os.path.join(folder, "made")
        os.mkdir(made)
        copy_protos(proto_folder(), protos)
        files = sorted(
            os.path.relpath(os.path.join(root, name), protos)
            for root, _, names in os.walk(protos)
            for name in names
        )
        command += [f"-I{protos}", f"--python_out={made}", f"--pyi_out={made}"]
        done = subprocess.run(
            command + [f"--grpc_python_out={made}"] + files,
            capture_output=True,
            text=True,
            check=False,
        )
        if done.returncode != 0:
            sys.exit(
                "generate: install Debian's protobuf-compiler and protobuf-compiler-grpc, or pip's "
                f"grpcio-tools ({done.stderr.strip()})"
            )
        for part in ("v1", "wire"):
            target = os.path.join(package, part)
            shutil.rmtree(target, ignore_errors=True)
            shutil.copytree(os.path.join(made, "color3d", part), target, ignore=without_service)
            with open(os.path.join(target, "__init__.py"), "w", encoding="utf-8") as file:
                file.write('"""Generated from the protos of Color3D."""\n')
        # The server knows ByteStream by its public name.
        stub = os.path.join(package, "wire", "bytestream_pb2_grpc.py")
        with open(stub, encoding="utf-8") as file:
            text = file.read()
        with open(stub, "w", encoding="utf-8") as file:
            file.write(
                text.replace("'/color3d.wire.ByteStream/", "'/google.bytestream.ByteStream/")
            )


def make_tarball(out):
    """Writes the source tarball and returns its path."""
    try:
        from setuptools import build_meta  # pylint: disable=import-outside-toplevel
    except ImportError:
        sys.exit("generate: install Debian's python3-setuptools")

    out = os.path.abspath(out)
    os.makedirs(out, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix="color3d-tarball-") as folder:
        for name in PACKAGED:
            path, copy = os.path.join(HERE, name), os.path.join(folder, name)
            if os.path.isdir(path):
                shutil.copytree(
                    path, copy, ignore=shutil.ignore_patterns("__pycache__", "v1", "wire")
                )
            else:
                shutil.copy(path, copy)
        shutil.copy(os.path.join(HERE, "..", "..", "LICENSE"), folder)
        with open(os.path.join(folder, "MANIFEST.in"), "w", encoding="utf-8") as file:
            file.write("include generate.py LICENSE\ninclude examples/*.py\n")
        generate(os.path.join(folder, "color3d"))
        here = os.getcwd()
        os.chdir(folder)
        try:
            return os.path.join(out, build_meta.build_sdist(out))
        finally:
            os.chdir(here)


if __name__ == "__main__":
    if len(sys.argv) != 3 or sys.argv[1] not in ("modules", "tarball"):
        sys.exit(__doc__)
    if sys.argv[1] == "modules":
        generate(sys.argv[2])
    else:
        print(make_tarball(sys.argv[2]))
