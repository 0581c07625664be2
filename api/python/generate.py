"""Generates the stubs of axisd.v1 and axisd.cell.v1 with protoc. Used by setup.py and by tests; needs no network."""
import pathlib
import shutil
import subprocess
import sys

PROTO = pathlib.Path(__file__).resolve().parents[2] / "proto"


def program(name: str) -> str:
    """The program's path, or an error that says which Debian package brings it."""
    path = shutil.which(name)
    if path is None:
        package = {"protoc": "protobuf-compiler", "grpc_python_plugin": "protobuf-compiler-grpc"}[name]
        raise SystemExit(f"{name} not found: apt install {package}")
    return path


def generate(directory: pathlib.Path) -> None:
    """Writes axisd/v1/*_pb2.py, *_pb2.pyi and *_pb2_grpc.py below `directory`, and those of axisd/cell/v1."""
    packages = ("axisd/v1", "axisd/cell/v1")
    protos = sorted(str(path.relative_to(PROTO)) for package in packages for path in PROTO.glob(f"{package}/*.proto"))
    if not protos:
        raise SystemExit(f"no .proto files below {PROTO}: build inside the repository")
    directory = directory.resolve()  # protoc runs elsewhere
    directory.mkdir(parents=True, exist_ok=True)
    subprocess.run(
        [program("protoc"), f"-I{PROTO}", f"--python_out={directory}", f"--pyi_out={directory}",
         f"--grpc_out={directory}", f"--plugin=protoc-gen-grpc={program('grpc_python_plugin')}", *protos],
        check=True, cwd=PROTO)
    for package in (*packages, "axisd/cell"):
        (directory / package / "__init__.py").touch()


if __name__ == "__main__":
    generate(pathlib.Path(sys.argv[1]))
