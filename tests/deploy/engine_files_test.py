#!/usr/bin/env python3
"""The files of deploy/ for Kubernetes, Compose, HTCondor and Slurm: names in them exist, and their
programs start with their arguments.

    tests/deploy/engine_files_test.py BIN

BIN: the folder of the built programs. Exits with 77 (skipped) without Debian's python3-yaml.
"""

import copy
import os
import re
import shlex
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
try:
    import kubernetes_checks as kube
    import yaml
except ImportError as missing:
    print(f"SKIPPED: {missing} (Debian's python3-yaml is needed)")
    sys.exit(77)
from program_options import Options, values  # pylint: disable=wrong-import-position
from slurm_cluster import free_port  # pylint: disable=wrong-import-position

ROOT = os.path.join(HERE, "..", "..")
DEPLOY = os.path.join(ROOT, "deploy")
KUBERNETES = os.path.join(DEPLOY, "kubernetes")
BIN = ""


def read(*path):
    with open(os.path.join(*path), encoding="utf-8") as file:
        return file.read()


def compose():
    return yaml.safe_load(read(DEPLOY, "compose", "compose.yaml"))


def condor():
    """{key: value} of the submit file."""
    lines = [line for line in read(DEPLOY, "htcondor", "color3d-worker.sub").splitlines() if line and line[0] != "#"]
    return {key.strip(): value.strip() for key, _, value in (line.partition("=") for line in lines)}


def condor_arguments():
    return shlex.split(condor()["arguments"].strip('"'))


def kubernetes_objects():
    """All that may run beside each other."""
    return kube.build(os.path.join(KUBERNETES, "autoscaling")) + kube.build(os.path.join(KUBERNETES, "kueue"))


def secrets():
    return kube.read_all(os.path.join(KUBERNETES, "secrets.example.yaml"))


def commands():
    """{where: (program, arguments)} of everything that starts a program of ours."""
    found = {}
    for thing in kubernetes_objects():
        for container in kube.pod_of(thing).get("containers", []):
            found["kubernetes " + kube.name_of(thing)] = (container["command"], container["args"])
    for name, service in compose()["services"].items():
        if service.get("image") == "color3d":
            found["compose " + name] = (service["entrypoint"], service["command"])
    found["htcondor"] = ([os.path.basename(condor()["executable"])], condor_arguments())
    return found


