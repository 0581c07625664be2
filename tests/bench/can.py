"""SYNC every 10 ms on a real CAN interface: the daemon with 16 axes, and after it a loop that sends SYNC to the same
nodes, which answer it in the same way, and does nothing else. Runs in the guest (tests/bench/run.sh can)."""

import json
import os
import subprocess
import sys
import tempfile
import time

NODES = 16
PERIOD_MS = 10
SECONDS = 20
INTERFACE = "vcan0"
SERVER = "127.0.0.1:7443"


def configuration(state):
    text = f"""machine: bench
state_directory: {state}
server: {{ listen: {SERVER} }}
buses:
  can0:
    canopen: {{ interface: {INTERFACE}, bitrate: 1000000, sync_period: {PERIOD_MS}ms }}
axes:
"""
    for node in range(1, NODES + 1):
        text += f"""  axis-{node}: {{ bus: can0, node: {node}, model: yss-c, unit: mm,
    scale: {{ microstep: 1000 pulses/rev, travel: 10 mm/rev }},
    limits: {{ position: [0, 400], velocity: 100 mm/s }} }}
"""
    return text


def cpu_seconds(pid):
    with open(f"/proc/{pid}/stat", encoding="ascii") as stat:
        fields = stat.read().rsplit(")", 1)[1].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def axisctl(build, *words):
    command = [f"{build}/api/axisctl/axisctl", "--server", SERVER, "--json", *words]
    return json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)


def network(build):
    return axisctl(build, "bus", "list")["buses"][0]["network"]


def wait_online(build):
    end = time.monotonic() + 60
    while time.monotonic() < end:
        try:
            axes = axisctl(build, "list")["axes"]
        except (subprocess.CalledProcessError, KeyError):
            axes = []
        if len(axes) == NODES and all(axis.get("link") == "LINK_STATE_ONLINE" for axis in axes):
            return
        time.sleep(0.2)
    sys.exit("not every axis came online")


def measure_daemon(build, directory):
    path = os.path.join(directory, "bench.yaml")
    with open(path, "w", encoding="utf-8") as file:
        file.write(configuration(os.path.join(directory, "state")))
    with subprocess.Popen([f"{build}/daemon/axisd", "--config", path], stderr=subprocess.DEVNULL) as daemon:
        try:
            wait_online(build)
            before, cpu_before = network(build), cpu_seconds(daemon.pid)
            time.sleep(SECONDS)
            after, cpu_after = network(build), cpu_seconds(daemon.pid)
        finally:
            daemon.terminate()
    def grown(key):
        return int(after.get(key, 0)) - int(before.get(key, 0))
    frames = grown("framesReceived") + grown("framesSent")
    return {"sent": grown("syncSent"), "missed": grown("syncMissed"),
            "latest_us": round(float(after.get("syncLatest", "0s").rstrip("s")) * 1e6), "frames": frames,
            "cpu_us_per_frame": round((cpu_after - cpu_before) * 1e6 / max(frames, 1), 2)}


def measure_loop(build):
    command = [f"{build}/tests/bench_can", "bare-loop", INTERFACE, str(PERIOD_MS), str(SECONDS)]
    return json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)


def main():
    build = os.path.abspath(sys.argv[1])
    drives = [word for node in range(1, NODES + 1) for word in ("--drive", f"node={node},model=yss-c")]
    with tempfile.TemporaryDirectory() as directory, \
            subprocess.Popen([f"{build}/daemon/axisd-sim", "--can", INTERFACE, *drives],
                             stdout=subprocess.PIPE, text=True) as simulator:
        try:
            if not simulator.stdout.readline().startswith("ready"):
                sys.exit("axisd-sim did not start")
            daemon = measure_daemon(build, directory)
            loop = measure_loop(build)
        finally:
            simulator.terminate()
    for name, figures in (("axisd", daemon), ("bare loop", loop)):
        print(f"SYNC {PERIOD_MS} ms, {NODES} nodes, {name}: sent {figures['sent']}, missed {figures['missed']}, "
              f"latest {figures['latest_us']} us, {figures['frames']} frames, "
              f"{figures['cpu_us_per_frame']} us CPU per frame")
    print(f"ratio of CPU per frame: {daemon['cpu_us_per_frame'] / loop['cpu_us_per_frame']:.2f}")


if __name__ == "__main__":
    main()
