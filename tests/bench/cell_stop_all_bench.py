"""StopAll of a cell of 3 to 100 machines of 32 axes, of which one has a real entrance. README.md says what is measured.

    cell_stop_all_bench.py BUILD [--machines N ...] [--axes N] [--rounds N] [--limit S]

Ends with 1 where a machine was called what it is not, or was not told in time, or another entrance's StopAll made this one
tell all machines once more.
"""
import argparse
import contextlib
import json
import os
import signal
import statistics
import subprocess
import sys
import tempfile
import time

from cell_load_bench import ENTRANCE, ETCD, ROOT, Client, entrance, etcd, generator, make_pki, make_stubs, tell
from figures import cpu_seconds, table

#: Within which a StopAll is answered; when a machine that is back is told, at most.
ANSWER_S, BACK_S = 1.0, 5.0


class Stopper(Client):
    def __init__(self, pki):
        super().__init__(pki)
        self.ask_stop = self.channel.unary_unary("/axisd.cell.v1.CellService/StopAll",
                                                 response_deserializer=self.pb.StopAllResponse.FromString)
        self.ask_release = self.channel.unary_unary("/axisd.cell.v1.CellService/ReleaseStopAll",
                                                    response_deserializer=self.pb.ReleaseStopAllResponse.FromString)

    def silent(self, answer):
        return {each.machine for each in answer.machines if each.outcome == self.pb.MACHINE_OUTCOME_SILENT}

    def done(self, answer):
        return {each.machine for each in answer.machines if each.outcome == self.pb.MACHINE_OUTCOME_DONE}


def received(load):
    """Machine to the times when it got StopAll."""
    tell(load, "received")
    return json.loads(load.stdout.readline())


class Round:
    """One StopAll, told to those that live in `load`; `names` are all machines."""

    def __init__(self, client, pid, load, names):
        received(load)
        cpu, load_cpu = cpu_seconds(pid), cpu_seconds(load.pid)
        begin = time.monotonic()
        self.answer = client.ask_stop(client.pb.StopAllRequest(reason="bench").SerializeToString(), timeout=10)
        self.took = time.monotonic() - begin
        self.cpu, self.load_cpu = cpu_seconds(pid) - cpu, cpu_seconds(load.pid) - load_cpu
        times = received(load)
        self.last = max((each[0] for each in times.values() if each), default=float("nan")) - begin
        told, living = client.done(self.answer), set(times)
        self.wrong = [f"{name} is not called done" for name in sorted(living - told)]
        self.wrong += [f"{name} was told {len(each)} times" for name, each in times.items() if len(each) != 1]
        self.wrong += [f"{name} is not called silent" for name in sorted(set(names) - living - client.silent(self.answer))]
        if self.took > ANSWER_S:
            self.wrong.append(f"answered after {self.took:.2f} s")


def in_ms(values):
    return f"{1000 * statistics.median(values):.0f} ({1000 * max(values):.0f})"


def row(names, what, rounds, rest):
    return [str(len(names)), what, str(len(rounds)), in_ms([each.last for each in rounds]), in_ms([each.took for each in rounds]),
            in_ms([each.cpu for each in rounds]), in_ms([each.load_cpu for each in rounds]), *rest]


def told_after(load, begin):
    """Seconds until each of its machines has got StopAll; the longest."""
    found, end = {}, time.monotonic() + BACK_S
    while time.monotonic() < end:
        machines = received(load)
        found |= {name: times[0] - begin for name, times in machines.items() if times}
        if len(found) == len(machines):
            return max(found.values())
        time.sleep(0.05)
    return float("nan")


