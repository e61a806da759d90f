"""The installed Python client and its examples against the real server and its worker.

    client_test.py BIN VERSION [CASE]    BIN: folder of the programs; VERSION: of the project

Exits with 77 (skipped) where a package is missing.
"""

import csv
import datetime
import json
import os
import re
import shutil
import subprocess
import sys
import time
import unittest
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from unittest import mock

sys.dont_write_bytecode = True

from test_support import BIN, HERE, PIP, PYTHON, QUICK, ROOM, SCRATCH, TRUTH, VERSION, VIEWS
from test_support import CuttingProxy, Server, install_package, make_room, run

install_package()
import grpc

import color3d
from color3d import transfer
from color3d.options import set_options
from color3d.v1 import job_pb2
from color3d.v1.colorize_scene_pb2 import ColorizeSceneSpec


class ClientTest(unittest.TestCase):
    maxDiff = None

    @classmethod
    def setUpClass(cls):
        cls.server = Server("server")
        cls.addClassCleanup(cls.server.stop)
        cls.client = color3d.Client(cls.server.address)
        cls.addClassCleanup(cls.client.close)

    def proxied(self, patience_s=30.0):
        """A proxy before the server, and a client that talks through it."""
        proxy = CuttingProxy(self.server.address)
        self.addCleanup(proxy.close)
        client = color3d.Client(proxy.address, patience_s=patience_s)
        self.addCleanup(client.close)
        return proxy, client

    def random_file(self, name, size):
        path = SCRATCH / name
        path.write_bytes(os.urandom(size))
        return path

    def example(self, *arguments, status=0):
        """Runs an example with the installed package. Returns stdout, or stderr if it fails."""
        done = subprocess.run(
            [str(word) for word in (PYTHON, HERE / "examples" / arguments[0], *arguments[1:])],
            env={**os.environ, "COLOR3D_SERVER": self.server.address},
            capture_output=True,
            text=True,
            check=False,
            cwd=SCRATCH,
        )
        self.assertEqual(done.returncode, status, done.stdout + done.stderr)
        return done.stdout if status == 0 else done.stderr

    # Transfers.

    def test_interrupted_upload_resumes(self):
        size = 32 << 20
        file = self.random_file("up.bin", size)
        proxy, client = self.proxied()
        sent = []
        proxy.cut_after("up", size * 7 // 8)
        [digest] = client.upload_files([file], lambda done, total: sent.append((done, total)))
        self.assertEqual(proxy.cuts, 1)
        self.assertEqual(sent[-1], (size, size))
        # What was committed before the cut was not sent again; some MiB were in buffers.
        self.assertLess(proxy.passed["up"], size * 1.5)
        self.client.download_blob(digest, SCRATCH / "up.copy")
        self.assertEqual((SCRATCH / "up.copy").read_bytes(), file.read_bytes())
        before = proxy.passed["up"]
        client.upload_files([file])
        self.assertLess(proxy.passed["up"] - before, 10_000, "a stored file was sent again")

    def test_interrupted_download_resumes(self):
        size = 32 << 20
        file = self.random_file("down.bin", size)
        [digest] = self.client.upload_files([file])
        proxy, client = self.proxied()
        proxy.cut_after("down", size * 7 // 8)
        target = SCRATCH / "down" / "copy.bin"
        client.download_blob(digest, target)
        self.assertEqual(proxy.cuts, 1)
        self.assertLess(proxy.passed["down"], size * 1.5)
        self.assertEqual(target.read_bytes(), file.read_bytes())
        self.assertEqual([p.name for p in target.parent.iterdir()], ["copy.bin"])

        # A client that was killed leaves a part file; the next one takes it from there.
        part = target.parent / f".color3d-{digest.sha256[:16]}.part"
        target.rename(part)
        os.truncate(part, size - 100_000)
        before = proxy.passed["down"]
        client.download_blob(digest, target)
        self.assertLess(proxy.passed["down"] - before, 500_000)
        self.assertEqual(target.read_bytes(), file.read_bytes())

        # Damaged parts are noticed and replaced.
        target.unlink()
        part.write_bytes(b"x" * (size - 5))
        client.download_blob(digest, target)
        self.assertEqual(target.read_bytes(), file.read_bytes())

    def test_download_without_server_leaves_no_result(self):
        file = self.random_file("lost.bin", 4 << 20)
        [digest] = self.client.upload_files([file])
        proxy, client = self.proxied(patience_s=1.0)
        proxy.cut_after("down", 1 << 20)
        proxy.close()
        with self.assertRaisesRegex(color3d.UnreachableError, "lost the server at .* call again"):
            client.download_blob(digest, SCRATCH / "lost" / "copy.bin")
        self.assertFalse((SCRATCH / "lost" / "copy.bin").exists())

    def test_lost_answer_creates_nothing_twice(self):
        proxy, client = self.proxied()
        scene = client.upload(ROOM)
        spec = job_pb2.JobSpec(scene=scene.name, import_scene={}, seed=77)
        every = job_pb2.ListJobsRequest(page_size=1000)
        count = lambda: len(self.client.call(self.client.jobs.ListJobs, every).jobs)
        before = count()
        proxy.cut_after("down", 0)  # the request arrives, its answer does not
        job = client.submit(spec)
        self.assertEqual(proxy.cuts, 1)
        self.assertEqual(count(), before + 1)
        self.client.wait([job.name])

    # Refusals.

    def test_tokens_are_required_and_checked(self):
        tokens = SCRATCH / "tokens"
        token = run(BIN / "color3d-server", "token", "anna", "--role", "read", "--tokens", tokens)
        server = Server("guarded", "--tokens", str(tokens))
        self.addCleanup(server.stop)
        for wrong, reason in (("", "TOKEN_MISSING"), ("wrong", "TOKEN_UNKNOWN")):
            with color3d.Client(server.address, token=wrong) as client:
                with self.assertRaises(color3d.RpcError) as refused:
                    client.server_info()
                self.assertEqual(refused.exception.reason, reason)
        with color3d.Client(server.address, token=token) as client:
            self.assertEqual(client.server_info().role, "read")
            with self.assertRaises(color3d.RpcError) as refused:
                client.upload(ROOM)
            self.assertEqual(refused.exception.reason, "ROLE_TOO_LOW")
            self.assertEqual(refused.exception.code.name, "PERMISSION_DENIED")
        with self.assertRaisesRegex(color3d.InputError, "unencrypted; give https://"):
            color3d.Client("192.0.2.1:50551", token=token)

    def test_calls_belong_to_the_trace_of_the_environment(self):
        seen = []

        class Recorder(grpc.GenericRpcHandler):
            def service(self, handler_call_details):
                seen.append(dict(handler_call_details.invocation_metadata).get("traceparent"))

        server = grpc.server(ThreadPoolExecutor(1), handlers=[Recorder()])
        self.addCleanup(server.stop, None)
        address = f"127.0.0.1:{server.add_insecure_port('127.0.0.1:0')}"
        server.start()
        good = "00-4bf92f3577b34da6a3ce929d0e0e4736-00f067aa0ba902b7-01"
        for trace, sent in ((good, good), ("nonsense", None)):
            with mock.patch.dict(os.environ, TRACEPARENT=trace):
                with color3d.Client(address) as client:
                    with self.assertRaises(color3d.RpcError):
                        client.server_info()
            self.assertEqual(seen.pop(), sent)

    def test_tls_checks_the_certificate(self):
        if not shutil.which("openssl"):
            self.skipTest("no openssl")
        key, cert, other = SCRATCH / "s.key", SCRATCH / "s.pem", SCRATCH / "other.pem"
        for certificate, of in ((other, key), (cert, key)):
            run(
                *"openssl req -x509 -newkey ec -pkeyopt ec_paramgen_curve:P-256 -nodes".split(),
                *"-subj /CN=localhost -addext subjectAltName=IP:127.0.0.1 -keyout".split(),
                *(of, "-out", certificate),
            )
        server = Server("tls", "--tls-cert", str(cert), "--tls-key", str(key))
        self.addCleanup(server.stop)
        with color3d.Client("https://" + server.address, tls=color3d.Tls(ca=cert)) as client:
            self.assertEqual(client.server_info().version, VERSION)
        with self.assertRaisesRegex(color3d.UnreachableError, "over TLS.*check the address, ca"):
            color3d.Client("https://" + server.address, tls=color3d.Tls(ca=other))
        with self.assertRaisesRegex(color3d.InputError, "cannot read .*none.pem"):
            color3d.Client("https://" + server.address, tls=color3d.Tls(ca=SCRATCH / "none.pem"))

    def test_wrong_inputs_name_the_remedy(self):
        def refuse(pattern, function, *arguments, **named):
            with self.assertRaisesRegex(color3d.InputError, pattern):
                function(*arguments, **named)

        empty = SCRATCH / "empty"
        empty.mkdir()
        refuse("there is no folder .*; give the folder", self.client.upload, SCRATCH / "none")
        refuse("no photographs .*at least 3", self.client.upload, empty)
        refuse("cannot read .*none.png", self.client.upload, {"a.png": SCRATCH / "none.png"})
        refuse("not an address; give HOST:PORT", color3d.Client, "http://127.0.0.1:1")
        scene = self.client.upload(ROOM).name
        color = TRUTH / "view003.png"
        spec = lambda **named: self.client.colorize_spec(scene, key_color=color, **named)
        refuse("no photo .* called 'view9'; there are view000.png", spec, key_view="view9")
        refuse("no such preset .there are fast, best, paper", spec, preset="fats")
        option = lambda name, value: spec(options={name: value})
        refuse("did you mean personalize.iterations", option, "personalize.iteration", 3)
        refuse("did you mean .*personalize.iterations", option, "iterations", 3)
        refuse("it is a stage; its options are carry_color", option, "carry_color", 3)
        refuse("must be a whole number, 64 to 4096 px", option, "max_side_px", 5000)
        refuse("must be a whole number", option, "max_side_px", 100.5)
        refuse("must be a number, .*", option, "carry_color.depth_tolerance", float("nan"))
        refuse("must be True or False", option, "import_scene.hold_out_every_eighth", "yes")
        refuse("must be coverage, entropy", option, "select_key_view.strategy", "best")
        refuse("name another folder", self.client.colorize, ROOM, ROOM, key_color=color)
        preset = SCRATCH / "bad.textproto"
        preset.write_text("personalize { iteration: 3 }")
        refuse("bad.textproto: .*iteration", spec, preset=str(preset))
        only_import = job_pb2.JobSpec(scene=scene, import_scene={})
        with self.assertRaisesRegex(ValueError, "time zone"):
            self.client.submit(only_import, deadline=datetime.datetime(2030, 1, 1))
        deadline = datetime.datetime(2030, 1, 1, tzinfo=datetime.timezone.utc)
        job = self.client.submit(only_import, priority=7, deadline=deadline)
        self.assertEqual(job.deadline.ToSeconds(), int(deadline.timestamp()))
        [job] = self.client.wait([job.name])
        refuse("has no result 'none.png'; it has ", self.client.download, job, empty, ["none.png"])
        with self.assertRaises(color3d.RpcError) as refused:
            self.client.job("jobs/none")
        self.assertEqual(refused.exception.reason, "JOB_NOT_FOUND")
        with self.assertRaisesRegex(color3d.UnreachableError, "color3d-server serve"):
            color3d.Client("127.0.0.1:1")

    def test_server_names_each_bad_photo(self):
        folder = SCRATCH / "damaged"
        shutil.copytree(ROOM / "images", folder)
        (folder / "view002.png").write_bytes((folder / "view002.png").read_bytes()[:200])
        (folder / "view004.png").write_text("no picture")
        with self.assertRaisesRegex(color3d.RpcError, "(?s)view002.png.*view004.png") as refused:
            self.client.upload(folder)
        self.assertEqual(refused.exception.reason, "SCENE_INVALID")
        self.assertEqual(len(refused.exception.violations), 2)

    def test_unsafe_names_are_not_written(self):
        for name in ("../x", "/x", "a//x", "a/../x", "a\\x", "a\nx", ""):
            with self.assertRaises(color3d.DamagedDataError):
                transfer.safe_path_below(SCRATCH / "safe", name)
        (SCRATCH / "safe").mkdir(exist_ok=True)
        (SCRATCH / "safe" / "link").symlink_to("/tmp")
        with self.assertRaisesRegex(color3d.InputError, "link is no folder"):
            transfer.safe_path_below(SCRATCH / "safe", "link/x")

    # Jobs.

    def test_same_photos_give_the_scene_of_the_command_line(self):
        scene = self.client.upload(ROOM)
        self.assertEqual(scene.photo_count, VIEWS)
        command = [
            BIN / "color3d",
            "--server",
            self.server.address,
            "--json",
            "scene",
            "create",
            ROOM,
        ]
        self.assertIn(scene.name, run(*command))

    def test_cancelled_job_raises(self):
        scene = self.client.upload(ROOM).name
        spec = self.client.colorize_spec(scene, key_color="auto", seed=5)
        job = self.client.submit(spec)
        self.client.cancel(job.name)
        self.client.cancel(job.name)  # has no further effect
        with self.assertRaisesRegex(
            color3d.JobFailedError, "was cancelled; client.retry"
        ) as failed:
            self.client.wait([job.name])
        self.assertEqual(failed.exception.job.state, job_pb2.Job.STATE_CANCELLED)

    def test_failed_job_names_stage_and_reason(self):
        scene = self.client.upload(ROOM).name
        small = SCRATCH / "small"
        run(BIN / "color3d-make-scene", small, "--views", "1", "--width", "40", "--height", "30")
        spec = self.client.colorize_spec(
            scene, key_color=small / "images" / "view000.png", key_view="view003.png", options=QUICK
        )
        job = self.client.submit(spec)
        with self.assertRaisesRegex(
            color3d.JobFailedError, "colorize_key_view failed .*40"
        ) as failed:
            self.client.wait([job.name])
        self.assertEqual(failed.exception.blamed.kind, "colorize_key_view")
        self.assertNotIn("retry", str(failed.exception), "which cannot help")

    def test_colorize_survives_a_restart_and_examples_run(self):
        restarts, events, times = [], [], []
        slow = QUICK | {
            "reconstruct_geometry.iterations": 10000,
            "personalize.iterations": 500,
            "personalize.min_decoder_share": 0.0,
        }

        def on_event(event):
            events.append(event)
            times.append(time.monotonic())
            # A watch that breaks in its first two seconds begins again, since its first events are
            # the present state of all jobs.
            late = times[-1] > times[0] + 2.2
            if late and not restarts and event.job.state == job_pb2.Job.STATE_RUNNING:
                self.server.stop()
                self.server.start()
                restarts.append(event.revision)

        out = SCRATCH / "out"
        color = TRUTH / "view003.png"
        job = self.client.colorize(
            ROOM,
            out,
            key_color=color,
            options=slow,
            truth={"view000.png": TRUTH / "view000.png"},
            on_event=on_event,
        )
        self.assertEqual(len(restarts), 1)
        revisions = [event.revision for event in events]
        self.assertEqual(revisions, sorted(revisions))
        self.assertEqual(len(revisions), len(set(revisions)), "an event came twice")
        for name in ("scene.ply", "report.html", "metrics.json"):
            self.assertGreater((out / name).stat().st_size, 0)
        self.assertEqual(list(out.rglob("*.part")), [])
        metrics = json.loads((out / "metrics.json").read_text())
        self.assertEqual(metrics["key_views"], ["view003.png"])
        self.assertGreater(metrics["delta_e00_chroma"], 0)

        # Each example asks for the same work, which the server has in its cache.
        [header, row] = csv.reader(self.example("key_views.py", "table", job.name).splitlines())
        table = dict(zip(header, row))
        self.assertEqual(table["key_views"], "view003.png")
        self.assertAlmostEqual(float(table["delta_e00_chroma"]), metrics["delta_e00_chroma"])
        self.assertEqual(table["next_key_view"], metrics["next_key_view"])

        options = [f"--set={name}={json.dumps(value)}" for name, value in slow.items()]
        said = self.example("color_photos.py", ROOM, color, "-o", "out1", *options)
        self.assertRegex(said, r"solve_chroma +succeeded")
        self.assertTrue((SCRATCH / "out1" / "scene.ply").is_file())

        preset = SCRATCH / "quick.textproto"
        spec = ColorizeSceneSpec()
        set_options(spec, slow)
        preset.write_text(str(spec))
        shutil.copytree(ROOM, SCRATCH / "room2")
        rest = ["-o", "all", "--preset", preset]
        said = self.example("batch.py", f"{ROOM}={color}", f"room2={color}", *rest)
        self.assertIn("room: STATE_SUCCEEDED", said)
        for name in ("room", "room2"):
            self.assertTrue((SCRATCH / "all" / name / "scene.ply").is_file())
        said = self.example("batch.py", f"none={color}", f"{ROOM}={color}", *rest, status=1)
        self.assertIn("batch: none: there is no folder none; give", said)

        said = self.example("key_views.py", "choose", ROOM, "-o", "key", "--count", "2")
        self.assertEqual(len(said.split()), 2, said)
        self.assertTrue((SCRATCH / "key" / "key_view.png").is_file())


class PackageTest(unittest.TestCase):
    def test_version_is_that_of_the_project(self):
        self.assertIn(f'version = "{VERSION}"', (HERE / "pyproject.toml").read_text())

    def test_installs_from_the_folder_as_from_the_tarball(self):
        copy, target = SCRATCH / "copy", SCRATCH / "from_folder"
        shutil.copytree(HERE, copy)
        environment = {**os.environ, "COLOR3D_PROTO": str(HERE.parent.parent / "proto")}
        run(*PIP, "--target", target, copy, env=environment)
        files = lambda root: {
            p.relative_to(root).as_posix(): p.read_bytes()
            for p in root.rglob("*.py*")
            if "__pyc" not in str(p)
        }
        installed = files(Path(color3d.__file__).parent)
        self.assertEqual(installed, files(target / "color3d"))
        self.assertIn("v1/job_pb2.pyi", installed)
        self.assertIn("py.typed", [p.name for p in (target / "color3d").iterdir()])

    def test_loads_beside_other_copies_of_the_protos(self):
        """Programs may load google.rpc from another package, whose options differ from ours."""
        script = """if True:
            from google.protobuf import descriptor_pb2, descriptor_pool
            for name in ("status", "error_details"):
                other = descriptor_pb2.FileDescriptorProto(name=f"google/rpc/{name}.proto")
                other.package = "google.rpc"
                other.message_type.add(name="Status" if name == "status" else "ErrorInfo")
                descriptor_pool.Default().AddSerializedFile(other.SerializeToString())
            import color3d"""
        run(PYTHON, "-c", script)

    def test_types_are_right(self):
        if not shutil.which("mypy"):
            self.skipTest("no mypy")
        copy = SCRATCH / "typed"
        shutil.copytree(Path(color3d.__file__).parent, copy / "color3d")
        shutil.copy(HERE / "pyproject.toml", copy)
        run("mypy", "--python-executable", sys.executable, "-p", "color3d", cwd=copy)

    def test_every_stub_of_the_api_is_reachable(self):
        """The client has a stub for each service of the public API."""
        protos = (HERE.parent.parent / "proto" / "color3d" / "v1").glob("*.proto")
        services = {s for p in protos for s in re.findall(r"^service (\w+)", p.read_text(), re.M)}
        source = (HERE / "color3d" / "client.py").read_text()
        self.assertEqual(services, set(re.findall(r"_grpc\.(\w+)Stub\(", source)))


if __name__ == "__main__":
    make_room()
    unittest.main(argv=[sys.argv[0], *sys.argv[3:]], verbosity=2)
