"""Debian's etcd as deploy/cell sets it up, without axisd-cell: what it permits, and what it does when parts of it fail.
Times are etcd's own, by its time-outs; the limits leave a busy computer room."""
import pathlib
import shutil
import time
import unittest

from harness import ROOT, run
from rig import CellScenario, Registrant, Watch

TTL = 5  # s, of the registrants here
#: From the last renewal it has up to a third less than its TTL to live on; a new leader gives it all of it again.
SLACK = 6.0


class Rights(CellScenario):
    """By the name of a certificate, as roles.sh gives them."""

    def setUp(self):
        super().setUp()
        self.etcd = self.cell(machines=3, members=1).etcd.set_up()

    def may(self, name, *words):
        answer = self.etcd.ask(name, *words)
        self.assertEqual(answer.returncode, 0, f"{name} {words}: {answer.stderr}")
        return answer.stdout

    def may_not(self, name, *words, why="permission denied"):
        answer = self.etcd.ask(name, *words)
        self.assertNotEqual(answer.returncode, 0, f"{name} {words}: {answer.stdout}")
        self.assertIn(why, answer.stderr)

    def test_each_machine_writes_what_is_its_own(self):
        own, other = self.etcd.machine_key("press-1"), self.etcd.machine_key("press-2")
        self.may("cell.press-1", "put", own, "here")
        self.may("cell.press-1", "put", f"{own}/more", "here")
        self.may("cell.press-1", "put", "/axisd/demo/stop_all", "latched")
        self.may("cell.press-2", "put", "/axisd/demo/stop_all", "latched")
        self.assertIn("latched", self.may("cell.press-3", "get", "--prefix", "/axisd/demo/"))
        for key in (other, f"{own}0", "/axisd/demo/machines/", "/axisd/other/machines/press-1", "/axisd/demo/stop_all/x"):
            self.may_not("cell.press-1", "put", key, "mine")
        self.may_not("cell.press-2", "del", own)
        self.may_not("cell.press-1", "get", "--prefix", "/")
        self.may_not("cell.press-1", "user", "add", "more:word")
        self.may_not("cell.press-1", "snapshot", "save", "/dev/null")

    def test_a_lease_is_its_owners(self):
        registrant = Registrant(self.etcd, "press-1", 60)
        self.addCleanup(registrant.kill)
        self.may_not("cell.press-2", "lease", "revoke", registrant.lease)
        self.assertIn(self.etcd.machine_key("press-1"), self.etcd.keys())

    def test_others_get_nothing(self):
        """A person of the cell, a daemon's certificate, none, and one of another authority."""
        self.may_not("shift-a", "get", "--prefix", "/axisd/demo/")
        self.may_not("press-1", "get", "--prefix", "/axisd/demo/", why="context deadline exceeded")
        pki = self.etcd.cell.path("pki")
        address = f"https://{self.etcd.cell.address('press-1')}"
        desk = self.etcd.cell.path("desk", "in")
        none = run([desk, "env", "ETCDCTL_API=3", "etcdctl", "--endpoints", f"{address}:2379", "--cacert", f"{pki}/ca.crt",
                    "get", "x"])
        self.assertNotEqual(none.returncode, 0)
        # Who may call etcd is no member of it, not even with root's certificate.
        for name in ("root", "cell.press-1"):
            peer = run([desk, "openssl", "s_client", "-connect", f"{self.etcd.cell.address('press-1')}:2380", "-CAfile",
                        f"{pki}/members/ca.crt", "-cert", f"{pki}/{name}.crt", "-key", f"{pki}/{name}.key", "-ign_eof"])
            self.assertIn("alert", peer.stderr, peer.stdout)

    def test_a_machine_that_was_removed_or_revoked_writes_no_more(self):
        cell = self.etcd.cell
        self.may("cell.press-3", "put", self.etcd.machine_key("press-3"), "here")
        done = run([cell.path("desk", "shell.run"), str(cell.deploy / "roles.sh"), "--remove", cell.name, "press-3"])
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertNotIn(self.etcd.machine_key("press-3"), self.etcd.keys())
        self.may_not("cell.press-3", "put", self.etcd.machine_key("press-3"), "here", why="")

        pki = cell.path("pki")
        for name in ("crt", "key"):
            shutil.copy(f"{pki}/cell.press-2.{name}", f"{pki}/stolen.{name}")
        self.may("stolen", "get", self.etcd.machine_key("press-2"))
        done = run([str(ROOT / "deploy" / "pki.sh"), "--dir", pki, "revoke", "cell.press-2"])
        self.assertEqual(done.returncode, 0, done.stderr)
        shutil.copy(f"{pki}/clients.crl", cell.path("press-1", "etcd", "clients.crl"))
        self.may_not("stolen", "get", self.etcd.machine_key("press-2"), why="")