class Cell:
    """The machines of one measurement: those that live, those that are frozen, and those that die."""

    def __init__(self, stack, build, directory, pki, stubs, count, axes):
        away = max(1, count // 10)
        self.away = away
        stack.enter_context(etcd(directory))
        self.words = (stubs, pki, ETCD)
        self.axes = axes
        self.stack = stack
        self.frozen_first, self.dead_first = count - 2 * away, count - away
        self.load, living = stack.enter_context(generator(*self.words, count - 2 * away, axes))
        self.frozen, frozen = stack.enter_context(generator(*self.words, away, axes, self.frozen_first))
        stack.callback(self.frozen.send_signal, signal.SIGCONT)
        self.dead, dead = self.start_dead()
        self.names = [each["name"] for each in (*living, *frozen, *dead)]
        self.pid = stack.enter_context(entrance(build, directory, pki, living[0], False))
        self.client = Stopper(pki)
        self.client.wait_for_all(count)
        time.sleep(2)  # until each stop lane is connected

    def start_dead(self):
        process = subprocess.Popen([sys.executable, "-B", f"{ROOT}/tests/bench/cell_load.py", *map(str, self.words),
                                    str(self.away), str(self.axes), str(self.dead_first)], stdin=subprocess.PIPE,
                                   stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        self.stack.callback(process.kill)
        return process, json.loads(process.stdout.readline())

    def release(self):
        begin = time.monotonic()
        answer = self.client.ask_release(b"", timeout=10)
        return time.monotonic() - begin, answer

    def all_alive(self, count):
        """StopAll and release, again and again; with the first one the entrances are connected."""
        rounds, releases, wrong = [], [], []
        every = [self.load, self.frozen, self.dead]
        for _ in range(count):
            for each in every[1:]:
                received(each)
            rounds.append(Round(self.client, self.pid, self.load, []))
            wrong += rounds[-1].wrong
            wrong += [f"{name} was told {len(times)} times" for each in every[1:] for name, times in received(each).items()
                      if len(times) != 1]
            releases.append(self.release()[0])
            time.sleep(1.2)  # each machine is asked once a second
        return rounds, releases, wrong

    def some_away(self):
        """Those that freeze and die do so right before it: nobody knows yet."""
        self.frozen.send_signal(signal.SIGSTOP)
        self.dead.kill()
        self.dead.wait()
        first = Round(self.client, self.pid, self.load, self.names)
        time.sleep(6)  # their connections are given up
        later = Round(self.client, self.pid, self.load, self.names)
        begin = time.monotonic()
        self.frozen.send_signal(signal.SIGCONT)
        thawed = told_after(self.frozen, begin)
        self.dead, machines = self.start_dead()
        back = told_after(self.dead, machines[0]["served_since"])
        wrong = first.wrong + later.wrong
        for what, after in (("frozen", thawed), ("dead", back)):
            if not after < BACK_S:
                wrong.append(f"those that were {what} were not told when they came back")
        self.client.wait_for_all(len(self.names))
        return first, later, thawed, back, wrong

    def hears_of_another(self):
        """Another entrance was asked, and has told all machines: how often does this one tell them?"""
        self.release()
        time.sleep(1.2)
        every = (self.load, self.frozen, self.dead)
        for each in every:
            received(each)
        cpu = cpu_seconds(self.pid)
        for each in every[1:]:
            tell(each, "hold")
        time.sleep(0.2)
        tell(self.load, f"latch {ENTRANCE} {' '.join(self.names)}")
        time.sleep(2.5)
        cpu = cpu_seconds(self.pid) - cpu
        return sum(len(times) for each in every for times in received(each).values()), cpu


def measure(build, directory, pki, stubs, given, count):
    with contextlib.ExitStack() as stack:
        cell = Cell(stack, build, directory, pki, stubs, count, given.axes)
        rounds, releases, wrong = cell.all_alive(given.rounds + 1)
        away = f"{cell.away} dead, {cell.away} frozen"
        rows = [row(cell.names, "all live, first", rounds[:1], [f"{1000 * releases[0]:.0f}", "-"]),
                row(cell.names, "all live", rounds[1:], [in_ms(releases[1:]), "-"])]
        first, later, thawed, back, more = cell.some_away()
        rows.append(row(cell.names, f"{away} just before", [first], ["-", "-"]))
        rows.append(row(cell.names, f"{away} for long", [later], ["-", f"{1000 * thawed:.0f}, {1000 * back:.0f}"]))
        told, cpu = cell.hears_of_another()
        print(f"{count} machines: after another entrance's StopAll this one told {told}, and took {1000 * cpu:.0f} ms of CPU time "
              "in 2.5 s", flush=True)
        wrong += more
        if told > 1:
            wrong.append(f"{told} machines were told once more")
        cell.client.channel.close()
        return rows, [f"{count} machines: {each}" for each in wrong]


def out_of_time(*_):
    sys.exit("cell_stop_all_bench.py: it took longer than --limit")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("build")
    parser.add_argument("--machines", type=int, nargs="+", default=[3, 50, 100])
    parser.add_argument("--axes", type=int, default=32, help="of each machine")
    parser.add_argument("--rounds", type=int, default=10, help="of StopAll and release where all live")
    parser.add_argument("--limit", type=int, default=240, help="seconds that all of it may take")
    given = parser.parse_args()
    signal.signal(signal.SIGALRM, out_of_time)
    signal.alarm(given.limit)
    rows = [["machines", "of them", "StopAlls", "last machine got it, ms (longest)", "answered, ms", "CPU of the entrance, ms",
             "CPU of the generator, ms", "release, ms", "thawed, started anew: told after, ms"]]
    wrong = []
    with tempfile.TemporaryDirectory() as directory:
        for name in ("stubs", "pki"):
            os.mkdir(f"{directory}/{name}")
        stubs, pki = make_stubs(f"{directory}/stubs"), make_pki(f"{directory}/pki")
        sys.path.insert(0, stubs)
        try:
            for count in given.machines:
                found, more = measure(os.path.abspath(given.build), directory, pki, stubs, given, count)
                rows += found
                wrong += more
        finally:
            print(f"load {os.getloadavg()[0]:.1f}")
            table(rows)
    for each in wrong:
        print(f"beyond: {each}")
    sys.exit(1 if wrong else 0)


if __name__ == "__main__":
    main()
