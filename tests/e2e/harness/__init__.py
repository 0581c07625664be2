"""What the end-to-end scenarios share: real programs on pseudo terminals, a client, and the wire as it was."""
from .can import (CanLog, Candump, CanSimulator, EndlessNode, LinkHelper, Peer, SlcanAdapter, heartbeat, ip,
                  sdo_reply, sdo_request)
from .can_case import CanScenario
from .case import Scenario
from .client import (ACCEPTED, DONE, ENDED, STARTED, CallFailed, Client, axis_pb, bus_pb, command_pb, error_pb,
                     group_pb, lease_pb, pb, system_pb)
from .demo import Demo
from .frozen import frozen
from .machine import Axis, Machine, feeder, spinner, turntable
from .programs import AXISCTL, AXISD, LIMIT, OWN_NAME, ROOT, Program, own_host, run, wait_for
from .supervisor import Supervisor, Unit
from .wire import BLOCK, ENABLE, HOMING, START, STOP, crc, frame_bytes

__all__ = ["ACCEPTED", "AXISCTL", "AXISD", "Axis", "BLOCK", "CallFailed", "CanLog", "CanScenario", "CanSimulator",
           "Candump", "Client", "DONE", "Demo", "ENABLE", "ENDED", "EndlessNode", "HOMING", "LIMIT", "LinkHelper", "Machine", "OWN_NAME",
           "Peer", "Program", "ROOT", "START", "STARTED", "STOP", "Scenario", "SlcanAdapter", "Supervisor", "Unit", "axis_pb", "bus_pb",
           "command_pb", "crc", "error_pb", "feeder", "frame_bytes", "group_pb", "heartbeat", "ip", "lease_pb", "own_host", "pb", "run",
           "sdo_reply", "sdo_request", "spinner", "system_pb", "turntable", "wait_for"]
