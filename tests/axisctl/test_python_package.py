"""The Python package as it is handed on: an sdist, and the wheel that is built from it away from the repository, without
network."""
import ast
import email
import shutil
import subprocess
import sys
import tarfile
import tempfile
import tomllib
import unittest
import zipfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def run(*command, cwd):
    done = subprocess.run(command, cwd=cwd, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise AssertionError(f"{command}: {done.stdout}{done.stderr}")


def imported_by(path):
    """Modules of the same package, also those that only a type checker imports."""
    nodes = [node for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
             if isinstance(node, ast.ImportFrom) and node.level == 1]
    return {name for node in nodes for name in ([node.module] if node.module else [alias.name for alias in node.names])}


class Package(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.folder = Path(folder.name)
        # From a copy: setuptools writes beside the sources, and parallel tests share the tree.
        copy = cls.folder / "repository"
        (copy / "api").mkdir(parents=True)
        shutil.copytree(ROOT / "api/python", copy / "api/python", ignore=shutil.ignore_patterns("build", "*.egg-info"))
        shutil.copytree(ROOT / "proto", copy / "proto")
        shutil.copy(ROOT / "LICENSE", copy)
        run(sys.executable, "setup.py", "-q", "sdist", "--dist-dir", cls.folder, cwd=copy / "api/python")
        cls.sdist, = cls.folder.glob("axisd-*.tar.gz")
        shutil.rmtree(copy)
        with tarfile.open(cls.sdist) as archive:
            archive.extractall(cls.folder / "unpacked")
        unpacked, = (cls.folder / "unpacked").iterdir()
        # As pip does, without isolation: its own package may be missing.
        run(sys.executable, "-c", f"from setuptools import build_meta; build_meta.build_wheel({str(cls.folder)!r})",
            cwd=unpacked)
        cls.wheel, = cls.folder.glob("axisd-*.whl")

    def test_the_sdist_has_all_that_its_build_needs(self):
        with tarfile.open(self.sdist) as archive:
            names = {name.split("/", 1)[-1] for name in archive.getnames()}
        contract = {str(path.relative_to(ROOT)) for path in (ROOT / "proto/axisd").rglob("*.proto")}
        modules = {f"axisd/{path.name}" for path in (ROOT / "api/python/axisd").glob("*.py")}
        self.assertLessEqual({"generate.py", "LICENSE", "README.md", "axisd/py.typed"} | contract | modules, names)

    def test_the_wheel_says_what_it_is(self):
        with zipfile.ZipFile(self.wheel) as archive:
            name, = (name for name in archive.namelist() if name.endswith(".dist-info/METADATA"))
            metadata = email.message_from_bytes(archive.read(name))
        with open(ROOT / "api/python/pyproject.toml", "rb") as file:
            project = tomllib.load(file)["project"]
        self.assertEqual(metadata["Name"], "axisd")
        self.assertEqual(metadata["Version"], project["version"])
        self.assertIn(f"VERSION {project['version']} ", (ROOT / "CMakeLists.txt").read_text(encoding="utf-8"))
        self.assertEqual(metadata["License"], "Apache-2.0")
        self.assertEqual(metadata["License-File"], "LICENSE")
        self.assertEqual(metadata["Requires-Python"], ">=3.11")
        self.assertEqual(len(metadata.get_all("Requires-Dist")), 2)
        self.assertIn("Typing :: Typed", metadata.get_all("Classifier"))
        self.assertIn("# axisd for Python", metadata.get_payload())

    def test_no_modules_import_each_other(self):
        imports = {path.stem: imported_by(path) for path in (ROOT / "api/python/axisd").glob("*.py")}
        self.assertGreater(len(imports["machine"]), 5)
        # Whatever imports nothing that is left is taken away; what stays goes round in circles.
        while leaves := [name for name, others in imports.items() if not others & imports.keys()]:
            for name in leaves:
                del imports[name]
        self.assertEqual(imports, {})

    def test_the_wheel_works_by_itself(self):
        with zipfile.ZipFile(self.wheel) as archive:
            archive.extractall(self.folder / "installed")
        run(sys.executable, "-I", "-B", "-c",
            f"import sys; sys.path.insert(0, {str(self.folder / 'installed')!r})\n"
            "import axisd, axisd.v1.axis_service_pb2_grpc, axisd.cell.v1.cell_service_pb2\n"
            "assert axisd.__file__.startswith(sys.path[0]), axisd.__file__\n"
            "axisd.connect, axisd.Axis, axisd.Machine", cwd=self.folder)


if __name__ == "__main__":
    unittest.main()