class Backup(CellScenario):
    def test_a_snapshot_brings_everything_back(self):
        cell = self.cell(machines=1, members=1)
        etcd = cell.etcd.set_up()
        etcd.done("cell.press-1", "put", "/axisd/demo/stop_all", "latched")
        backups = pathlib.Path(cell.path("backups"))
        for _ in range(2):
            done = run([cell.path("desk", "shell.run"), str(cell.deploy / "backup.sh"), "--keep", "1", str(backups)])
            self.assertEqual(done.returncode, 0, done.stderr)
            time.sleep(1.1)  # their names are times
        (snapshot,) = backups.iterdir()

        cell.kill("press-1")
        data = pathlib.Path(cell.path("press-1", "etcd", "disk", "data"))
        shutil.rmtree(data)
        done = run(["env", "ETCDCTL_API=3", "etcdctl", "snapshot", "restore", str(snapshot), "--data-dir", str(data), "--name",
                    "press-1", "--initial-cluster", f"press-1=https://{cell.address('press-1')}:2380",
                    "--initial-advertise-peer-urls", f"https://{cell.address('press-1')}:2380",
                    "--initial-cluster-token", "axisd-demo"])
        self.assertEqual(done.returncode, 0, done.stderr)
        cell.start_etcd("press-1")
        self.eventually(lambda: etcd.healthy("press-1"), "etcd is back")
        self.assertEqual(etcd.keys(), {"/axisd/demo/stop_all": "latched"})
        answer = etcd.ask("cell.press-1", "put", "/axisd/demo/machines/press-2", "mine")
        self.assertIn("permission denied", answer.stderr)

    def test_no_member_no_snapshot(self):
        cell = self.cell(machines=1, members=1)
        done = run([cell.path("desk", "shell.run"), str(cell.deploy / "backup.sh"), cell.path("backups")])
        self.assertEqual((done.returncode, list(pathlib.Path(cell.path("backups")).iterdir())), (1, []), done.stdout)
        self.assertIn("no member gave a snapshot", done.stderr)


