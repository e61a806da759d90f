"""Checks of Kubernetes objects against each other. Each returns a list of problems."""

import os
import re
import shutil
import subprocess

import yaml
from program_options import values

POD_KINDS = ("StatefulSet", "Deployment", "Job")


def read_all(file):
    with open(file, encoding="utf-8") as stream:
        return [document for document in yaml.safe_load_all(stream) if document]


def build(folder):
    """The objects of a kustomization: its resources, with the namespace and images that it sets."""
    kustomization = read_all(os.path.join(folder, "kustomization.yaml"))[0]
    objects = []
    for resource in kustomization["resources"]:
        path = os.path.join(folder, resource)
        objects += build(path) if os.path.isdir(path) else read_all(path)
    for thing in objects:
        if thing["kind"] != "Namespace":
            thing["metadata"]["namespace"] = kustomization["namespace"]
        for container in pod_of(thing).get("containers", []):
            for image in kustomization.get("images", []):
                if container["image"] == image["name"]:
                    container["image"] = f"{image['newName']}:{image['newTag']}"
    return objects


def build_by_kubectl(folder):
    """The same by `kubectl kustomize`; None without kubectl."""
    if not shutil.which("kubectl"):
        return None
    result = subprocess.run(["kubectl", "kustomize", folder], check=True, capture_output=True, text=True)
    return [document for document in yaml.safe_load_all(result.stdout) if document]


def name_of(thing):
    return f"{thing['kind']}/{thing['metadata']['name']}"


def pod_of(thing):
    """The pod's spec; {} for other objects."""
    return thing["spec"]["template"]["spec"] if thing["kind"] in POD_KINDS else {}


def labels_of(thing):
    return thing["spec"]["template"]["metadata"]["labels"]


def matches(selector, labels):
    for key, value in selector.get("matchLabels", {}).items():
        if labels.get(key) != value:
            return False
    for term in selector.get("matchExpressions", []):
        assert term["operator"] == "In", term
        if labels.get(term["key"]) not in term["values"]:
            return False
    return True


def mebibytes(quantity):
    number, unit = re.fullmatch(r"(\d+)(Mi|Gi)", quantity).groups()
    return int(number) * (1024 if unit == "Gi" else 1)


