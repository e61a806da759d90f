#!/usr/bin/env python3
"""Workers of deploy/slurm on a real cluster of one node: a batch of scenes while the engine requeues,
preempts and ends workers, and the server's own requests for workers. Every job is done in one attempt.

    tests/deploy/slurm_test.py BIN

BIN: the folder of the built programs. Exits with 77 (skipped) where Slurm is missing.
"""

import json
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import unittest

sys.dont_write_bytecode = True
HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, HERE)
import slurm_cluster  # pylint: disable=wrong-import-position

SLURM = os.path.join(HERE, "..", "..", "deploy", "slurm")
BIN = ""
SCENES = 12
# The quickest run of a whole scene: pictures of a rendered room.
ROOM = ("--views", "6", "--width", "160", "--height", "120")
QUICK = ("--max-side", "160", "--max-gaussians", "4000", "--geometry-iterations", "300",
         "--colorizer-iterations", "10", "--chroma-iterations", "10")  # fmt: skip


def program(name):
    return os.path.join(BIN, name)


class SlurmTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.mkdtemp(prefix="color3d-slurm-")
        cls.server = None
        cls.cluster = None
        try:
            os.mkdir(cls.path("cluster"))
            cls.cluster = slurm_cluster.Cluster(cls.path("cluster"))
            cls.make_certificate()
            cls.submit_token = cls.make_token("anna", "submit")
            with open(cls.path("worker.token"), "w", encoding="utf-8") as file:
                file.write(cls.make_token("slurm", "worker"))
            os.mkdir(cls.path("logs"))
            cls.room(1)
        except BaseException:
            cls.tearDownClass()
            raise

    @classmethod
    def tearDownClass(cls):
        if cls.cluster:
            cls.cluster.close()
        cls.stop_server()
        shutil.rmtree(cls.folder)

    @classmethod
    def path(cls, name):
        return os.path.join(cls.folder, name)

    @classmethod
    def make_certificate(cls):
        subprocess.run(
            ["openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes", "-days", "2",
             "-subj", "/CN=127.0.0.1", "-addext", "subjectAltName=IP:127.0.0.1",
             "-keyout", cls.path("server.key"), "-out", cls.path("server.pem")],
            check=True, capture_output=True)  # fmt: skip

    @classmethod
    def make_token(cls, name, role):
        command = [program("color3d-server"), "token", name, "--role", role, "--tokens", cls.path("tokens")]
        return subprocess.run(command, check=True, capture_output=True, text=True).stdout.strip()

    @classmethod
    def start_server(cls, *flags):
        """Without workers of its own; on the address of before, if there was one."""
        address = getattr(cls, "address", "127.0.0.1:0")
        port_file = cls.path("port")
        if os.path.exists(port_file):
            os.remove(port_file)
        with open(cls.path("server.log"), "ab") as log:
            cls.server = subprocess.Popen(
                [program("color3d-server"), "serve", "--data-dir", cls.path("data"), "--workers", "0",
                 "--listen", address, "--port-file", port_file, "--tls-cert", cls.path("server.pem"),
                 "--tls-key", cls.path("server.key"), "--tokens", cls.path("tokens"), "--low-space-mib", "0",
                 "--reserve-mib", "0", *flags],
                stdin=subprocess.DEVNULL, stdout=log, stderr=log)  # fmt: skip
        cls.wait(lambda: os.path.exists(port_file) or cls.server.poll() is not None, 60, "the server")
        with open(port_file, encoding="utf-8") as file:
            cls.address = file.read().strip()

    @classmethod
    def stop_server(cls):
        if cls.server:
            cls.server.send_signal(signal.SIGTERM)
            try:
                cls.server.wait(60)
            finally:
                cls.server.kill()
                cls.server.wait()
        cls.server = None

    @classmethod
    def wait(cls, condition, seconds, what):
        end = time.monotonic() + seconds
        while True:
            value = condition()
            if value:
                return value
            if time.monotonic() > end:
                raise AssertionError(f"not within {seconds} s: {what}\n{cls.logs()}")
            time.sleep(0.2)

    @classmethod
    def logs(cls):
        text = cls.cluster.logs()
        for folder in (cls.folder, cls.path("logs")):
            for name in sorted(os.listdir(folder)):
                if name.endswith(".log"):
                    with open(os.path.join(folder, name), errors="replace", encoding="utf-8") as file:
                        text += f"--- {name}\n" + "".join(file.readlines()[-15:])
        return text

    @classmethod
    def room(cls, seed):
        out = cls.path(f"room-{seed}")
        subprocess.run([program("color3d-make-scene"), out, *ROOM, "--seed", str(seed)], check=True)
        return out

    @classmethod
    def client(cls, *arguments):
        """The answer of `color3d --json`."""
        result = subprocess.run(
            [program("color3d"), "--json", "--server", "https://" + cls.address, "--ca", cls.path("server.pem"),
             *arguments],
            env=dict(os.environ, COLOR3D_TOKEN=cls.submit_token),
            capture_output=True, text=True, timeout=300, check=False)  # fmt: skip
        if result.returncode not in (0, 130):  # 130: detached
            raise AssertionError(f"color3d {arguments}: {result.stdout}{result.stderr}\n{cls.logs()}")
        return json.loads(result.stdout)

    @classmethod
    def submit(cls, seed):
        answer = cls.client(
            "colorize", cls.room(seed), "-o", cls.path(f"out-{seed}"), "--auto", "--detach", *QUICK)  # fmt: skip
        return answer["job"]

    @classmethod
    def jobs(cls):
        """{name: job} of all jobs with their stages."""
        jobs = cls.client("job", "list", "--limit", "1000").get("jobs", [])
        for job in list(jobs):
            if not job.get("parent"):
                jobs += cls.client("job", "list", job["name"], "--limit", "1000").get("jobs", [])
        return {job["name"]: job for job in jobs}

    @classmethod
    def settings(cls, **changes):
        """The settings of the page with those of this test, in a folder with the scripts."""
        with open(os.path.join(SLURM, "worker.env"), encoding="utf-8") as file:
            text = file.read()
        values = {
            "COLOR3D_SERVER": "https://" + cls.address,
            "COLOR3D_TOKEN_FILE": cls.path("worker.token"),
            "COLOR3D_CA": cls.path("server.pem"),
            "COLOR3D_WORKER": program("color3d-worker"),
            "COLOR3D_CACHE": cls.path("cache"),
            "COLOR3D_IDLE_EXIT": "5s",
            "COLOR3D_LOGS": cls.path("logs"),
            **changes,
        }
        for name, value in values.items():
            text, count = re.subn(rf"^{name}=.*$", f"{name}={value}", text, flags=re.M)
            assert count == 1, f"worker.env has no line {name}="
        folder = tempfile.mkdtemp(dir=cls.folder)
        for script in ("worker.sbatch", "scale.sh"):
            shutil.copy(os.path.join(SLURM, script), folder)
        with open(os.path.join(folder, "worker.env"), "w", encoding="utf-8") as file:
            file.write(text)
        return folder

    def submit_workers(self, folder, *options):
        """Submits the committed script for one core and little memory each. Returns the array's job."""
        said = self.cluster.run(
            "sbatch", "--parsable", "--cpus-per-task=1", "--mem=1900", f"--chdir={self.path('logs')}", *options,
            os.path.join(folder, "worker.sbatch"), os.path.join(folder, "worker.env"))  # fmt: skip
        return said.strip().split(";")[0]

    def busy_worker(self, job_of_slurm=None):
        """A job of Slurm whose worker computes now, and the job of ours."""

        def find():
            for job in self.jobs().values():
                match = re.match(r"slurm-(\d+)-", job.get("worker", ""))
                if job["state"] != "STATE_RUNNING" or not match or int(job.get("progress", {}).get("step", 0)) == 0:
                    continue
                if job_of_slurm in (None, match[1]):
                    return match[1], job["name"]
            return None

        return self.wait(find, 240, "a worker of Slurm that computes")

    def log_of(self, job_of_slurm):
        with open(self.cluster.job(job_of_slurm)["StdOut"], errors="replace", encoding="utf-8") as file:
            return file.read()

    def test_batch_survives_what_the_engine_does(self):
        self.start_server()
        submitted = [self.submit(seed) for seed in range(1, SCENES + 1)]
        folder = self.settings()

        # The time limit: the signal comes 115 s before the end of two minutes.
        short = self.submit_workers(folder, "--array=1", "--time=2", "--signal=B:USR1@115")
        job_of_slurm, job = self.busy_worker()
        state = self.wait(
            lambda: self.cluster.job(job_of_slurm)["JobState"] not in ("RUNNING", "COMPLETING")
            and self.cluster.job(job_of_slurm), 110, "the end of the short worker")  # fmt: skip
        self.assertEqual((state["JobState"], state["ExitCode"]), ("COMPLETED", "0:0"), self.log_of(job_of_slurm))
        self.assertNotIn("Timelimit", state["Reason"], short)
        waiting = [j for j in self.jobs().values() if j["state"] == "STATE_RUNNING"]
        self.assertEqual(waiting, [], "no worker is left")

        self.submit_workers(folder, "--array=1-2")
        # A requeue by the operator.
        requeued, job = self.busy_worker()
        self.cluster.run("scontrol", "requeue", self.cluster.job(requeued)["Name"])
        self.wait(lambda: self.cluster.job(requeued)["Restarts"] == "1", 60, "the requeue")
        self.assertIn("slurm-" + requeued, self.log_of(requeued))
        # A job of more importance takes the place of one.
        self.wait(lambda: [s for _, s in self.cluster.tasks()] == ["RUNNING"] * 2, 120, "both workers again")
        self.busy_worker()
        urgent = self.cluster.run(
            "sbatch", "--parsable", "--partition=urgent", "--mem=100", "--output=/dev/null", "--wrap", "sleep 5").strip()  # fmt: skip
        self.wait(lambda: self.cluster.job(urgent)["JobState"] == "COMPLETED", 120, "the urgent job")
        restarts = [int(self.cluster.job(task)["Restarts"]) for task, _ in self.cluster.tasks()]
        self.assertEqual(sum(restarts), 2, f"one requeue and one preemption: {restarts}")

        for job in submitted:
            self.wait(
                lambda job=job: self.client("job", "show", job)["state"] not in ("STATE_RUNNING", "STATE_QUEUED", "STATE_BLOCKED"),
                600, job)  # fmt: skip
        self.expect_done_in_one_attempt(submitted)
        # Without work the workers end by themselves.
        self.wait(lambda: not self.cluster.tasks(), 120, "workers that end")
        for task in (f"{requeued}",):
            self.assertEqual(self.cluster.job(task)["JobState"], "COMPLETED")

    def test_server_asks_for_workers(self):
        if not self.server:
            self.start_server()
        self.stop_server()
        folder = self.settings(COLOR3D_SBATCH="(--cpus-per-task=1 --mem=1900)")
        # The command gets no variables but a few, as it does from a service.
        with open(os.path.join(folder, "worker.env"), "a", encoding="utf-8") as file:
            file.write(f"export SLURM_CONF={self.cluster.configuration}\n")
        self.start_server("--scale-command", os.path.join(folder, "scale.sh"), "--scale-max", "2", "--scale-seconds", "1")
        self.assertEqual(self.cluster.tasks(), [], "no work, no workers")
        submitted = [self.submit(seed) for seed in range(101, 104)]
        most = 0

        def all_done():
            nonlocal most
            most = max(most, len(self.cluster.tasks()))
            states = [self.client("job", "show", job)["state"] for job in submitted]
            return all(state == "STATE_SUCCEEDED" for state in states)

        self.wait(all_done, 600, "jobs on workers that the server asked for")
        self.assertEqual(most, 2, "as many as --scale-max allows")
        self.expect_done_in_one_attempt(submitted)
        self.wait(lambda: not self.cluster.tasks(), 120, "workers that end")

    def expect_done_in_one_attempt(self, submitted):
        jobs = self.jobs()
        for job in submitted:
            self.assertEqual(jobs[job]["state"], "STATE_SUCCEEDED", f"{jobs[job]}\n{self.logs()}")
        for job in jobs.values():
            self.assertIn(job["state"], ("STATE_SUCCEEDED", "STATE_SKIPPED"), job)
            if job["state"] == "STATE_SUCCEEDED":
                self.assertEqual(job.get("attempt"), 1, f"{job}\n{self.logs()}")


if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit("usage: slurm_test.py BIN")
    BIN = os.path.abspath(sys.argv.pop(1))
    reason = slurm_cluster.why_not()
    if reason:
        print("SKIPPED:", reason)
        sys.exit(77)
    unittest.main()