class Failures(CellScenario):
    """Of three members. The keys of three registrants: what is true of them here is what axisd-cell has to live with."""

    def ready(self, ttl=TTL, **arguments):
        cell = self.cell(**arguments)
        etcd = cell.etcd.set_up()
        registrants = {}
        for name in cell.machines:
            registrants[name] = Registrant(etcd, name, ttl)
            self.addCleanup(registrants[name].kill)
        watch = Watch(etcd)
        self.addCleanup(watch.close)
        self.assertEqual(len(etcd.keys()), 3)
        return cell, etcd, registrants, watch

    def deaths(self, watch):
        return [(kind, key) for _, kind, key in watch.changes if kind == "DELETE"]

    def writable(self, etcd, members, what, limit=60.0):
        """When a write went through at one of the members."""
        key = "/axisd/demo/stop_all"
        self.eventually(lambda: etcd.ask("cell.press-1", "put", key, "x", "--command-timeout", "1s",
                                         members=members).returncode == 0, what, limit)
        return time.monotonic()

    def tell(self, text, seconds):
        print(f"{self.id()}: {text}: {seconds:.2f} s", flush=True)

    def test_a_machine_dies(self):
        _, etcd, registrants, watch = self.ready()
        at = registrants["press-1"].kill()
        seen = watch.first("DELETE", etcd.machine_key("press-1"), at)
        self.tell(f"killed registrant of {TTL} s is missed", seen - at)
        self.assertLess(seen - at, TTL + SLACK)
        self.assertEqual(len(self.deaths(watch)), 1)

    def test_a_follower_and_then_the_leader_die(self):
        cell, etcd, _, watch = self.ready()
        leader = etcd.wait_leader()
        follower = next(name for name in cell.members if name != leader)
        cell.kill(follower, "etcd")
        at = time.monotonic()
        others = [name for name in cell.members if name != follower]
        self.tell("writes after a follower is gone", self.writable(etcd, others, "most are there") - at)
        cell.start_etcd(follower)
        self.eventually(lambda: etcd.healthy(follower), "the follower is back")
        cell.kill(leader, "etcd")
        at = time.monotonic()
        others = [name for name in cell.members if name != leader]
        self.tell("writes after the leader is gone", self.writable(etcd, others, "another leads") - at)
        cell.start_etcd(leader)
        self.eventually(lambda: etcd.healthy(leader), "the leader of before is back")
        self.assertEqual(set(etcd.keys(members=[leader])), set(etcd.keys(members=others)))
        self.assertEqual(self.deaths(watch), [])

    def test_machine_and_leader_die_together(self):
        cell, etcd, registrants, watch = self.ready()
        leader = etcd.wait_leader()
        watch.close()
        others = [name for name in cell.members if name != leader]
        watch = Watch(etcd, members=others)
        self.addCleanup(watch.close)
        registrants[leader].kill()
        cell.kill(leader)
        at = time.monotonic()
        seen = watch.first("DELETE", etcd.machine_key(leader), at)
        self.tell(f"killed with the leader, TTL {TTL} s, it is missed", seen - at)
        self.assertLess(seen - at, 2 * TTL + SLACK)
        self.assertEqual(self.deaths(watch), [("DELETE", etcd.machine_key(leader))])

    def test_a_leader_is_cut_off(self):
        cell, etcd, _, _ = self.ready(ttl=30)
        leader = etcd.wait_leader()
        others = [name for name in cell.members if name != leader]
        cell.cut(leader)
        at = time.monotonic()
        self.tell("writes after the leader is cut off", self.writable(etcd, others, "another leads") - at)
        # The one that is alone knows that it is, and does not say that it wrote.
        alone = run([cell.path(leader, "in"), *etcd.words("root", "put", "/axisd/demo/stop_all", "alone", "--command-timeout", "2s",
                                                          members=[leader])[1:]])
        self.assertNotEqual(alone.returncode, 0, alone.stdout)
        cell.heal(leader)
        self.eventually(lambda: etcd.healthy(leader), "it is back")
        self.assertEqual(etcd.keys(members=[leader])["/axisd/demo/stop_all"], "x")

    def test_no_quorum_no_writes_and_back(self):
        cell, etcd, _, _ = self.ready(ttl=30)
        cell.cut("press-2", "press-3")
        self.eventually(lambda: not etcd.healthy("press-1"), "one of three is not enough")
        cell.heal("press-2", "press-3")
        at = time.monotonic()
        self.tell("writes after healing", self.writable(etcd, ["press-1"], "all are back") - at)
        for member in cell.members:
            self.eventually(lambda m=member: etcd.healthy(m), f"{member} is back")

    def test_the_leaders_disk_hangs(self):
        """For longer than the leases are, which are renewed all the time. etcd 3.4.23 takes them back all the same: that of a
        client which talks to the hung leader meanwhile, the others after the thaw. A machine is not dead because of that.
        Afterwards etcd works as before."""
        cell, etcd, _, watch = self.ready(disks=True)
        leader = etcd.wait_leader()
        others = [name for name in cell.members if name != leader]
        watch.close()
        watch = Watch(etcd, members=others)
        self.addCleanup(watch.close)
        frozen = time.monotonic()
        how = cell.freeze(leader)
        # It is noticed by the first write only: a leader without anything to write goes on leading.
        self.tell("writes after the freeze", self.writable(etcd, others, "another leads") - frozen)
        self.assertIn(etcd.statuses()[others[0]]["leader"],
                      [etcd.statuses()[name]["header"]["member_id"] for name in others])
        time.sleep(max(0.0, frozen + 20 - time.monotonic()))
        print(f"{self.id()}: leases that ended meanwhile: {len(self.deaths(watch))} of 3", flush=True)
        cell.thaw(leader)
        thawed = time.monotonic()
        self.tell(how, thawed - frozen)
        self.tell("writes after the thaw", self.writable(etcd, others, "writes after the thaw") - thawed)
        for member in cell.members:
            self.eventually(lambda m=member: etcd.healthy(m), f"{member} is back")
        print(f"{self.id()}: leases that have ended then: {len(self.deaths(watch))} of 3", flush=True)


if __name__ == "__main__":
    unittest.main()