class Programs(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.options = {
            name.split()[0]: Options([os.path.join(BIN, name.split()[0]), *name.split()[1:]])
            for name in ("color3d-server serve", "color3d-worker")
        }

    def test_every_argument_is_an_option(self):
        self.assertEqual(len(commands()), 6, sorted(commands()))
        for where, (program, arguments) in commands().items():
            with self.subTest(where):
                expected = ["color3d-server", "serve"] if program[0] == "color3d-server" else ["color3d-worker"]
                self.assertEqual(program, expected)
                self.assertEqual(self.options[program[0]].problems(arguments), [])

    def test_options_of_the_batch_script_exist(self):
        text = read(DEPLOY, "slurm", "worker.sbatch") + read(DEPLOY, "slurm", "worker.env")
        own = "\n".join(line for line in text.splitlines() if not line.startswith("#SBATCH"))
        own = own[own.index("arguments=(") :]
        named = set(re.findall(r"(?<![\w-])--[a-z][\w-]*", own)) - {"--signal", "--role", "--scale-command"}
        self.assertGreaterEqual(len(named), 9)
        self.assertLessEqual(named, set(self.options["color3d-worker"].known))

    def test_wrong_arguments_are_noticed(self):
        worker = self.options["color3d-worker"]
        for arguments in (
            ["--serve=https://a:1"],
            ["--server"],
            ["--no-sandbox=1"],
            ["--log-format", "xml"],
            ["worker"],
        ):
            self.assertEqual(len(worker.problems(arguments)), 1, arguments)
        self.assertEqual(worker.problems(["--server", "https://a:1", "--no-sandbox", "--log-format=json"]), [])


class Kubernetes(unittest.TestCase):
    def test_names_ports_secrets_and_selectors_exist(self):
        self.assertEqual(kube.Checks(kubernetes_objects(), secrets()).run(), [])

    def test_faults_are_noticed(self):
        def container(objects, name):
            return kube.pod_of(next(o for o in objects if kube.name_of(o) == name))["containers"][0]

        def spec(objects, name):
            return next(o for o in objects if kube.name_of(o) == name)["spec"]

        server, worker, job = "StatefulSet/color3d-server", "Deployment/color3d-worker", "Job/color3d-workers"
        faults = {
            "a port": lambda o: spec(o, "Service/color3d-server")["ports"][0].update(targetPort="http"),
            "a service": lambda o: container(o, worker)["args"].__setitem__(0, "--server=https://server:50551"),
            "its port": lambda o: container(o, worker)["args"].__setitem__(0, "--server=https://color3d-server:1"),
            "plain": lambda o: container(o, worker)["args"].__setitem__(0, "--server=color3d-server:50551"),
            "a secret": lambda o: kube.pod_of(o[1])["volumes"][1]["secret"].update(secretName="none"),
            "a key": lambda o: container(o, server)["args"].append("--tls-client-ca=/etc/color3d/tls/x.crt"),
            "a volume": lambda o: container(o, worker)["args"].append("--model=/models/a"),
            "a mount": lambda o: container(o, worker)["volumeMounts"].pop(),
            "read-only": lambda o: container(o, worker)["volumeMounts"][0].update(readOnly=True),
            "a selector": lambda o: spec(o, "NetworkPolicy/color3d-worker")["podSelector"].update(
                matchLabels={"app.kubernetes.io/name": "color"}),
            "a peer's port": lambda o: spec(o, "NetworkPolicy/color3d-worker")["egress"][0]["ports"][0].update(port=1),
            "a probe": lambda o: container(o, server)["livenessProbe"]["httpGet"].update(port="http"),
            "a listener": lambda o: container(o, server)["ports"].pop(),
            "root": lambda o: kube.pod_of(o[1])["securityContext"].update(runAsUser=0),
            "writable": lambda o: container(o, job)["securityContext"].pop("readOnlyRootFilesystem"),
            "memory": lambda o: container(o, job)["args"].append("--memory-mib=8192"),
            "the deadline": lambda o: spec(o, job).update(activeDeadlineSeconds=60),
            "Kueue": lambda o: spec(o, job).pop("suspend"),
            "jobs in a budget": lambda o: spec(o, job)["template"]["metadata"]["labels"].update(
                {"app.kubernetes.io/component": "worker"}),
            "a target": lambda o: spec(o, "ScaledObject/color3d-worker")["scaleTargetRef"].update(name="workers"),
            "a namespace": lambda o: o[1]["metadata"].update(namespace="default"),
            "twice": lambda o: o.append(copy.deepcopy(o[1])),
        }  # fmt: skip
        for what, spoil in faults.items():
            with self.subTest(what):
                objects = kubernetes_objects()
                self.assertEqual(kube.name_of(objects[1]), server)
                spoil(objects)
                self.assertNotEqual(kube.Checks(objects, secrets()).run(), [])

    def test_every_file_is_used(self):
        for folder, _, files in os.walk(KUBERNETES):
            named = {"kustomization.yaml", "README.md", "secrets.example.yaml"}
            if "kustomization.yaml" in files:
                named |= set(kube.read_all(os.path.join(folder, "kustomization.yaml"))[0]["resources"])
            self.assertLessEqual(set(files), named, folder)

    def test_kubectl_builds_the_same(self):
        for name in ("base", "autoscaling", "kueue"):
            built = kube.build_by_kubectl(os.path.join(KUBERNETES, name))
            if built is None:
                self.skipTest("no kubectl (Debian's kubernetes-client)")
            own = kube.build(os.path.join(KUBERNETES, name))
            self.assertEqual(sorted(map(kube.name_of, built)), sorted(map(kube.name_of, own)))
            images = [c["image"] for thing in built for c in kube.pod_of(thing).get("containers", [])]
            self.assertTrue(images and all(image.startswith("registry.example.org/color3d:") for image in images))
            if name == "autoscaling":
                [workers] = [thing for thing in built if thing["kind"] == "Deployment"]
                self.assertNotIn("replicas", workers["spec"], "KEDA sets it")

    def test_the_queue_metric_exists(self):
        source = read(ROOT, "server", "metrics", "server_metrics.cc")
        [scaled] = [thing for thing in kubernetes_objects() if thing["kind"] == "ScaledObject"]
        metrics = kube.metrics_of(scaled)
        self.assertEqual(metrics, {"color3d_jobs": ["queued", "running"]})
        for name, states in metrics.items():
            start = source.index(f'"{name}"')
            for state in states:
                self.assertIn(f'{{"{state}"', source[start : start + 400])

    def test_fields_are_those_of_the_api(self):
        """Unknown fields, which a cluster would drop or refuse, by the models of Debian's client."""
        try:
            from kubernetes import client  # pylint: disable=import-outside-toplevel
        except ImportError:
            self.skipTest("no kubernetes in Python (Debian's python3-kubernetes)")
        # Newer than the models of Debian 12.
        newer = {"V1JobSpec": {"podFailurePolicy"}}

        def unknown(value, kind, path):
            if kind.startswith("list["):
                return [p for i, item in enumerate(value) for p in unknown(item, kind[5:-1], f"{path}[{i}]")]
            if not hasattr(client, kind):
                return []
            if not isinstance(value, dict):
                return [f"{path} is no {kind}"]
            model = getattr(client, kind)
            fields = {json: attribute for attribute, json in model.attribute_map.items()}
            problems = []
            for key, item in value.items():
                if key in newer.get(kind, ()):
                    continue
                if key not in fields:
                    problems.append(f"{path}.{key} is no field of {kind}")
                    continue
                problems += unknown(item, model.openapi_types[fields[key]], f"{path}.{key}")
            return problems

        checked = 0
        for thing in kubernetes_objects() + secrets():
            group, _, version = thing["apiVersion"].rpartition("/")
            model = version.capitalize() + thing["kind"]
            if group == "keda.sh":
                continue
            checked += 1
            self.assertEqual(unknown(thing, model, kube.name_of(thing)), [])
        self.assertGreaterEqual(checked, 9)
        self.assertEqual(len(unknown({"spec": {"replica": 1}}, "V1Deployment", "d")), 1)

    def test_image_has_the_user_of_the_pods(self):
        text = read(DEPLOY, "Containerfile")
        users = {kube.pod_of(thing)["securityContext"]["runAsUser"] for thing in kubernetes_objects() if kube.pod_of(thing)}
        [user] = users
        self.assertIn(f"USER {user}:{user}", text)
        self.assertIn(f"--uid {user} --gid {user}", text)
        for service in compose()["services"].values():
            self.assertIn(service.get("user"), (None, f"{user}:{user}"))


class Compose(unittest.TestCase):
    def problems(self, file):
        problems = []
        services = file["services"]
        used = {"secrets": set(), "volumes": set(), "networks": set()}
        for name, service in services.items():
            for kind in ("secrets", "networks"):
                used[kind] |= set(service.get(kind, []))
            volumes = [volume.split(":")[0] for volume in service.get("volumes", [])]
            used["volumes"] |= set(volumes)
            for other, condition in service.get("depends_on", {}).items():
                if other not in services:
                    problems.append(f"{name} depends on {other}, which does not exist")
                elif condition["condition"] == "service_healthy" and "test" not in services[other].get("healthcheck", {}):
                    problems.append(f"{other} has no health check")
                elif not set(service["networks"]) & set(services[other]["networks"]):
                    problems.append(f"{name} does not reach {other}")
            words = service.get("command", []) + list(service.get("environment", {}).values())
            named = set(re.findall(r"/run/secrets/([\w-]+)", " ".join(words)))
            if named != set(service.get("secrets", [])):
                problems.append(f"{name} names the secrets {sorted(named)}")
            if service.get("image") == "color3d":
                hard = (service.get("read_only"), service.get("cap_drop"), service.get("security_opt"))
                if hard != (True, ["ALL"], ["no-new-privileges:true"]):
                    problems.append(f"{name} is not hardened")
            for port in service.get("ports", []):
                if f"--listen=0.0.0.0:{port.split(':')[-1]}" not in service["command"]:
                    problems.append(f"{name} does not listen on {port}")
        for kind, names in used.items():
            if names != set(file[kind]):
                problems.append(f"{kind}: {sorted(names)} are used, {sorted(file[kind])} are there")
        [server] = [values(s["command"])["--server"] for s in services.values() if "--server" in " ".join(s.get("command", []))]
        if server != "https://server:50551" or "server" not in services:
            problems.append(f"no server at {server}")
        store = values(services["server"]["command"])["--store"]
        if not re.match(r"postgresql://color3d@postgresql/color3d\?", store) or "postgresql" not in services:
            problems.append(f"no store at {store}")
        return problems

    def test_names_exist(self):
        self.assertEqual(self.problems(compose()), [])
        self.assertEqual(compose()["services"]["worker"]["deploy"]["replicas"], 2)

    def test_faults_are_noticed(self):
        for what, spoil in {
            "secret": lambda f: f["services"]["worker"]["secrets"].pop(),
            "volume": lambda f: f["volumes"].pop("data"),
            "network": lambda f: f["services"]["worker"].update(networks=["database"]) or f["services"]["server"].update(networks=["workers"]),
            "health": lambda f: f["services"]["server"].pop("healthcheck"),
            "port": lambda f: f["services"]["server"].update(ports=["50551:50552"]),
            "root": lambda f: f["services"]["worker"].pop("read_only"),
            "dependency": lambda f: f["services"]["worker"]["depends_on"].update(database={"condition": "service_started"}),
        }.items():  # fmt: skip
            with self.subTest(what):
                file = compose()
                spoil(file)
                self.assertNotEqual(self.problems(file), [])

    def test_secrets_are_those_of_the_page(self):
        page = read(DEPLOY, "compose", "README.md")
        for secret in compose()["secrets"].values():
            self.assertIn(os.path.basename(secret["file"]), page)


class HtCondor(unittest.TestCase):
    def test_submit_file_is_consistent(self):
        file = condor()
        options = values(condor_arguments())
        sent = [name.strip() for name in file["transfer_input_files"].split(",")]
        self.assertEqual(sorted([options["--token-file"], options["--tls-ca"]]), sorted(sent))
        self.assertEqual(int(file["request_cpus"]), int(options["--threads"]))
        gigabytes = int(re.fullmatch(r"(\d+)GB", file["request_memory"])[1])
        self.assertLess(int(options["--memory-mib"]), gigabytes * 1024)
        self.assertEqual(file["kill_sig"], "SIGTERM")
        self.assertNotIn("queue", read(DEPLOY, "htcondor", "color3d-worker.sub").splitlines(), "-queue gives the number")


class RealPrograms(unittest.TestCase):
    """Server and workers of the files, in a folder that stands for their volumes."""

    def setUp(self):
        self.folder = tempfile.mkdtemp(prefix="color3d-engines-")
        self.addCleanup(shutil.rmtree, self.folder)
        self.processes = []
        self.addCleanup(self.end_all)

    def end_all(self):
        for process in self.processes:
            process.kill()
            process.wait()

    def path(self, name):
        return os.path.join(self.folder, name)

    def start(self, arguments, name):
        os.makedirs(self.path("run"), exist_ok=True)
        with open(self.path(name + ".log"), "wb") as log:
            process = subprocess.Popen(
                arguments, stdin=subprocess.DEVNULL, stdout=log, stderr=log, cwd=self.path("run"))  # fmt: skip
        self.processes.append(process)
        return process

    def wait(self, condition, what):
        end = time.monotonic() + 60
        while not condition():
            logs = "".join(read(self.folder, name) for name in os.listdir(self.folder) if name.endswith(".log"))
            self.assertLess(time.monotonic(), end, f"{what}\n{logs}")
            time.sleep(0.1)

    def make_secrets(self):
        os.makedirs(self.path("run"))
        subprocess.run(
            ["openssl", "req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes", "-days", "2",
             "-subj", "/CN=server", "-addext", "subjectAltName=IP:127.0.0.1", "-keyout", self.path("tls.key"),
             "-out", self.path("tls.crt")], check=True, capture_output=True)  # fmt: skip
        for name, role in (("token", "worker"), ("admin", "admin")):
            token = subprocess.run(
                [os.path.join(BIN, "color3d-server"), "token", name, "--role", role, "--tokens", self.path("tokens")],
                check=True, capture_output=True, text=True).stdout  # fmt: skip
            with open(self.path(name), "w", encoding="utf-8") as file:
                file.write(token)
        # By the names in the files.
        for name, source in {
            "ca.crt": "tls.crt", "ca": "tls.crt", "ca.pem": "tls.crt", "run/ca.pem": "tls.crt",
            "server-certificate": "tls.crt", "server-key": "tls.key", "worker-token": "token",
            "run/worker.token": "token",
        }.items():  # fmt: skip
            shutil.copy(self.path(source), self.path(name))

    def here(self, argument):
        """The argument with its paths below the folder of the test, and free ports."""
        argument = re.sub(r"/(etc/color3d/\w+|run/secrets)/", self.folder + "/", argument)
        argument = re.sub(r"=/(data|cache)", "=" + self.folder, argument)
        argument = re.sub(r"0\.0\.0\.0:\d+|127\.0\.0\.1:50551", "127.0.0.1:0", argument)
        return argument.replace("$(POD_NAME)", "worker-0").replace("$(ClusterId)", "1").replace("$(ProcId)", "0")

    def test_start_with_their_arguments(self):
        self.make_secrets()
        servers = [c for c in commands().items() if c[1][0][0] == "color3d-server"]
        workers = [c for c in commands().items() if c[1][0][0] == "color3d-worker"]
        self.assertEqual((len(servers), len(workers)), (2, 4))
        for number, (where, (program, arguments)) in enumerate(servers):
            # PostgreSQL has its own tests.
            own = [self.here(a) for a in arguments if not a.startswith(("--store", "--data-dir", "--metrics-listen"))]
            port = self.path(f"port-{number}")
            metrics = free_port()
            server = self.start(
                [os.path.join(BIN, program[0]), *program[1:], *own, f"--data-dir={self.path(f'data-{number}')}",
                 f"--port-file={port}", f"--metrics-listen=127.0.0.1:{metrics}"], f"server-{number}")  # fmt: skip
            self.wait(lambda port=port, server=server: os.path.exists(port) or server.poll() is not None, where)
            self.assertIsNone(server.poll(), f"{where}: {read(self.path(f'server-{number}.log'))}")
            self.check_health(metrics)
            if number == 0:
                self.run_workers(workers, read(port).strip())
            server.send_signal(signal.SIGTERM)
            self.assertEqual(server.wait(60), 0)
            self.assertNotEqual(self.health(metrics), 0, "no server")

    def run_workers(self, workers, address):
        for where, (program, arguments) in workers:
            own = [self.here(a) for a in arguments]
            own = ["https://" + address if re.match(r"https://[\w.-]+:50551$", a) else
                   re.sub(r"^--server=.*", "--server=https://" + address, a) for a in own]  # fmt: skip
            name = where.replace(" ", "-").replace("/", "-")
            worker = self.start([os.path.join(BIN, program[0]), *own], name)
            listed = values(own).get("--name", "")
            info = [os.path.join(BIN, "color3d"), "--server", "https://" + address, "--ca", self.path("tls.crt"),
                    "--token-file", self.path("admin"), "server", "info"]  # fmt: skip

            def is_listed(listed=listed, info=info, worker=worker):
                said = subprocess.run(info, check=True, capture_output=True, text=True).stdout
                return re.search(rf"^worker +{listed}", said, re.M) or worker.poll() is not None

            self.wait(is_listed, where)
            self.assertIsNone(worker.poll(), f"{where}: {read(self.path(name + '.log'))}")
            worker.send_signal(signal.SIGTERM)
            self.assertEqual(worker.wait(60), 0, where)

    def health(self, port):
        """The exit status of the health check of compose.yaml."""
        command = compose()["services"]["server"]["healthcheck"]["test"]
        self.assertEqual(command[0], "CMD")
        command = [word.replace("127.0.0.1/9464", f"127.0.0.1/{port}") for word in command[1:]]
        return subprocess.run(command, timeout=30, capture_output=True, check=False).returncode

    def check_health(self, port):
        self.assertEqual(self.health(port), 0)


if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit("usage: engine_files_test.py BIN")
    BIN = os.path.abspath(sys.argv.pop(1))
    unittest.main()
