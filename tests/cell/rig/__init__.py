"""A cell in network namespaces: computers that can be killed, cut off, frozen and healed."""
from .cell import Cell, CellScenario
from .etcd import Etcd, Registrant, Watch
from .disk import Disk

__all__ = ["Cell", "CellScenario", "Disk", "Etcd", "Registrant", "Watch"]
