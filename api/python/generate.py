"""Generates the stubs of axisd.v1 and axisd.cell.v1 with protoc. Used by setup.py and by tests; needs no network."""
import pathlib
import shutil
import subprocess
import sys

PACKAGES = ("axisd/v1", "axisd/cell/v1")


def proto_folder() -> pathlib.Path:
    """The contract: beside this file in an sdist, else the repository's."""
    here = pathlib.Path(__file__).resolve().parent
    own = here / "proto"
    return own if own.is_dir() else here.parents[1] / "proto"


def protos(folder: pathlib.Path) -> list[str]:
    """The files of the contract below `folder`, without it."""
    return sorted(str(path.relative_to(folder)) for package in PACKAGES for path in folder.glob(f"{package}/*.proto"))


def program(name: str) -> str:
    """The program's path, or an error that says which Debian package brings it."""
    path = shutil.which(name)
    if path is None:
        package = {"protoc": "protobuf-compiler", "grpc_python_plugin": "protobuf-compiler-grpc"}[name]
        raise SystemExit(f"{name} not found: apt install {package}")
    return path


def generate(directory: pathlib.Path) -> None:
    """Writes axisd/v1/*_pb2.py, *_pb2.pyi and *_pb2_grpc.py below `directory`, and those of axisd/cell/v1."""
    folder = proto_folder()
    files = protos(folder)
    if not files:
        raise SystemExit(f"no .proto files below {folder}: build inside the repository, or from an sdist")
    directory = directory.resolve()  # protoc runs elsewhere
    directory.mkdir(parents=True, exist_ok=True)
    subprocess.run(
        [program("protoc"), f"-I{folder}", f"--python_out={directory}", f"--pyi_out={directory}",
         f"--grpc_out={directory}", f"--plugin=protoc-gen-grpc={program('grpc_python_plugin')}", *files],
        check=True, cwd=folder)
    for package in (*PACKAGES, "axisd/cell"):
        (directory / package / "__init__.py").touch()


if __name__ == "__main__":
    generate(pathlib.Path(sys.argv[1]))
