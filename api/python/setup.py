"""Adds to the package, while it is built, the stubs that are generated from the contract; and the contract to an sdist,
from which the package can then be built without the repository."""
import pathlib
import shutil
import sys

from setuptools import setup
from setuptools.command.build_py import build_py
from setuptools.command.sdist import sdist

HERE = pathlib.Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))
from generate import generate, protos, proto_folder  # noqa: E402 - needs the path above: build front ends do not add it


class BuildWithStubs(build_py):
    def run(self):
        super().run()
        generate(pathlib.Path(self.build_lib))


class SdistWithContract(sdist):
    def make_release_tree(self, base_dir, files):
        super().make_release_tree(base_dir, files)
        folder = proto_folder()
        for name in protos(folder):
            target = pathlib.Path(base_dir) / "proto" / name
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(folder / name, target)
        shutil.copyfile(folder.parent / "LICENSE", pathlib.Path(base_dir) / "LICENSE")


setup(cmdclass={"build_py": BuildWithStubs, "sdist": SdistWithContract})
