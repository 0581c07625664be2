"""The address of a daemon as people write it."""
from __future__ import annotations

import re

#: Of the daemon; its stop lane has the one after it, unless the configuration says otherwise.
USUAL_PORT, USUAL_STOP_PORT = 7443, 7444
#: Of the entrance of a cell.
USUAL_CELL_PORT = 7445
# Of gRPC's own addresses, "dns:press-1".
_SCHEMES = ("dns", "ipv4", "ipv6", "unix-abstract", "vsock")


def with_port(address: str, port: int) -> str:
    """With a port, as axisctl does it: "press-1" is "press-1:7443", "::1" is "[::1]:7443". What has a port, "unix:PATH"
    and other names of gRPC's stay as they are. Raises ValueError: the port is none, where gRPC takes another one."""
    if address.count(":") > 1 and re.fullmatch(r"[0-9a-fA-F:.]+", address):
        return f"[{address}]:{port}"
    bracketed = address.startswith("[") and address.endswith("]")
    if not address or address.startswith("unix:") or (not bracketed and "/" in address):
        return address
    if bracketed or ":" not in address:
        return f"{address}:{port}"
    before, _, behind = address.rpartition(":")
    if before not in _SCHEMES and not (re.fullmatch(r"[0-9]{1,5}", behind) and 0 < int(behind) <= 65535):
        raise ValueError(f"{address!r}: a port is a number from 1 to 65535")
    return address