class Checks:
    """All objects that are applied together."""

    def __init__(self, objects, secrets):
        self.objects = objects
        self.pods = [thing for thing in objects if pod_of(thing)]
        self.secrets = {secret["metadata"]["name"]: set(secret["data"]) for secret in secrets}
        self.problems = []

    def run(self):
        names = [name_of(thing) for thing in self.objects]
        self.require(len(names) == len(set(names)), f"a name is used twice: {names}")
        namespaces = {thing["metadata"].get("namespace") for thing in self.objects if thing["kind"] != "Namespace"}
        self.require(len(namespaces) == 1, f"one namespace, not {namespaces}")
        for thing in self.objects:
            kind = thing["kind"]
            if kind in POD_KINDS:
                self.check_pod(thing)
            check = getattr(self, "check_" + kind.lower(), None)
            if check:
                check(thing)
        return self.problems

    def require(self, is_good, problem):
        if not is_good:
            self.problems.append(problem)

    def selected(self, selector):
        return [pod for pod in self.pods if matches(selector, labels_of(pod))]

    def check_pod(self, thing):
        name, pod = name_of(thing), pod_of(thing)
        context = pod.get("securityContext", {})
        self.require(context.get("runAsNonRoot") is True and context.get("runAsUser", 0) > 0, f"{name}: root")
        self.require(context.get("seccompProfile") == {"type": "RuntimeDefault"}, f"{name}: no seccomp profile")
        self.require(pod.get("automountServiceAccountToken") is False, f"{name}: a service account's token")
        volumes = {volume["name"]: volume for volume in pod.get("volumes", [])}
        for template in thing["spec"].get("volumeClaimTemplates", []):
            volumes[template["metadata"]["name"]] = template
        mounted = {mount["name"] for container in pod["containers"] for mount in container["volumeMounts"]}
        self.require(mounted == set(volumes), f"{name}: volumes {sorted(volumes)}, mounted {sorted(mounted)}")
        for volume in volumes.values():
            if "secret" in volume:
                self.check_secret(name, volume["secret"])
        selector = thing["spec"].get("selector")
        if selector:
            self.require(matches(selector, labels_of(thing)), f"{name}: its selector does not match its pods")
        for container in pod["containers"]:
            self.check_container(name, container, volumes)

    def check_secret(self, name, secret):
        keys = self.secrets.get(secret["secretName"])
        if keys is None:
            self.problems.append(f"{name}: no example of the secret {secret['secretName']}")
            return
        wanted = {item["key"] for item in secret.get("items", [])}
        self.require(wanted <= keys, f"{name}: {secret['secretName']} has no {sorted(wanted - keys)}")
        self.require(secret.get("defaultMode", 0o644) & 0o022 == 0, f"{name}: others may write the secret")

    def check_container(self, name, container, volumes):
        context = container.get("securityContext", {})
        self.require(context.get("readOnlyRootFilesystem") is True, f"{name}: writable root")
        self.require(context.get("allowPrivilegeEscalation") is False, f"{name}: may gain privileges")
        self.require(context.get("capabilities") == {"drop": ["ALL"]}, f"{name}: has capabilities")
        ports = {port["name"]: port["containerPort"] for port in container.get("ports", [])}
        for probe in ("startupProbe", "readinessProbe", "livenessProbe"):
            for action in ("httpGet", "tcpSocket"):
                port = container.get(probe, {}).get(action, {}).get("port")
                self.require(port is None or port in ports, f"{name}: {probe} uses the port {port}")
        options = values(container["args"])
        for option in ("--listen", "--metrics-listen"):
            number = options.get(option, "").rpartition(":")[2]
            self.require(not number or int(number) in ports.values(), f"{name}: no port {number} of {option}")
        self.check_paths(name, container, volumes, options)
        limit = container["resources"]["limits"]["memory"]
        memory = int(options.get("--memory-mib", 0))
        self.require(memory < mebibytes(limit), f"{name}: --memory-mib {memory} is not below {limit}")
        if "--server" in options:
            self.check_server(name, options["--server"])

    def check_paths(self, name, container, volumes, options):
        mounts = {mount["mountPath"]: mount for mount in container["volumeMounts"]}
        for option, value in options.items():
            if not value.startswith("/"):
                continue
            place = [path for path in mounts if value.startswith(path + "/")]
            if not place:
                self.problems.append(f"{name}: {option} {value} is in no volume")
                continue
            mount = mounts[place[0]]
            volume = volumes.get(mount["name"], {})
            if "secret" in volume:
                items = {item["path"] for item in volume["secret"].get("items", [])}
                files = items or self.secrets.get(volume["secret"]["secretName"], set())
                self.require(value[len(place[0]) + 1 :] in files, f"{name}: {option} {value} is not in the secret")
            else:
                self.require(not mount.get("readOnly"), f"{name}: {option} {value} is read-only")

    def check_server(self, name, address):
        match = re.fullmatch(r"https://([\w-]+):(\d+)", address)
        if not match:
            self.problems.append(f"{name}: --server {address} is no https://SERVICE:PORT")
            return
        services = [thing for thing in self.objects if name_of(thing) == "Service/" + match[1]]
        if not services:
            self.problems.append(f"{name}: there is no service {match[1]}")
            return
        ports = [port["port"] for port in services[0]["spec"]["ports"]]
        self.require(int(match[2]) in ports, f"{name}: the service {match[1]} has no port {match[2]}")

    def check_statefulset(self, thing):
        services = [name_of(other) for other in self.objects]
        self.require("Service/" + thing["spec"]["serviceName"] in services, f"{name_of(thing)}: no such service")

    def check_job(self, thing):
        name = name_of(thing)
        queue = thing["metadata"].get("labels", {}).get("kueue.x-k8s.io/queue-name")
        self.require(queue and thing["spec"].get("suspend") is True, f"{name}: Kueue needs its label and suspend")
        self.require(pod_of(thing)["restartPolicy"] == "Never", f"{name}: podFailurePolicy needs restartPolicy Never")
        containers = {container["name"] for container in pod_of(thing)["containers"]}
        for rule in thing["spec"]["podFailurePolicy"]["rules"]:
            named = rule.get("onExitCodes", {}).get("containerName")
            self.require(named is None or named in containers, f"{name}: no container {named}")
        until = int(values(pod_of(thing)["containers"][0]["args"])["--until"])
        self.require(until < thing["spec"]["activeDeadlineSeconds"], f"{name}: --until is after the deadline")

    def check_service(self, thing):
        pods = self.selected({"matchLabels": thing["spec"]["selector"]})
        self.require(len(pods) == 1, f"{name_of(thing)}: selects {[name_of(pod) for pod in pods]}")
        ports = {port["name"] for pod in pods for container in pod_of(pod)["containers"] for port in container["ports"]}
        for port in thing["spec"]["ports"]:
            self.require(port["targetPort"] in ports, f"{name_of(thing)}: no port {port['targetPort']}")

    def check_poddisruptionbudget(self, thing):
        kinds = {pod["kind"] for pod in self.selected(thing["spec"]["selector"])}
        self.require(kinds == {"Deployment"}, f"{name_of(thing)}: selects pods of {sorted(kinds)}")

    def check_networkpolicy(self, thing):
        name, spec = name_of(thing), thing["spec"]
        pods = self.selected(spec["podSelector"])
        self.require(pods, f"{name}: selects nothing")
        self.require(spec["policyTypes"] == ["Ingress", "Egress"], f"{name}: one direction is open")
        for rule in spec.get("ingress", []):
            self.check_ports(name, rule, pods)
            self.check_peers(name, rule["from"])
        for rule in spec.get("egress", []):
            peers = [pod for peer in rule["to"] if "podSelector" in peer for pod in self.selected(peer["podSelector"])]
            if peers:
                self.check_ports(name, rule, peers)
            self.check_peers(name, rule["to"])

    def check_ports(self, name, rule, pods):
        ports = set()
        for pod in pods:
            for container in pod_of(pod)["containers"]:
                for port in container.get("ports", []):
                    ports |= {port["name"], port["containerPort"]}
        for port in rule["ports"]:
            self.require(port["port"] in ports, f"{name}: no port {port['port']}")

    def check_peers(self, name, peers):
        for peer in peers:
            selector = peer.get("podSelector")
            if selector and "color3d-client" not in selector.get("matchLabels", {}):
                self.require(self.selected(selector), f"{name}: a peer that selects nothing")

    def check_scaledobject(self, thing):
        target = "Deployment/" + thing["spec"]["scaleTargetRef"]["name"]
        found = [other for other in self.objects if name_of(other) == target]
        self.require(found, f"{name_of(thing)}: there is no {target}")


def metrics_of(thing):
    """The metrics in the queries of a ScaledObject, with the values of their labels."""
    found = {}
    for trigger in thing["spec"]["triggers"]:
        for name, labels in re.findall(r"(color3d_\w+)(?:\{([^}]*)\})?", trigger["metadata"]["query"]):
            found[name] = [value for text in re.findall(r'=~?"([^"]*)"', labels) for value in text.split("|")]
    return found
