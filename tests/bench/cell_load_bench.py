"""A cell of 1 to 100 machines of 32 axes, of which one has a real entrance: what that one takes. README.md says what is
measured.

    cell_load_bench.py BUILD [--machines N ...] [--axes N] [--seconds S] [--limit S]
"""
import argparse
import contextlib
import json
import os
import pathlib
import re
import shutil
import signal
import statistics
import subprocess
import sys
import tempfile
import time

import grpc

from figures import cpu_seconds, percentile, running, table

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tests" / "e2e"))
from certificates import Certificates  # noqa: E402

ENTRANCE, ETCD, ETCD_PEERS, METRICS = "127.0.0.1:7447", "127.0.0.1:7448", "http://127.0.0.1:7449", "127.0.0.1:7450"
LISTINGS = 200


def make_stubs(directory):
    """Messages of the contract, of the registry and of etcd, for Python."""
    protos = [str(path.relative_to(ROOT / "proto")) for path in (ROOT / "proto" / "axisd").glob("**/*.proto")]
    subprocess.run(["protoc", f"-I{ROOT / 'proto'}", f"-I{ROOT}", f"--python_out={directory}", *protos,
                    "api/cell/kept.proto", "api/cell/etcd/etcd.proto"], check=True)
    return directory


def make_pki(directory):
    authority = Certificates(directory, "ca")
    for name in ("load", "cell.load"):  # the client, and the entrances
        authority.issue(name)
    return directory


@contextlib.contextmanager
def etcd(directory):
    """One member, whose disk is not waited for."""
    data = f"{directory}/etcd"
    with running("/usr/bin/etcd", "--name", "load", "--data-dir", data, "--listen-client-urls", f"http://{ETCD}",
                 "--advertise-client-urls", f"http://{ETCD}", "--listen-peer-urls", ETCD_PEERS,
                 "--initial-advertise-peer-urls", ETCD_PEERS, "--initial-cluster", f"load={ETCD_PEERS}", "--unsafe-no-fsync",
                 "--log-level", "error", stdout=subprocess.DEVNULL) as process:
        grpc.channel_ready_future(grpc.insecure_channel(ETCD)).result(20)
        yield process.pid
    shutil.rmtree(data, ignore_errors=True)


@contextlib.contextmanager
def entrance(build, directory, pki, own, metrics):
    path, state = pathlib.Path(directory) / "cell.yaml", f"{directory}/state"
    shutil.rmtree(state, ignore_errors=True)
    files = f"ca: {pki}/ca.crt, certificate: {pki}/cell.load.crt, key: {pki}/cell.load.key"
    path.write_text(f"""cell: load
machine: {own['name']}
listen: {ENTRANCE}
advertise: {ENTRANCE}
tls: {{ certificate: {pki}/cell.load.crt, key: {pki}/cell.load.key, client_ca: {pki}/ca.crt }}
roles: {{ load: maintainer }}
axisd: {{ server: {own['axisd']}, stop_server: {own['stop']}, advertise: {own['axisd']}, tls: {{ {files} }} }}
etcd: {{ endpoints: [ {ETCD} ], ttl: 15 s }}
state: {state}
{f"metrics: {{ listen: {METRICS} }}" if metrics else ""}
""", encoding="utf-8")
    with running(f"{build}/api/cell/axisd-cell", "--config", path) as process:
        yield process.pid


@contextlib.contextmanager
def generator(*words):
    """cell_load.py, and the addresses of its machines."""
    with running(sys.executable, "-B", f"{ROOT}/tests/bench/cell_load.py", *map(str, words), stdin=subprocess.PIPE,
                 stdout=subprocess.PIPE, text=True) as process:
        yield process, json.loads(process.stdout.readline())


class Client:
    """Of the entrance, by mutual TLS."""

    def __init__(self, pki):
        from axisd.cell.v1 import cell_service_pb2
        self.pb = cell_service_pb2
        ca, key, certificate = ((pathlib.Path(pki) / name).read_bytes() for name in ("ca.crt", "load.key", "load.crt"))
        self.channel = grpc.secure_channel(ENTRANCE, grpc.ssl_channel_credentials(ca, key, certificate),
                                           [("grpc.initial_reconnect_backoff_ms", 50), ("grpc.max_reconnect_backoff_ms", 50)])
        self.list_machines = self.channel.unary_unary("/axisd.cell.v1.CellService/ListMachines")
        self.watch_machines = self.channel.unary_stream("/axisd.cell.v1.CellService/WatchMachines",
                                                        response_deserializer=self.pb.WatchMachinesResponse.FromString)

    def listing(self):
        return self.list_machines(b"", timeout=10, wait_for_ready=True)

    def wait_for_all(self, count):
        """Seconds until all are present."""
        begin, present = time.monotonic(), self.pb.MACHINE_STATE_PRESENT
        while True:
            machines = self.pb.ListMachinesResponse.FromString(self.listing()).machines
            if [each.state for each in machines] == [present] * count and all(each.axes for each in machines):
                return time.monotonic() - begin
            time.sleep(0.02)

    def change(self, load):
        """Seconds from the word that a machine is to register anew to when this client sees it."""
        stream = self.watch_machines(b"", timeout=20)
        next(stream)
        begin = time.monotonic()
        tell(load, "change")
        for message in stream:
            if any(machine.configuration_revision not in ("", "r1") for machine in message.machines):
                stream.cancel()
                return time.monotonic() - begin
        return float("nan")


