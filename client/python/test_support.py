"""Real servers, a proxy that cuts connections and the installed package, for client_test.py."""

import atexit
import contextlib
import os
import shutil
import socket
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

HERE = Path(__file__).resolve().parent
BIN, VERSION = Path(sys.argv[1]), sys.argv[2]
PACKAGES = {
    "grpc": "python3-grpcio",
    "google.protobuf": "python3-protobuf",
    "venv": "python3-venv",
    "ensurepip": "python3-venv",
    "setuptools": "python3-setuptools",
    "wheel": "python3-wheel",
}
for module, package in PACKAGES.items():
    try:
        __import__(module)
    except ImportError as missing:
        print(f"SKIPPED: {missing} (Debian's {package} is needed)")
        sys.exit(77)
for program in ("protoc", "grpc_python_plugin"):
    if not shutil.which(program):
        print(f"SKIPPED: no {program} (protobuf-compiler and protobuf-compiler-grpc are needed)")
        sys.exit(77)

SCRATCH = Path(tempfile.mkdtemp(prefix="color3d-python-"))
atexit.register(shutil.rmtree, SCRATCH, ignore_errors=True)
VENV = SCRATCH / "venv"
PYTHON = VENV / "bin" / "python"
ROOM, TRUTH = SCRATCH / "room", SCRATCH / "room" / "truth"
VIEWS = 6
# The quickest job that makes all results. As a preset and as options of the API.
QUICK = {
    "max_side_px": 96,
    "import_scene.hold_out_every_eighth": True,
    "reconstruct_geometry.iterations": 60,
    "reconstruct_geometry.max_gaussians": 1000,
    "personalize.iterations": 4,
    "solve_chroma.iterations": 4,
}
# Dead workers are detected within seconds.
RECOVERY = (
    "--lease-seconds 4 --heartbeat-seconds 0.3 --checkpoint-seconds 0.5 --retry-backoff-ms 200"
)


def run(*command, **options):
    """Runs a command to its end and returns what it printed. Fails the test if it fails."""
    done = subprocess.run(
        [str(word) for word in command], capture_output=True, text=True, check=False, **options
    )
    assert done.returncode == 0, f"{command}: {done.stdout}{done.stderr}"
    return done.stdout


class Server:
    """`color3d-server serve` with a data folder of its own. Restarts at the same address."""

    def __init__(self, name, *flags):
        self.folder, self.flags, self.address = SCRATCH / name, flags, "127.0.0.1:0"
        self.start()

    def start(self):
        self.folder.mkdir(exist_ok=True)
        port_file = self.folder / "address"
        port_file.unlink(missing_ok=True)
        # It ends with this test, even if that is killed.
        command = [
            *"setpriv --pdeathsig TERM".split(),
            BIN / "color3d-server",
            "serve",
            "--listen",
            self.address,
            "--workers",
            "1",
        ]
        command += ["--threads", "2", "--port-file", port_file, "--data-dir", self.folder / "data"]
        command += [*RECOVERY.split(), *self.flags]
        with open(self.folder / "log", "ab") as log:
            self.process = subprocess.Popen([str(w) for w in command], stdout=log, stderr=log)
        end = time.monotonic() + 60
        while not port_file.exists() or not port_file.read_text().strip():
            assert self.process.poll() is None and time.monotonic() < end, self.log()
            time.sleep(0.05)
        self.address = port_file.read_text().strip()

    def stop(self):
        self.process.terminate()
        try:
            self.process.wait(60)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()

    def log(self):
        return (self.folder / "log").read_text(errors="replace")[-4000:]


class CuttingProxy:
    """A TCP proxy that cuts all connections when `up` or `down` bytes have passed, once armed."""

    def __init__(self, target):
        self._target = target.rsplit(":", 1)
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.address = f"127.0.0.1:{self._listener.getsockname()[1]}"
        self.passed = {"up": 0, "down": 0}
        self.cuts = 0
        self._limit = {}
        self._lock = threading.Lock()
        threading.Thread(target=self._accept, daemon=True).start()

    def cut_after(self, direction, more_bytes):
        with self._lock:
            self._limit = {direction: self.passed[direction] + more_bytes}

    def _accept(self):
        while True:
            try:
                client, _ = self._listener.accept()
            except OSError:
                return
            server = socket.create_connection((self._target[0], int(self._target[1])))
            for source, target, way in ((client, server, "up"), (server, client, "down")):
                threading.Thread(target=self._pump, args=(source, target, way), daemon=True).start()

    def _pump(self, source, target, way):
        with contextlib.suppress(OSError):
            while data := source.recv(65536):
                with self._lock:
                    self.passed[way] += len(data)
                    if way in self._limit and self.passed[way] > self._limit[way]:
                        self._limit, self.cuts = {}, self.cuts + 1
                        break
                target.sendall(data)
        for end in (source, target):
            with contextlib.suppress(OSError):
                end.shutdown(socket.SHUT_RDWR)
            end.close()

    def close(self):
        """Takes no further connection."""
        with contextlib.suppress(OSError):
            self._listener.shutdown(socket.SHUT_RDWR)
        self._listener.close()


PIP = [PYTHON, *"-m pip install -q --no-index --no-deps --no-build-isolation".split()]


def install_package():
    """Installs the package from its tarball, without network, and makes it importable."""
    run(sys.executable, "-m", "venv", "--system-site-packages", VENV)
    run(*PIP, run(sys.executable, HERE / "generate.py", "tarball", SCRATCH).split()[-1])
    [site] = VENV.glob("lib/python3*/site-packages")
    sys.path.insert(0, str(site))


def make_room():
    """Renders monochrome photos of a room into ROOM, with the true colours in TRUTH."""
    run(
        *(BIN / "color3d-make-scene", ROOM, "--gray", "--views", VIEWS),
        *"--width 160 --height 120".split(),
    )
