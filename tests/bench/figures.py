"""What the benchmarks have in common: running programs, their CPU time, tables."""
import collections
import contextlib
import os
import pathlib
import statistics
import subprocess
import sys


@contextlib.contextmanager
def running(*command, **options):
    """A process that must live until the end of the context."""
    name = pathlib.Path(sys.argv[0]).name
    options = {"stdin": subprocess.DEVNULL, "stderr": subprocess.DEVNULL} | options
    with subprocess.Popen(command, **options) as process:
        try:
            yield process
            if process.poll() is not None:
                sys.exit(f"{name}: {command[0]} ended with {process.returncode}")
        finally:
            process.terminate()


def go_first():
    """This process and all that it starts go before ordinary programs, as bare threads do: whatever else a computer is busy
    with is then held back, and not what is measured."""
    with contextlib.suppress(PermissionError):
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(1))


def cpu_seconds(pid, thread=None):
    """CPU time of all its threads, or of those of one name, as the scheduler counts it: exact, not by ticks."""
    tasks = [task for task in pathlib.Path(f"/proc/{pid}/task").iterdir()
             if thread is None or (task / "comm").read_text(encoding="ascii").strip() == thread]
    return sum(int((task / "schedstat").read_text(encoding="ascii").split()[0]) for task in tasks) / 1e9


def cpu_seconds_by_ticks(pid):
    """The same, of threads that have ended, too; by the kernel's ticks."""
    words = pathlib.Path(f"/proc/{pid}/stat").read_text(encoding="ascii").rpartition(")")[2].split()
    return (int(words[11]) + int(words[12])) / os.sysconf("SC_CLK_TCK")


def by_thread(pid):
    """Name of a thread, or of several -> CPU time, and how often it has gone to sleep, and so was woken."""
    found = collections.defaultdict(lambda: (0.0, 0))
    for task in pathlib.Path(f"/proc/{pid}/task").iterdir():
        ran = int((task / "schedstat").read_text(encoding="ascii").split()[0]) / 1e9
        name, _, status = (task / "status").read_text(encoding="utf-8").partition("\n")
        slept = int(status.partition("\nvoluntary_ctxt_switches:")[2].split(maxsplit=1)[0])
        name = name.removeprefix("Name:").strip()
        found[name] = (found[name][0] + ran, found[name][1] + slept)
    return found


def spread(values, digits=0):
    """Minimum, median and maximum of the rounds."""
    return " / ".join(f"{value:.{digits}f}" for value in (min(values), statistics.median(values), max(values)))


def lateness(stamps, period):
    """How late each is, sorted. What is sent at absolute times is on a grid of the period: on the one that most are
    closest behind. That none is sent early moves it to the earliest of them."""
    early = period / 10

    def behind(begin):
        return [(stamp - begin + early) % period - early for stamp in stamps]
    late = min((behind(stamp) for stamp in stamps[:200]), key=sum)
    return sorted(each - min(late) for each in late)


def percentile(values, share):
    ordered = sorted(values)
    return ordered[min(len(ordered) - 1, int(len(ordered) * share))]


def table(rows):
    print(table_text(rows))


def table_text(rows):
    widths = [max(map(len, column)) for column in zip(*rows)]
    return "\n".join("  ".join(cell.ljust(width) for cell, width in zip(row, widths)).rstrip() for row in rows)
