"""Clients of the entrances: which machine a call is for, and who says what of the cell."""
import collections
import importlib
import pathlib
import subprocess
import threading
import time

import grpc

from client import package
from harness import LIMIT, ROOT
from harness.client import Client


def _load():
    """The stubs of the cell's own service, beside those of the machines."""
    folder = package.load()
    if not (folder / "axisd" / "cell" / "v1" / "cell_service_pb2.py").exists():
        plugin = subprocess.run(["which", "grpc_python_plugin"], capture_output=True, text=True, check=True).stdout.strip()
        subprocess.run(["protoc", f"-I{ROOT / 'proto'}", f"--python_out={folder}", f"--grpc_out={folder}",
                        f"--plugin=protoc-gen-grpc={plugin}", "axisd/cell/v1/cell_service.proto"], check=True,
                       cwd=ROOT / "proto")
    return (importlib.import_module("axisd.cell.v1.cell_service_pb2"),
            importlib.import_module("axisd.cell.v1.cell_service_pb2_grpc"))


cell_pb, cell_grpc = _load()
_FIELDS = ("method", "timeout", "metadata", "credentials", "wait_for_ready", "compression")




class _Details(collections.namedtuple("_Details", _FIELDS), grpc.ClientCallDetails):
    pass


class _Named(grpc.UnaryUnaryClientInterceptor, grpc.UnaryStreamClientInterceptor):
    """Adds metadata to every call."""

    def __init__(self, metadata):
        self.metadata = metadata

    def _with(self, details):
        return _Details(details.method, details.timeout, [*(details.metadata or ()), *self.metadata], details.credentials,
                        details.wait_for_ready, details.compression)

    def intercept_unary_unary(self, continuation, client_call_details, request):
        return continuation(self._with(client_call_details), request)

    def intercept_unary_stream(self, continuation, client_call_details, request):
        return continuation(self._with(client_call_details), request)


class CellClient(Client):
    """As somebody with a certificate, at one address; `machine`: for which each call is; None: the entrance's own."""

    def __init__(self, cell, entrance, machine=None, user="shift-a", port=7445, metadata=()):
        pki = pathlib.Path(cell.path("pki"))
        self._metadata = [*metadata, *([("axisd-machine", machine)] if machine else [])]
        credentials = grpc.ssl_channel_credentials(*[(pki / name).read_bytes() for name in
                                                     ("ca.crt", f"{user}.key", f"{user}.crt")])
        super().__init__(f"{cell.address(entrance)}:{port}", credentials,
                         [("grpc.initial_reconnect_backoff_ms", 100), ("grpc.max_reconnect_backoff_ms", 500)])

    def connect(self):
        super().connect()
        self.raw = self.channel
        self.cell = cell_grpc.CellServiceStub(self.channel)
        if self._metadata:
            named = grpc.intercept_channel(self.channel, _Named(self._metadata))
            for name, stub in list(vars(self).items()):
                if name in ("axis", "command", "system", "event", "group", "lease", "bus", "drive", "audit", "cell"):
                    setattr(self, name, type(stub)(named))

    def machines(self, timeout=LIMIT):
        """Name to Machine, as this entrance knows them."""
        return {machine.name: machine
                for machine in self.call(self.cell.ListMachines, cell_pb.ListMachinesRequest(), timeout).machines}

    def states(self, timeout=LIMIT):
        """Name to the name of its state."""
        return {name: cell_pb.MachineState.Name(machine.state).removeprefix("MACHINE_STATE_")
                for name, machine in self.machines(timeout).items()}

    def registry(self):
        answer = self.call(self.cell.GetCell, cell_pb.GetCellRequest())
        return cell_pb.RegistryState.Name(answer.registry).removeprefix("REGISTRY_STATE_")

    def registry_trouble(self):
        return self.call(self.cell.GetCell, cell_pb.GetCellRequest()).registry_trouble


class MachineWatch:
    """What one entrance tells of machines, with the time when it came."""

    def __init__(self, client):
        self.changes = []  # (when, machine, state)
        self._stream = client.cell.WatchMachines(cell_pb.WatchMachinesRequest())
        self._thread = threading.Thread(target=self._read, daemon=True)
        self._thread.start()

    def _read(self):
        try:
            for message in self._stream:
                at = time.monotonic()
                for machine in message.machines:
                    state = cell_pb.MachineState.Name(machine.state).removeprefix("MACHINE_STATE_")
                    self.changes.append((at, machine.name, state))
        except grpc.RpcError:
            pass  # the entrance ended, or the test did

    def states(self, machine, after=0.0):
        """When, and to what, one machine changed; repetitions left out."""
        found = []
        for at, name, state in list(self.changes):
            if name == machine and at >= after and (not found or found[-1][1] != state):
                found.append((at, state))
        return found

    def close(self):
        self._stream.cancel()
        self._thread.join(LIMIT)
