"""The other end of the systemd protocol (sd_notify)."""
import os
import select
import socket

from .programs import wait_for


class NotifySocket:
    """Collects the messages of a service."""

    def __init__(self, directory):
        self.path = os.path.join(directory, "notify")
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self._socket.bind(self.path)
        self._received = []

    def received(self):
        """All messages so far."""
        while select.select([self._socket], [], [], 0)[0]:
            self._received += self._socket.recv(4096).decode().splitlines()
        return self._received

    def forget(self):
        self.received()
        self._received = []

    def wait_for(self, message, while_running):
        """Until the message has come; an error once the program has ended without it."""
        def seen():
            alive = while_running.running()
            if message in self.received():
                return True
            if not alive:
                raise AssertionError(f"{while_running.name} ended before {message}:\n{while_running.log()}")
            return False
        wait_for(seen, f"{message} of {while_running.name}")

    def close(self):
        self._socket.close()
