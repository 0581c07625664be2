"""Makes the axisd Python package importable in tests: sources of api/python with stubs generated on the spot, in a
directory of this process, so that parallel tests never meet.

    from client import package
    package.load()
    import axisd
    from axisd.v1 import types_pb2
"""
import atexit
import importlib.util
import pathlib
import shutil
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[3]
_loaded: pathlib.Path | None = None


def build(directory: pathlib.Path) -> None:
    """Writes the complete package below `directory`."""
    source = ROOT / "api" / "python"
    spec = importlib.util.spec_from_file_location("axisd_generate", source / "generate.py")
    assert spec is not None and spec.loader is not None
    generate = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(generate)
    shutil.copytree(source / "axisd", directory / "axisd", ignore=shutil.ignore_patterns("__pycache__"))
    generate.generate(directory)


def load() -> pathlib.Path:
    """Builds the package once per process and puts it on the path; the directory goes when the process ends."""
    global _loaded
    if _loaded is None:
        _loaded = pathlib.Path(tempfile.mkdtemp(prefix="axisd-client-"))
        atexit.register(shutil.rmtree, _loaded, ignore_errors=True)
        build(_loaded)
        sys.path.insert(0, str(_loaded))
    return _loaded