def tell(load, line):
    load.stdin.write(f"{line}\n")
    load.stdin.flush()


def traffic(pid):
    """Bytes sent and received on the connections that a process has, by whether they are etcd's; and how many it has."""
    words = subprocess.run(["ss", "-tinpHO", "state", "established"], capture_output=True, text=True, check=True).stdout
    total, connections = {True: 0, False: 0}, 0
    for line in words.splitlines():
        if f"pid={pid}," not in line:
            continue
        connections += 1
        of_etcd = line.split()[3].endswith(ETCD.rpartition(":")[2])
        total[of_etcd] += sum(map(int, re.findall(r"bytes_(?:sent|received):(\d+)", line)))
    return total, connections


def resident_kib(pid):
    return int(re.search(r"VmRSS:\s+(\d+)", pathlib.Path(f"/proc/{pid}/status").read_text(encoding="ascii"))[1])


def measure(build, directory, pki, stubs, given, count, metrics):
    with contextlib.ExitStack() as stack:
        stack.enter_context(etcd(directory))
        load, machines = stack.enter_context(generator(stubs, pki, ETCD, count, given.axes))
        pid = stack.enter_context(entrance(build, directory, pki, machines[0], metrics))
        client = Client(pki)
        there = client.wait_for_all(count)
        if metrics:
            tell(load, f"ask {ENTRANCE}")
        listing, size = [], 0
        for _ in range(LISTINGS):
            begin = time.monotonic()
            size = len(client.listing())
            listing.append(1000 * (time.monotonic() - begin))
        # The only one is that of the entrance itself, which registers it.
        changed = f"{1000 * client.change(load):.0f}" if count > 1 else "-"
        time.sleep(5)  # until every machine has its connections, and what the listings took is over
        before, begin = (traffic(pid)[0], cpu_seconds(pid), cpu_seconds(load.pid)), time.monotonic()
        time.sleep(given.seconds)
        cpu, load_cpu, took = cpu_seconds(pid) - before[1], cpu_seconds(load.pid) - before[2], time.monotonic() - begin
        after, connections = traffic(pid)
        client.channel.close()
        return [str(count), "on" if metrics else "off", f"{there:.2f}", f"{statistics.median(listing):.2f} / {percentile(listing, 0.99):.2f}",
                f"{size / 1024:.1f}", changed, f"{resident_kib(pid) / 1024:.1f}", f"{100 * cpu / took:.1f}",
                str(connections), f"{(after[False] - before[0][False]) / took / 1024:.1f}",
                f"{(after[True] - before[0][True]) / took / 1024:.2f}", f"{100 * load_cpu / took:.0f}"]


def out_of_time(*_):
    sys.exit("cell_load_bench.py: it took longer than --limit")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("build")
    parser.add_argument("--machines", type=int, nargs="+", default=[1, 50, 100])
    parser.add_argument("--axes", type=int, default=32, help="of each machine")
    parser.add_argument("--seconds", type=int, default=5, help="of each measurement")
    parser.add_argument("--limit", type=int, default=60, help="seconds that all of it may take")
    given = parser.parse_args()
    signal.signal(signal.SIGALRM, out_of_time)
    signal.alarm(given.limit)
    rows = [["machines", "metrics", "all present after, s", "listing p50 / p99, ms", "listing, KiB", "change seen, ms", "memory, MiB",
             "CPU, %", "connections", "with machines, KiB/s", "with etcd, KiB/s", "CPU of the generator, %"]]
    with tempfile.TemporaryDirectory() as directory:
        for name in ("stubs", "pki"):
            os.mkdir(f"{directory}/{name}")
        stubs, pki = make_stubs(f"{directory}/stubs"), make_pki(f"{directory}/pki")
        sys.path.insert(0, stubs)
        try:
            for count, metrics in [*((count, False) for count in given.machines), (given.machines[-1], True)]:
                rows.append(measure(os.path.abspath(given.build), directory, pki, stubs, given, count, metrics))
        finally:
            table(rows)


if __name__ == "__main__":
    main()
