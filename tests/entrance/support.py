"""A cell: an etcd of several members, and machines with simulated drives, each with its axisd and its axisd-cell."""
import base64
import itertools
import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import time

import grpc

from client import package
from harness import LIMIT, Client, Program, Scenario, own_host, run, spinner, wait_for
from harness.client import CallFailed, error_pb, event_pb
from harness.notify import NotifySocket

AXISD_CELL = os.environ["AXISD_CELL"]
CELL = "hall-1"
_numbers = itertools.count()


def load_stubs():
    """Of axisd.cell.v1, beside those of axisd.v1."""
    root = package.load()
    if not (root / "axisd" / "cell").exists():
        proto = package.ROOT / "proto"
        done = subprocess.run(
            ["protoc", f"-I{proto}", f"--python_out={root}", f"--grpc_out={root}",
             f"--plugin=protoc-gen-grpc={shutil.which('grpc_python_plugin')}", "axisd/cell/v1/cell_service.proto"],
            cwd=proto, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        for folder in ("cell", "cell/v1"):
            (root / "axisd" / folder / "__init__.py").touch()


load_stubs()
from axisd.cell.v1 import cell_service_pb2 as cell_pb, cell_service_pb2_grpc  # noqa: E402

PRESENT, SILENT = cell_pb.MACHINE_STATE_PRESENT, cell_pb.MACHINE_STATE_SILENT
UNREGISTERED, GONE = cell_pb.MACHINE_STATE_UNREGISTERED, cell_pb.MACHINE_STATE_GONE
OK, DEGRADED = cell_pb.REGISTRY_STATE_OK, cell_pb.REGISTRY_STATE_DEGRADED


HOST = own_host()


class Etcd:
    """Members of one cluster; clients at port 2400, 2402 ..."""

    def __init__(self, members=1):
        memory = "/dev/shm" if os.access("/dev/shm", os.W_OK) else None
        self.directory = tempfile.mkdtemp(prefix="axetcd-", dir=memory)
        self.members = members
        self.programs = [None] * members
        self._base = 2400 + 10 * next(_numbers)

    def client(self, index):
        return f"{HOST}:{self._base + 2 * index}"

    def peer(self, index):
        return f"http://{HOST}:{self._base + 2 * index + 1}"

    @property
    def endpoints(self):
        return [self.client(index) for index in range(self.members)]

    def start_member(self, index):
        existing = (pathlib.Path(self.directory) / f"m{index}").exists()
        cluster = ",".join(f"m{i}={self.peer(i)}" for i in range(self.members))
        self.programs[index] = Program(
            f"etcd-{index}-{next(_numbers)}",
            ["/usr/bin/etcd", "--name", f"m{index}", "--data-dir", f"{self.directory}/m{index}",
             "--listen-client-urls", f"http://{self.client(index)}", "--advertise-client-urls",
             f"http://{self.client(index)}", "--listen-peer-urls", self.peer(index), "--initial-advertise-peer-urls",
             self.peer(index), "--initial-cluster", cluster, "--initial-cluster-state",
             "existing" if existing else "new", "--unsafe-no-fsync", "--log-level", "warn"],
            self.directory)

    def start(self):
        for index in range(self.members):
            self.start_member(index)
        self.wait_healthy()
        return self

    def wait_healthy(self, endpoint=None):
        wait_for(lambda: self.ctl("endpoint", "health", "--command-timeout=2s", endpoint=endpoint).returncode == 0,
                 "etcd is healthy")

    def ctl(self, *words, endpoint=None):
        return run(["/usr/bin/etcdctl", "--endpoints", endpoint or ",".join(self.endpoints), *words],
                   env=os.environ | {"ETCDCTL_API": "3"})

    def value(self, key):
        """Its bytes; empty: there is no such key."""
        found = json.loads(self.ctl("get", "-w", "json", f"/axisd/{CELL}/{key}").stdout or "{}").get("kvs", [])
        return base64.b64decode(found[0]["value"]) if found else b""

    def kill_member(self, index):
        self.programs[index].kill()

    def kill(self):
        for program in self.programs:
            if program is not None:
                program.kill()

    def remove(self):
        shutil.rmtree(self.directory, ignore_errors=True)

    def logs(self):
        return "".join(f"\n===== {program.name}\n{program.log()[-4000:]}" for program in self.programs if program)


class Entrance:
    """An axisd-cell beside a machine's axisd. `keys`: more lines of its configuration; `computer`: what tells it from
    others."""

    def __init__(self, machine, etcd=None, keys="", computer=None, listen=None, axisd=None):
        self.machine, self.etcd, self.keys = machine, etcd, keys
        self.number = next(_numbers)
        self.directory = machine.path(f"cell-{self.number}")
        os.mkdir(self.directory)
        self.state = f"{self.directory}/state"
        self.config = f"{self.directory}/cell.yaml"
        self.computer = f"{self.directory}/machine-id"
        pathlib.Path(self.computer).write_text(f"{computer or machine.directory}\n")
        self.address = listen or f"{HOST}:{7500 + self.number}"
        self.axisd = axisd or f"unix:{machine.socket}"
        self.program = self.notify = None
        self.before = ()  # the program and its options that start it
        self._clients, self._runs = [], 0

    def text(self):
        """Its configuration."""
        lines = [f"cell: {CELL}", f"machine: {self.machine.name}", f"listen: {self.address}",
                 f"axisd: {{ server: \"unix:{self.machine.socket}\", advertise: \"{self.axisd}\" }}",
                 f"state: {self.state}"]
        if self.etcd:
            lines.append(f"etcd: {{ endpoints: [ {', '.join(self.etcd.endpoints)} ], ttl: 5 s }}")
        return "\n".join(lines) + f"\n{self.keys}\n"

    def start(self, wait=True):
        pathlib.Path(self.config).write_text(self.text())
        self._runs += 1
        if self.notify is None:
            self.notify = NotifySocket(self.directory)
        self.notify.forget()
        self.program = Program(f"axisd-cell-{self.number}-{self._runs}",
                               [*self.before, AXISD_CELL, "--config", self.config, "--machine-id-file", self.computer],
                               self.machine.directory, {"NOTIFY_SOCKET": self.notify.path})
        if wait:
            self.notify.wait_for("READY=1", self.program)
        return self

    def connect(self):
        """A client of axisd.v1; `metadata` of its calls: see at()."""
        client = Client(self.address)
        client.cell = cell_service_pb2_grpc.CellServiceStub(client.channel)
        self._clients.append(client)
        return client

    @property
    def client(self):
        return self._clients[0] if self._clients else self.connect()

    def get(self):
        return self.client.call(self.client.cell.GetCell, cell_pb.GetCellRequest())

    def machines(self):
        """By their names."""
        answer = self.client.call(self.client.cell.ListMachines, cell_pb.ListMachinesRequest())
        return {machine.name: machine for machine in answer.machines}

    def state_of(self, name):
        return getattr(self.machines().get(name), "state", None)

    def wait_for_state(self, name, state):
        wait_for(lambda: self.state_of(name) == state, f"{self.machine.name} sees {name} as {state}")

    def at(self, name, method, request, timeout=LIMIT, more=()):
        """A call for the machine `name`; None: without the metadata."""
        metadata = ((("axisd-machine", name),) if name is not None else ()) + tuple(more)
        try:
            return method(request, timeout=timeout, metadata=metadata)
        except grpc.RpcError as error:
            raise CallFailed(error) from None

    def stop_all(self, reason="test"):
        return self.client.call(self.client.cell.StopAll, cell_pb.StopAllRequest(reason=reason))

    def release(self):
        return self.client.call(self.client.cell.ReleaseStopAll, cell_pb.ReleaseStopAllRequest())

    def events(self):
        """All that it has seen since its start."""
        stream = self.client.cell.WatchEvents(cell_pb.WatchEventsRequest(after_sequence=0), timeout=LIMIT)
        try:
            found = []
            for message in stream:
                found += message.events
                if message.cursor == message.newest:
                    return found
        finally:
            stream.cancel()
        return []

    def stop(self):
        if self.program is not None and self.program.running():
            self.program.terminate()
        self.forget()

    def kill(self):
        self.program.kill()
        self.forget()

    def forget(self):
        for client in self._clients:
            client.close()
        self._clients = []
        if self.program is not None:
            self.program.check_memory()

    def close(self):
        self.stop()
        if self.notify is not None:
            self.notify.close()
            self.notify = None


class CellScenario(Scenario):
    """Machines press-1, press-2 ... with one spinner each."""

    def setUp(self):
        super().setUp()
        self._etcds = []

    def run(self, result=None):
        before = len(result.failures) + len(result.errors) if result else 0
        super().run(result)
        for etcd in getattr(self, "_etcds", []):
            if result and len(result.failures) + len(result.errors) > before:
                print(f"##### logs of etcd{etcd.logs()}", file=sys.stderr)
            etcd.remove()
        return result

    def etcd(self, members=1):
        etcd = Etcd(members)
        self._etcds.append(etcd)
        self.addCleanup(etcd.kill)
        return etcd.start()

    def press(self, number, start=True):
        machine = self.machine({"spinner": spinner()}, name=f"press-{number}")
        return machine.start() if start else machine

    def entrance(self, machine, etcd=None, start=True, **arguments):
        entrance = Entrance(machine, etcd, **arguments)
        self.addCleanup(entrance.close)
        return entrance.start() if start else entrance

    def cell(self, count=3, members=1):
        """Machines and their entrances, until each knows all."""
        self.store = self.etcd(members)
        self.presses = [self.press(number + 1) for number in range(count)]
        self.entrances = [self.entrance(machine, self.store) for machine in self.presses]
        for entrance in self.entrances:
            self.wait_whole(entrance, count)
        return self.entrances

    def wait_whole(self, entrance, count):
        wait_for(lambda: [m.state for m in entrance.machines().values()] == [PRESENT] * count
                 and entrance.get().registry == OK, f"{entrance.machine.name} knows all {count}")


def seconds_until(condition, what, limit=LIMIT):
    begin = time.monotonic()
    wait_for(condition, what, limit)
    return time.monotonic() - begin


__all__ = ["AXISD_CELL", "CELL", "CallFailed", "CellScenario", "DEGRADED", "Entrance", "Etcd", "GONE", "HOST", "OK", "PRESENT",
           "SILENT", "UNREGISTERED", "cell_pb", "error_pb", "event_pb", "seconds_until"]
