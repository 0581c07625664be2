"""The other end of the systemd protocol (sd_notify)."""
import os
import socket
import threading
import time

from .programs import wait_for


class NotifySocket:
    """Collects the messages of a service, at once: a full socket would hold the service up."""

    def __init__(self, directory):
        self.path = os.path.join(directory, "notify")
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self._socket.bind(self.path)
        self._received = []
        self._listeners = []
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self):
        while True:
            message = self._socket.recv(4096)
            if not message:
                return
            at = time.monotonic_ns()
            for line in message.decode().splitlines():
                self._received.append(line)
                for listener in self._listeners if line != "MARK" else ():
                    listener(at, line)

    def listen(self, listener):
        """Also tells it of each message as it comes: when (CLOCK_MONOTONIC, ns), and what. Thread: the reader's."""
        self._listeners.append(listener)

    def received(self):
        """All messages so far."""
        return list(self._received)

    def forget(self):
        """All that was sent up to now, also what has not been read yet."""
        self._read_up_to_now()
        self._received.clear()

    def _read_up_to_now(self):
        with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as mark:
            mark.sendto(b"MARK", self.path)
        wait_for(lambda: "MARK" in self._received, "the messages up to now")
        self._received.remove("MARK")

    def wait_for(self, message, while_running):
        """Until the message has come; an error once the program has ended without it."""
        def seen():
            alive = while_running.running()
            if not alive:
                self._read_up_to_now()
            if message in self.received():
                return True
            if not alive:
                raise AssertionError(f"{while_running.name} ended before {message}:\n{while_running.log()}")
            return False
        wait_for(seen, f"{message} of {while_running.name}")

    def close(self):
        with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as end:
            end.sendto(b"", self.path)
        self._reader.join()
        self._socket.close()
