"""What the end-to-end scenarios share: real programs on pseudo terminals, a client, and the wire as it was."""
from .case import Scenario
from .client import (ACCEPTED, DONE, ENDED, STARTED, CallFailed, Client, axis_pb, bus_pb, command_pb, error_pb, pb,
                     system_pb)
from .machine import Axis, Machine, feeder, spinner
from .programs import AXISCTL, AXISD, LIMIT, ROOT, Program, run, wait_for
from .wire import BLOCK, ENABLE, HOMING, START, STOP, crc

__all__ = ["ACCEPTED", "AXISCTL", "AXISD", "Axis", "BLOCK", "CallFailed", "Client", "DONE", "ENABLE", "ENDED", "HOMING",
           "LIMIT", "Machine", "Program", "ROOT", "START", "STARTED", "STOP", "Scenario", "axis_pb", "bus_pb",
           "command_pb", "crc", "error_pb", "feeder", "pb", "run", "spinner", "system_pb", "wait_for"]
