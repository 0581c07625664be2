"""Client of axisd: the axes of a machine from asyncio.

    async with axisd.connect("localhost:7443") as machine:
        feeder = machine.axis("feeder")
        await feeder.enable()
        await feeder.home()
        await feeder.move(120, velocity=50)

    async with axisd.connect_cell("press-1:7445") as cell:
        await cell.axis("press-2/feeder").move(120)
"""
from .audit import AuditRecord
from .axis import Axis, Jog
from .budget import AxisBudget, BusBudget, StopBudget
from .cell_group import CellMove, MachineMove
from .cell_lease import CellLease
from .cell_types import (CellEvent, CellInfo, CellMachine, CellReleased, CellStopped, MachineOutcome, MachineRelease, MachineState,
                         MachineStop, Registry, StopAllLatch)
from .cells import Cell, MemberMachine, connect_cell
from .configuration import ConfigChange, ConfigCheck, ConfigFinding, Configuration, Reload
from .drive import Drive
from .drives import (Alarm, AxisFault, CertificateNotice, CommandChange, ConfigurationDrift, ConfigurationReloaded, Cursor, Device, DriveInfo, EepromWritten, Event, FlightRecordWritten, FoundNode,
                     InhibitChange, KeptStateChange, LeaseChange, LinkChange, Parameter, PositionSegment, ScanProgress, Segments, SerialProgress,
                     StateChange, StopHoldChange, TerminalCapability, TerminalEdge, VelocitySegment)
from .errors import (ArgumentError, AxisdError, LeaseLostError, MotionError, RefusedError, StopError,
                     UnreachableError)
from .group import Group, GroupMember, GroupMove
from .holds import StopHold
from .kept_state import AllStopped, Conviction, KeptFile, KeptState
from .lease import Lease, LeaseInfo
from .machine import Machine, connect
from .reasons import Outcome, Reason
from .traffic import (BusStatistics, ClassStatistics, FlightRecord, Latency, NodeStatistics, Quarantine, TracedFrame,
                      UnknownOutcomes)
from .types import (AxisState, Bus, BusKind, Command, CommandState, ErrorDetail, Info, Link, MotionCause, MotionValues,
                    Network, NetworkLink, Obstacle, PermittedRange, Role, State, StopResult, Terminal, Tick, Trust)

__all__ = [
    "Alarm", "AllStopped", "ArgumentError", "AuditRecord", "Axis", "AxisBudget", "AxisFault", "AxisState", "AxisdError", "Bus", "BusBudget", "BusKind", "BusStatistics",
    "Cell", "CellEvent", "CellInfo", "CellLease", "CellMachine", "CellMove", "CellReleased", "CellStopped",
    "CertificateNotice", "ClassStatistics", "Command", "CommandChange", "CommandState", "ConfigChange", "ConfigCheck", "ConfigFinding", "Configuration",
    "ConfigurationDrift", "ConfigurationReloaded", "Conviction", "Cursor", "Device", "Drive", "DriveInfo",
    "EepromWritten", "ErrorDetail", "Event", "FlightRecord", "FlightRecordWritten", "FoundNode", "Group", "GroupMember",
    "GroupMove", "Info", "InhibitChange", "Jog", "KeptFile", "KeptState", "KeptStateChange", "Latency", "Lease",
    "LeaseChange", "LeaseInfo", "LeaseLostError", "Link", "LinkChange", "Machine", "MachineMove", "MachineOutcome", "MachineRelease", "MachineState", "MachineStop", "MemberMachine", "MotionCause", "MotionError",
    "MotionValues", "Network", "NetworkLink", "NodeStatistics", "Obstacle", "Outcome",
    "Parameter", "PermittedRange", "PositionSegment", "Quarantine", "Reason", "RefusedError", "Registry", "Reload", "Role", "ScanProgress", "Segments",
    "SerialProgress", "State", "StateChange", "StopAllLatch", "StopBudget", "StopError", "StopHold", "StopHoldChange", "StopResult", "Terminal", "TerminalCapability",
    "TerminalEdge", "Tick", "TracedFrame", "Trust", "UnknownOutcomes", "UnreachableError", "VelocitySegment", "connect", "connect_cell",
]
