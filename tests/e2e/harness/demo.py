"""The machine of config/examples/demo.yaml, whose drives are simulated inside the daemon."""
import os
import pathlib
import re
import shutil
import tempfile

import grpc

from .client import CallFailed, Client, pb
from .machine import PATIENT
from .programs import AXISD, ROOT, Program, wait_for

EXAMPLE = ROOT / "config" / "examples" / "demo.yaml"


class Demo:
    """Runs from its construction to close(), which is a scenario's cleanup."""

    def __init__(self, metrics=False):
        self.directory = pathlib.Path(tempfile.mkdtemp(prefix="axdemo-"))
        self.server = f"unix:{self.directory}/axisd.sock"
        # A computer busy with tests is late; nothing else differs from the example.
        patience = "".join(f"\n    {key}: {text}" for key, text in PATIENT.items())
        text = re.sub(r"(?m)^    model: (?!yss-c).*$", lambda line: line[0] + patience, EXAMPLE.read_text())
        text = text.replace("turnaround_max: 20 ms", "turnaround_max: 200 ms")
        text = text.replace("sdo_timeout: 50 ms", "sdo_timeout: 500 ms")
        if metrics:
            text = text.replace("\nserver:\n", "\nserver:\n  metrics: { listen: 127.0.0.1:0 }\n")
        config = self.directory / "demo.yaml"
        config.write_text(text)
        self.daemon = Program("axisd", [AXISD, "--config", str(config), "--state-directory",
                                        str(self.directory / "state"), "--listen", self.server], self.directory)
        self.client = Client(self.server)
        wait_for(lambda: self._answers(), "all drives answer")

    def _answers(self):
        if not self.daemon.running():
            raise AssertionError(f"axisd ended: {self.daemon.log()}")
        if not os.path.exists(self.server.removeprefix("unix:")):
            return False
        try:
            return all(state.link != pb.LINK_STATE_OFFLINE for state in self.client.states())
        except CallFailed as failed:  # the socket has its name before anybody listens
            if failed.code != grpc.StatusCode.UNAVAILABLE:
                raise
            return False

    def models(self):
        """An axis of each model."""
        return {state.model: state.axis for state in self.client.states()}

    def close(self):
        self.client.close()
        self.daemon.terminate()
        self.daemon.check_memory()
        shutil.rmtree(self.directory)
