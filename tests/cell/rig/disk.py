"""A disk of its own below a folder, which can be frozen as one that hangs."""
import os
import pathlib
import subprocess


def _run(*words):
    done = subprocess.run(words, capture_output=True, text=True, check=False, timeout=60)
    if done.returncode != 0:
        raise OSError(f"{' '.join(words)}: {done.stderr.strip()}")


class Disk:
    """An ext4 in a file, mounted at `folder`."""

    @staticmethod
    def usable():
        """Whether there are loop devices, and whoever runs this may use them; in a user namespace nobody may."""
        return os.access("/dev/loop-control", os.W_OK) and pathlib.Path("/proc/self/uid_map").read_text().split()[2] != "1"

    def __init__(self, folder, megabytes=256):
        self.folder, self.frozen, self.mounted = pathlib.Path(folder), False, False
        image = self.folder.with_name(self.folder.name + ".image")
        with open(image, "wb") as file:
            file.truncate(megabytes << 20)
        _run("mkfs.ext4", "-q", "-E", "lazy_itable_init=0,lazy_journal_init=0", str(image))
        _run("mount", "-o", "loop", str(image), str(self.folder))
        self.mounted = True

    def freeze(self):
        """From now on every write hangs, and so does whoever waits for it; until thaw()."""
        self.frozen = True
        _run("fsfreeze", "--freeze", str(self.folder))

    def thaw(self):
        if self.frozen:
            _run("fsfreeze", "--unfreeze", str(self.folder))
            self.frozen = False

    def close(self):
        """After whatever has files there has ended."""
        self.thaw()
        if self.mounted:
            _run("umount", str(self.folder))
            self.mounted = False
