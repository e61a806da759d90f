"""Adds the generated modules to a build from the repository; a source tarball has them already."""

import os
import sys

from setuptools import setup
from setuptools.command.build_py import build_py

HERE = os.path.dirname(os.path.abspath(__file__))
GENERATED = ["color3d.v1", "color3d.wire"]
IS_TARBALL = os.path.isdir(os.path.join(HERE, "color3d", "v1"))


class BuildPy(build_py):
    """Generates the modules of the API into the build folder if they are missing."""

    def run(self):
        super().run()
        if not IS_TARBALL:
            sys.path.insert(0, HERE)
            import generate  # pylint: disable=import-outside-toplevel

            generate.generate(os.path.join(self.build_lib, "color3d"))


setup(packages=["color3d"] + (GENERATED if IS_TARBALL else []), cmdclass={"build_py": BuildPy})
