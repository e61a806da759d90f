"""Starts a color3d.backend.v1.ColorBackend: what the model servers in this folder share."""

import concurrent.futures
import os
import shutil
import subprocess
import sys
import tempfile

import grpc

_PROTO = "color3d/backend/v1/backend.proto"


def _generate(folder):
    """Makes the protocol's Python files in `folder`."""
    here = os.path.dirname(os.path.abspath(__file__))
    root = os.environ.get("COLOR3D_PROTO", os.path.join(here, "..", "..", "..", "proto"))
    if not os.path.exists(os.path.join(root, _PROTO)):
        sys.exit(f"there is no {_PROTO} in {root}; set COLOR3D_PROTO to color3d's folder proto")
    outputs = [f"-I{root}", f"--python_out={folder}", f"--grpc_python_out={folder}"]
    protoc, plugin = shutil.which("protoc"), shutil.which("grpc_python_plugin")
    if protoc and plugin:
        command = [protoc, f"--plugin=protoc-gen-grpc_python={plugin}"]
    else:
        command = [sys.executable, "-m", "grpc_tools.protoc"]
    made = subprocess.run(command + outputs + [_PROTO], capture_output=True, text=True, check=False)
    if made.returncode != 0:
        sys.exit(
            "the protocol's Python files cannot be made: install Debian's protobuf-compiler and "
            f"protobuf-compiler-grpc, or pip's grpcio-tools ({made.stderr.strip()})"
        )


try:
    from color3d.backend.v1 import backend_pb2, backend_pb2_grpc
except ImportError:
    # Once they are imported nobody needs them: a server that is killed leaves nothing behind.
    with tempfile.TemporaryDirectory(prefix="color3d-proto-") as _generated:
        _generate(_generated)
        sys.path.insert(0, _generated)
        from color3d.backend.v1 import backend_pb2, backend_pb2_grpc

        sys.path.remove(_generated)

MAX_MESSAGE_BYTES = 256 << 20


def add_flags(parser, listen):
    """The flags that serve() takes, with `listen` as the default address."""
    parser.add_argument("--listen", default=listen, help=f"HOST:PORT, port 0: any ({listen})")
    parser.add_argument("--port-file", help="write the address here once it is bound")


def serve(backend, arguments):
    """Answers until the process ends. `backend`: a ColorBackendServicer."""
    name = os.path.basename(sys.argv[0])
    server = grpc.server(
        concurrent.futures.ThreadPoolExecutor(max_workers=4),
        options=[
            ("grpc.max_receive_message_length", MAX_MESSAGE_BYTES),
            ("grpc.max_send_message_length", MAX_MESSAGE_BYTES),
            ("grpc.so_reuseport", 0),
        ],
    )
    backend_pb2_grpc.add_ColorBackendServicer_to_server(backend, server)
    try:
        port = server.add_insecure_port(arguments.listen)
    except RuntimeError:
        port = 0
    if port == 0:
        sys.exit(f"{name}: cannot listen on {arguments.listen}; choose another with --listen")
    server.start()
    address = f"{arguments.listen.rpartition(':')[0]}:{port}"
    if arguments.listen.startswith("unix:"):
        address = arguments.listen
    if arguments.port_file:
        with open(arguments.port_file + ".new", "w", encoding="utf-8") as file:
            file.write(address + "\n")
        os.replace(arguments.port_file + ".new", arguments.port_file)
    print(f"{name} listens on {address}", flush=True)
    server.wait_for_termination()
