"""What went over an RS-485 line while axes indexed, by what it was for; and the wire of one move, frame by frame."""
import collections
import dataclasses
import statistics

from figures import table
from rtu_cell import silence

#: What requests begin with behind the node's address; manual of the YKD2405PR, 6.1. A reading of the state may be longer
#: than its ten registers.
KINDS = {"030003": "state", "0300200006": "canary", "1000200006": "block", "060027": "trigger", "1000200008": "one"}
BLOCK = slice(14, 30)  # registers 0x0020..0x0023 in a request of function 0x10
STARTS = ("trigger", "one")


@dataclasses.dataclass
class Request:
    at: float  # its first byte, s
    node: int
    kind: str
    frame: str
    ideal: float  # from its first byte until the next request may begin, s; of one without a reply unto its own end


def kind_of(frame):
    return next((kind for begin, kind in KINDS.items() if frame.startswith(begin, 2)), "other")


def requests_of(line, frames):
    """`frames` as Line.frames() has them."""
    found = []
    for (at, asked, frame), following in zip(frames, frames[1:] + [(0, True, "")]):
        if not asked:
            continue
        ideal = line.wire(len(frame) // 2)
        if not following[1]:
            ideal += line.turnaround + line.wire(len(following[2]) // 2) + silence(line.baud)
        found.append(Request(at, int(frame[:2], 16), kind_of(frame), frame, ideal))
    return found


def figures_of(requests, seconds, count):
    """Of the drives 1 to `count`, which index: moves per second, transactions of each move by kind, of the line's time the
    share that the bytes and their silences take."""
    kinds = collections.Counter(request.kind if request.node <= count else "resting" for request in requests)
    moves = sum(kinds[kind] for kind in STARTS)
    shares = collections.Counter(request.node for request in requests if request.kind in STARTS and request.node <= count)
    found = {"rate": moves / seconds, "moves": moves, "used": sum(request.ideal for request in requests) / seconds * 100,
             "share": min(shares[node] for node in range(1, count + 1)) / max(moves, 1) * count}
    for kind in (*KINDS.values(), "other", "resting"):
        found[kind] = kinds[kind] / max(moves, 1)
    return found


def profile_of(requests):
    """What axisd wrote for its moves, without their targets: start speed, times of both ramps, speed. None: nothing."""
    block = next((request.frame[BLOCK] for request in requests if request.kind == "block"), None)
    return block and tuple(int(block[at:at + 4], 16) for at in range(0, len(block), 4))


def print_gaps(name, requests):
    """Where the line lay idle."""
    gaps = collections.defaultdict(list)
    for before, request in zip(requests, requests[1:]):
        gaps[before.kind, request.kind, before.node == request.node].append(request.at - before.at - before.ideal)
    moves = sum(request.kind in STARTS for request in requests)
    rows = [[before, after, "same" if same else "another", f"{len(found) / moves:.2f}",
             f"{statistics.median(found) * 1e3:.2f}", f"{sum(found) / moves * 1e3:.2f}"]
            for (before, after, same), found in sorted(gaps.items(), key=lambda entry: -sum(entry[1]))]
    print(f"\n{name}: idle line between two requests, ms")
    table([["after", "before", "drive", "times a move", "median", "sum a move"], *rows])


def print_move(name, requests, node):
    """From one start of the drive to its next one, in the middle of `requests`."""
    starts = [index for index, request in enumerate(requests) if request.kind in STARTS and request.node == node]
    if len(starts) < 3:
        return
    print_gaps(name, requests)
    first, last = starts[len(starts) // 2 - 1], starts[len(starts) // 2]
    print(f"\n{name}: the wire from one start of drive {node} to its next; since that start, and how long the line lay idle "
          "before, ms")
    for before, request in zip(requests[first - 1:last], requests[first:last + 1]):
        idle = request.at - before.at - before.ideal
        print(f"  {(request.at - requests[first].at) * 1e3:8.2f} {idle * 1e3:7.2f}  drive {request.node:2}  {request.kind}")
