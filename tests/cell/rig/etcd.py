"""etcd as its own client sees it: etcdctl, with the certificate of whoever asks."""
import json
import os
import re
import signal
import subprocess
import threading
import time

from harness import LIMIT, run, wait_for


class Etcd:
    """The members of a cell. `cell` has the computers."""

    def __init__(self, cell):
        self.cell = cell

    def words(self, name, *words, members=None):
        """etcdctl as the certificate `name`, at some members or all; run at the desk."""
        endpoints = ",".join(f"https://{self.cell.address(member)}:2379" for member in members or self.cell.members)
        pki = self.cell.path("pki")
        return [self.cell.path("desk", "in"), "env", "ETCDCTL_API=3", "etcdctl", "--endpoints", endpoints,
                "--cacert", f"{pki}/ca.crt", "--cert", f"{pki}/{name}.crt", "--key", f"{pki}/{name}.key",
                "--dial-timeout", "2s", *words]

    def ask(self, name, *words, members=None):
        """The completed process."""
        return run(self.words(name, *words, members=members))

    def done(self, name, *words, members=None):
        """What etcdctl prints; anything but success is an error."""
        answer = self.ask(name, *words, members=members)
        if answer.returncode != 0:
            raise AssertionError(f"etcdctl {words}: {answer.stderr}")
        return answer.stdout

    def healthy(self, member):
        """It has a leader, and agrees with most."""
        return self.ask("root", "endpoint", "health", members=[member]).returncode == 0

    def statuses(self):
        """Of the members that answer, by name."""
        found = {}
        for member in self.cell.members:
            answer = self.ask("root", "endpoint", "status", "--write-out", "json", "--command-timeout", "1s",
                              members=[member])
            if answer.returncode == 0 and answer.stdout.strip():
                (status,) = json.loads(answer.stdout)
                found[member] = status["Status"]
        return found

    def leader(self):
        """The member that leads; None: nobody does."""
        for member, status in self.statuses().items():
            if status.get("leader") and status["leader"] == status["header"]["member_id"]:
                return member
        return None

    def wait_leader(self):
        return wait_for(self.leader, "a member leads")

    def keys(self, name="root", members=None):
        """Key to value, of the cell."""
        text = self.done(name, "get", "--prefix", f"/axisd/{self.cell.name}/", members=members)
        lines = text.splitlines()
        return dict(zip(lines[::2], lines[1::2], strict=True))

    def machine_key(self, machine):
        return f"/axisd/{self.cell.name}/machines/{machine}"

    def set_up(self):
        """All members run and agree; each machine has its rights."""
        for member in self.cell.members:
            self.cell.start_etcd(member)
        for member in self.cell.members:
            wait_for(lambda m=member: self.healthy(m), f"etcd at {member}")
        deploy = self.cell.deploy
        done = run([self.cell.path("desk", "shell.run"), str(deploy / "roles.sh"), self.cell.name, *self.cell.machines])
        if done.returncode != 0:
            raise AssertionError(done.stderr)
        return self


class Registrant:
    """Something that keeps one key alive under a lease, from the computer of its machine, and nothing else."""

    def __init__(self, etcd, machine, ttl):
        self.key = etcd.machine_key(machine)
        user = f"cell.{machine}"
        words = etcd.words(user, "lease", "grant", str(ttl))
        granted = run(words)
        self.lease = re.search(r"lease (\w+) granted", granted.stdout)[1]
        etcd.done(user, "put", "--lease", self.lease, self.key, "here")
        words = [etcd.cell.path(machine, "in"), *etcd.words(user, "lease", "keep-alive", self.lease)[1:]]
        self.process = subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)

    def kill(self):
        """Returns when it was."""
        self.process.kill()
        at = time.monotonic()
        self.process.wait(LIMIT)
        return at


class Watch:
    """Changes of the registry as they come, from the desk."""

    def __init__(self, etcd, members=None):
        self.changes = []  # (when, "PUT" or "DELETE", key)
        self.process = subprocess.Popen(etcd.words("root", "watch", "--prefix", f"/axisd/{etcd.cell.name}/machines/",
                                                   members=members),
                                        stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True,
                                        preexec_fn=os.setsid)
        self.reader = threading.Thread(target=self._read, daemon=True)
        self.reader.start()
        time.sleep(0.5)  # etcdctl does not tell when the watch stands; what comes before is in no change

    def _read(self):
        kind = None
        for line in self.process.stdout:
            at, line = time.monotonic(), line.strip()
            if line in ("PUT", "DELETE"):
                kind = line
            elif kind is not None and line.startswith("/axisd/"):
                self.changes.append((at, kind, line))
                kind = None

    def first(self, kind, key, after, limit=LIMIT):
        """When the first such change came."""
        def found():
            return [at for at, what, where in self.changes if (what, where) == (kind, key) and at >= after]
        return wait_for(found, f"{kind} of {key}", limit)[0]

    def close(self):
        if self.process.stdout.closed:
            return
        if self.process.poll() is None:
            os.killpg(self.process.pid, signal.SIGKILL)
        self.process.wait(LIMIT)
        self.reader.join(LIMIT)
        self.process.stdout.close()
