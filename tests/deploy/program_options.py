"""The options of color3d-server serve and color3d-worker, from their --help."""

import re
import subprocess

_LINE = re.compile(r"^\s+(?:-\w,)?(--[a-z][\w-]*)(?:\{false\})?(?:\s+([A-Z]+)\b(?::\{([^}]*)\})?)?", re.M)


class Options:
    """{option: (takes a value, allowed values or None)} of one command."""

    def __init__(self, command):
        text = subprocess.run([*command, "--help"], check=True, capture_output=True, text=True).stdout
        self.command = " ".join([command[0].rsplit("/", 1)[-1], *command[1:]])
        self.known = {}
        for name, kind, values in _LINE.findall(text):
            allowed = values.split(",") if values else None
            self.known[name] = (bool(kind), allowed)
        assert "--log-level" in self.known, text

    def problems(self, arguments):
        """What is wrong with these arguments."""
        problems = []
        rest = list(arguments)
        while rest:
            argument = rest.pop(0)
            name, equals, value = argument.partition("=")
            if name not in self.known:
                problems.append(f"{self.command} has no option {argument}")
                continue
            takes_value, allowed = self.known[name]
            if takes_value and not equals:
                value = rest.pop(0) if rest and not rest[0].startswith("--") else None
                if value is None:
                    problems.append(f"{self.command} {name} lacks its value")
                    continue
            if equals and not takes_value:
                problems.append(f"{self.command} {name} takes no value")
            if takes_value and allowed and value not in allowed:
                problems.append(f"{self.command} {name} cannot be {value}")
        return problems


def values(arguments):
    """{option: value} of arguments in either form."""
    found = {}
    rest = list(arguments)
    while rest:
        name, equals, value = rest.pop(0).partition("=")
        if not equals and rest and not rest[0].startswith("--"):
            value = rest.pop(0)
        found[name] = value
    return found
