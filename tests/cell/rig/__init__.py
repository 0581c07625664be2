"""A cell in network namespaces: computers that can be killed, cut off, frozen and healed."""
from .cell import Cell, CellScenario
from .disk import Disk
from .entrance import CellClient, MachineWatch, cell_pb
from .etcd import Etcd, Registrant, Watch
from .traffic import AXIS, Mover, Reader, Traffic

__all__ = ["AXIS", "Cell", "CellClient", "CellScenario", "Disk", "Etcd", "MachineWatch", "Mover", "Reader", "Registrant",
           "Traffic", "Watch", "cell_pb"]
