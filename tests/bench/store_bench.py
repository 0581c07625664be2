"""What daemon/store would get from a database: SQLite (WAL, synchronous=FULL) beside lines that are appended and synced.

One line of the command journal is one row. Both are written from this program, to files in the same directory."""

import os
import random
import sqlite3
import sys
import tempfile
import time
import zlib
from pathlib import Path

COMMITS = 1000
GROUP = 16
IDS = 1_000_000
ROWS = 1000
FLIPS = 2000
SEED = 7
LINE = "sending id=5a1b2-{0} axis=feeder kind=move_relative granted=mm;10;50;0.2 start=0 target=1000 tolerance=0 mark=0005"


def database(path):
    opened = sqlite3.connect(path, isolation_level=None)
    opened.execute("PRAGMA journal_mode=WAL")
    opened.execute("PRAGMA synchronous=FULL")
    opened.execute("CREATE TABLE IF NOT EXISTS line (number INTEGER PRIMARY KEY, text TEXT NOT NULL)")
    return opened


def line_of(number):
    text = f"{number} {LINE.format(number)}"
    return f"{zlib.crc32(text.encode()):08x} {text}\n"


def seconds(work):
    began = time.perf_counter()
    work()
    return time.perf_counter() - began


def commit_rows(opened, group, turn):
    first = opened.execute("SELECT coalesce(max(number), 0) FROM line").fetchone()[0]
    for number in range(first + 1, first + turn * group + 1, group):
        opened.execute("BEGIN IMMEDIATE")
        for one in range(number, number + group):
            opened.execute("INSERT INTO line VALUES (?, ?)", (one, LINE.format(one)))
        opened.execute("COMMIT")


def append_lines(file, group, turn):
    for number in range(1, turn * group + 1, group):
        os.write(file, "".join(line_of(one) for one in range(number, number + group)).encode())
        os.fdatasync(file)


def compare_commits(directory):
    """The two take turns, as a disk is faster at one moment than at another."""
    opened = database(directory / "commits.db")
    file = os.open(directory / "commits.log", os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o600)
    turn = COMMITS // 10
    for group in (1, GROUP):
        taken = {"sqlite": [], "lines": []}
        for _ in range(10):
            taken["sqlite"].append(seconds(lambda: commit_rows(opened, group, turn)))
            taken["lines"].append(seconds(lambda: append_lines(file, group, turn)))
        sqlite_ms, lines_ms = (sorted(of)[len(of) // 2] / turn * 1000 for of in taken.values())
        print(f"durable, {group} at a time: sqlite {sqlite_ms:.2f} ms, lines {lines_ms:.2f} ms, "
              f"ratio {sqlite_ms / lines_ms:.2f}")
    os.close(file)
    opened.close()


def load_ids(directory):
    path = directory / "ids.db"
    opened = database(path)
    opened.execute("CREATE TABLE ids (hash BLOB PRIMARY KEY, command INTEGER NOT NULL) WITHOUT ROWID")
    chance = random.Random(SEED)
    opened.execute("BEGIN")
    opened.executemany("INSERT OR IGNORE INTO ids VALUES (?, ?)", ((chance.randbytes(12), n) for n in range(IDS)))
    opened.execute("COMMIT")
    opened.execute("PRAGMA wal_checkpoint(TRUNCATE)")
    opened.close()
    opened = database(path)
    read = seconds(lambda: opened.execute("SELECT hash, command FROM ids").fetchall())
    opened.close()
    print(f"{IDS} ids of 12 bytes: {path.stat().st_size / 2**20:.0f} MiB, read in {read:.2f} s")


def read_all(path):
    """Rows, or None where SQLite finds the file damaged."""
    try:
        opened = sqlite3.connect(path)
        try:
            if opened.execute("PRAGMA integrity_check").fetchone()[0] != "ok":
                return None
            return opened.execute("SELECT number, text FROM line ORDER BY number").fetchall()
        finally:
            opened.close()
    except (sqlite3.DatabaseError, UnicodeDecodeError):
        return None


def flip_bits(directory):
    path = directory / "flips.db"
    opened = database(path)
    opened.execute("BEGIN")
    opened.executemany("INSERT INTO line VALUES (?, ?)", ((n, LINE.format(n)) for n in range(1, ROWS + 1)))
    opened.execute("COMMIT")
    opened.execute("PRAGMA wal_checkpoint(TRUNCATE)")
    opened.execute("PRAGMA journal_mode=DELETE")
    opened.close()
    whole, rows = path.read_bytes(), read_all(path)
    text = "".join(line_of(n) for n in range(1, ROWS + 1)).encode()
    chance = random.Random(SEED)
    unseen = {"sqlite": 0, "lines": 0}
    for _ in range(FLIPS):
        at, bit = chance.random(), 1 << chance.randrange(8)
        damaged = bytearray(whole)
        damaged[int(at * len(whole))] ^= bit
        path.write_bytes(damaged)
        found = read_all(path)
        unseen["sqlite"] += found is not None and found != rows
        lines = bytearray(text)
        lines[int(at * len(text))] ^= bit
        unseen["lines"] += lines.endswith(b"\n") and all(
            f"{zlib.crc32(line[9:]):08x} ".encode() == line[:9] for line in lines.split(b"\n")[:-1]
        )
    print(f"{FLIPS} flips of one bit: read as if it were true: sqlite {unseen['sqlite']}, lines {unseen['lines']}")


def main():
    print(f"SQLite {sqlite3.sqlite_version}; the load of the computer is {os.getloadavg()[0]:.1f}")
    with tempfile.TemporaryDirectory(prefix="axisd-store-", dir=sys.argv[1] if len(sys.argv) > 1 else None) as name:
        for each in (compare_commits, load_ids, flip_bits):
            each(Path(name))


if __name__ == "__main__":
    main()
