"""The HTTP rules and Envoy's configuration against the API: no server runs.

Exits with 77 (skipped) where a package is missing. Envoy checks its configuration itself where it
is installed.
"""

import itertools
import os
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, HERE)
sys.dont_write_bytecode = True
try:
    import yaml
    from google.protobuf import descriptor_pb2, descriptor_pool

    import make_descriptors
except ImportError as missing:
    print(f"SKIPPED: {missing} (Debian's python3-protobuf and python3-yaml are needed)")
    sys.exit(77)
if not shutil.which("protoc"):
    print("SKIPPED: no protoc (Debian's protobuf-compiler is needed)")
    sys.exit(77)

VERBS = ("get", "put", "post", "delete", "patch")
# As google/api/http.proto and annotations.proto declare it, for what the rules use.
HTTP_PROTO = """syntax = "proto3"; package google.api; import "google/protobuf/descriptor.proto";
message HttpRule {
  string selector = 1; string body = 7; string response_body = 12;
  oneof pattern {
    string get = 2; string put = 3; string post = 4; string delete = 5; string patch = 6;
  }
}
extend google.protobuf.MethodOptions { HttpRule http = 72295728; }"""


def read(name):
    with open(os.path.join(HERE, name), encoding="utf-8") as file:
        return file.read()


def pattern_of(rule):
    """The verb and the path of a rule."""
    [verb] = [key for key in rule if key in VERBS]
    return verb, rule[verb]


def variables(path):
    """{field: template} of a path."""
    return {m[1]: m[2] or "*" for m in re.finditer(r"\{([\w.]+)(?:=([^}]+))?\}", path)}


def segments(path):
    """The path in segments, the verb after ':' in the last: ["v1", "jobs", "*:cancel"]."""
    plain = re.sub(r"\{[\w.]+=([^}]+)\}", r"\1", re.sub(r"\{[\w.]+\}", "*", path))
    return plain.strip("/").split("/")


def overlap(a, b):
    """Whether one URL matches both paths. Names of resources have no ':', so `*` has none."""
    if len(a) != len(b):
        return False
    for left, right in zip(a, b):
        left, right = (left.partition(":"), right.partition(":"))
        if left[2] != right[2] or "*" not in (left[0], right[0]) and left[0] != right[0]:
            return False
    return True


class RestTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.mkdtemp(prefix="color3d-rest-")
        # The command of the page.
        command = re.search(r"^(deploy/rest/make_descriptors\.py) (\S+)$", read("README.md"), re.M)
        assert command, "README.md has no line that makes the descriptors"
        cls.path_of_page = command[2]
        cls.out = os.path.join(cls.folder, "rest.pb")
        script = os.path.join(HERE, "..", "..", command[1])
        subprocess.run([sys.executable, script, cls.out], check=True)
        with open(cls.out, "rb") as file:
            cls.bytes = file.read()
        cls.rules = make_descriptors.read_rules()
        pool = descriptor_pool.DescriptorPool()
        cls.methods = {}
        for file in descriptor_pb2.FileDescriptorSet.FromString(cls.bytes).file:
            pool.Add(file)  # fails if an import is missing
            for service in pool.FindFileByName(file.name).services_by_name.values():
                cls.methods.update({m.full_name: m for m in service.methods})

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.folder)

    def test_every_method_has_one_rule(self):
        selectors = [rule["selector"] for rule in self.rules]
        self.assertEqual(sorted(selectors), sorted(self.methods))

    def test_the_public_protos_are_all_described(self):
        folder = os.path.join(HERE, "..", "..", "proto", "color3d", "v1")
        for name in os.listdir(folder):
            for service in re.findall(r"^service (\w+)", read(os.path.join(folder, name)), re.M):
                described = [m for m in self.methods if m.startswith(f"color3d.v1.{service}.")]
                self.assertTrue(described, service)

    def test_rules_name_fields_that_exist(self):
        for rule in self.rules:
            with self.subTest(rule["selector"]):
                self.assertLessEqual(set(rule), set(make_descriptors.FIELDS))
                verb, path = pattern_of(rule)
                self.assertRegex(path, r"^/v1/[\w/{}=*:]+$")
                fields = self.methods[rule["selector"]].input_type.fields_by_name
                for name, template in variables(path).items():
                    self.assertIn(name, fields)
                    self.assertEqual(fields[name].type, fields[name].TYPE_STRING)
                    self.assertRegex(template, r"^[\w*]+(/[\w*]+)*$")
                body = rule.get("body")
                self.assertTrue(body in (None, "*") or body in fields, body)
                if verb in ("get", "delete"):
                    self.assertIsNone(body)
                else:
                    self.assertEqual(body, "*")
                if "response_body" in rule:
                    output = self.methods[rule["selector"]].output_type
                    self.assertIn(rule["response_body"], output.fields_by_name)

    def test_a_name_in_a_path_is_a_name_of_the_api(self):
        """`scenes/*` in a path is what the comment of a name field says, "scenes/{scene_id}"."""
        folder = os.path.join(HERE, "..", "..", "proto", "color3d", "v1")
        text = "".join(read(os.path.join(folder, name)) for name in os.listdir(folder))
        for rule in self.rules:
            for template in variables(pattern_of(rule)[1]).values():
                start = template.split("/*")[0]
                self.assertIn(f'"{start}/{{', text, rule["selector"])

    def test_no_request_matches_two_rules(self):
        for one, other in itertools.combinations(self.rules, 2):
            (verb, path), (other_verb, other_path) = pattern_of(one), pattern_of(other)
            if verb == other_verb:
                self.assertFalse(
                    overlap(segments(path), segments(other_path)), f"{verb} {path} and {other_path}"
                )

    def test_overlap_is_seen(self):
        for one, other, expected in (
            ("/v1/{name=jobs/*}", "/v1/jobs/{id}", True),
            ("/v1/{name=jobs/*}:kill", "/v1/{name=jobs/*}:kill", True),
            ("/v1/{name=jobs/*}:kill", "/v1/{name=jobs/*}:pin", False),
            ("/v1/{name=jobs/*}", "/v1/{name=jobs/*}:pin", False),
            ("/v1/{name=*/*}", "/v1/{name=jobs/*}", True),
            ("/v1/jobs:watch", "/v1/jobs", False),
        ):
            self.assertEqual(overlap(segments(one), segments(other)), expected, (one, other))

    def test_descriptors_carry_the_rules(self):
        """Read back as google.api.http, as Envoy does, not by the code that wrote them."""
        source = os.path.join(self.folder, "color3d_http.proto")
        with open(source, "w", encoding="utf-8") as file:
            file.write(HTTP_PROTO)
        output = f"--python_out={self.folder}"
        subprocess.run(["protoc", "-I", self.folder, "-I/usr/include", output, source], check=True)
        sys.path.insert(0, self.folder)
        import color3d_http_pb2  # pylint: disable=import-outside-toplevel,import-error

        found = {}
        for file in descriptor_pb2.FileDescriptorSet.FromString(self.bytes).file:
            for service in file.service:
                for method in service.method:
                    rule = method.options.Extensions[color3d_http_pb2.http]
                    values = {descriptor.name: value for descriptor, value in rule.ListFields()}
                    found[values["selector"]] = values
                    self.assertEqual(
                        values["selector"], f"{file.package}.{service.name}.{method.name}"
                    )
        self.assertEqual(found, {rule["selector"]: rule for rule in self.rules})

    def test_a_wrong_rule_is_refused(self):
        descriptors = descriptor_pb2.FileDescriptorSet.FromString(self.bytes)
        for rules in (
            [{"selector": "color3d.v1.JobService.None", "get": "/v1/none"}],
            [{"selector": "color3d.v1.JobService.GetJob", "get": f"/v1/{n}"} for n in "ab"],
        ):
            with self.assertRaises(SystemExit):
                make_descriptors.annotate(descriptors, rules)

    def test_envoy_serves_what_the_rules_name(self):
        text = read("envoy.yaml")
        listener = yaml.safe_load(text)["static_resources"]["listeners"][0]
        manager = listener["filter_chains"][0]["filters"][0]["typed_config"]
        transcoder = manager["http_filters"][0]["typed_config"]
        services = {method.rpartition(".")[0] for method in self.methods}
        self.assertEqual(sorted(transcoder["services"]), sorted(services))
        self.assertEqual(transcoder["proto_descriptor"], self.path_of_page)
        self.assertIn(
            "google.rpc",
            [f.package for f in descriptor_pb2.FileDescriptorSet.FromString(self.bytes).file],
        )
        self.assertEqual(manager["http_filters"][-1]["name"], "envoy.filters.http.router")

    def test_envoy_accepts_the_configuration(self):
        envoy = shutil.which("envoy")
        if not envoy:
            self.skipTest("no envoy on this machine")
        configuration = os.path.join(self.folder, "envoy.yaml")
        with open(configuration, "w", encoding="utf-8") as file:
            file.write(read("envoy.yaml").replace(self.path_of_page, self.out))
        subprocess.run([envoy, "--mode", "validate", "-c", configuration], check=True)


if __name__ == "__main__":
    unittest.main()
