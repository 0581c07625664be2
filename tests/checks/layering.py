"""Who may include whom: fails on a forbidden include.

The folders stand on each other: buses < devices < config, api < daemon. Third-party libraries are confined to the
folder that wraps them. Time is asked for and waited for in one place. A drive family's simulator shares nothing with
its driver but the register table, so that one's mistake is not the other's. Drives and their contract know nothing of
the axis.
"""

import re
import sys
from pathlib import Path

import tree

# Folder -> what it may include, as prefixes. The longest matching folder decides. `axisd/v1/` is generated from proto.
OURS = {
    "buses": ["buses/"],
    "devices": ["buses/", "devices/"],
    "config": ["buses/", "devices/", "config/"],
    "api/budget": ["buses/", "devices/", "api/budget/", "axisd/v1/"],
    "api/tls": ["buses/", "api/tls/"],
    "api/grpc_text": ["buses/clock.hpp", "api/grpc_text/"],
    "api/program": ["buses/error.hpp", "buses/file_descriptor.hpp", "api/program/"],
    "api/transport": ["buses/", "api/tls/", "api/transport/"],
    "api/settings": ["api/settings/", "buses/clock.hpp", "config/diagnostics.hpp", "config/document.hpp",
                     "config/quantity.hpp", "config/text.hpp"],
    "api/exposition": ["buses/", "api/transport/listen.hpp", "api/exposition/"],
    "api/server": ["buses/", "devices/", "api/budget/", "api/tls/", "api/grpc_text/", "api/transport/", "api/server/", "axisd/v1/"],
    "api/axisctl": ["api/budget/", "api/program/", "api/tls/", "api/transport/", "api/axisctl/", "config/", "axisd/v1/", "axisd/cell/v1/"],
    "api/examples": ["axisd/v1/"],
    # Nothing of devices and buses but what has no say in motion, each by its name.
    "api/cell": ["api/cell/", "api/program/", "api/settings/", "api/tls/", "api/transport/", "api/exposition/", "axisd/v1/", "axisd/cell/v1/",
                 "buses/asio_clock.hpp", "buses/clock.hpp", "buses/error.hpp", "buses/file_descriptor.hpp",
                 "buses/latency_histogram.hpp", "buses/limited_log.hpp", "buses/supervision.hpp",
                 "config/diagnostics.hpp", "config/document.hpp", "config/quantity.hpp", "config/text.hpp"],
    "api/web/gateway": ["api/web/gateway/", "api/program/", "api/settings/", "api/tls/", "api/grpc_text/", "api/transport/", "axisd/v1/", "buses/asio_clock.hpp", "buses/clock.hpp",
                        "buses/error.hpp", "buses/file_descriptor.hpp", "config/diagnostics.hpp", "config/document.hpp",
                        "config/quantity.hpp", "config/text.hpp"],
    "daemon/store": ["buses/", "devices/", "daemon/store/"],
    "daemon/core": ["buses/", "devices/", "config/", "daemon/core/", "daemon/store/"],
    "daemon/metrics": ["buses/", "devices/", "api/exposition/", "daemon/core/", "daemon/metrics/"],
    "daemon/sim": ["buses/", "devices/", "config/", "daemon/sim/"],
    "daemon": ["buses/", "devices/", "config/", "api/server/", "api/tls/", "api/transport/", "api/exposition/", "daemon/", "axisd/v1/"],
}

# Third party -> the folders that may include it. "daemon/*" means the folder itself, not those below.
THIRD_PARTY = {
    "modbus": ["buses/modbus_rtu"],
    "linux/can": ["buses/can"],
    "boost/asio": ["buses", "daemon", "api/exposition", "api/cell", "api/web/gateway"],
    "boost/beast": ["api/exposition", "api/web/gateway"],
    "boost/json": ["api/server", "cmake", "config"],
    "yaml-cpp": ["config"],
    "grpc": ["api/program", "api/transport", "api/server", "api/cell", "api/axisctl", "api/web/gateway", "daemon/*"],
    "grpcpp": ["api/transport", "api/server", "api/cell", "api/axisctl", "api/examples", "api/web/gateway", "daemon/*"],
    "google": ["api/budget", "api/program", "api/server", "api/cell", "api/axisctl", "api/web/gateway", "daemon/*"],
    "openssl": ["api/tls"],
    "nghttp2": ["api/server/lane"],
    "absl": ["api/server/lane"],
    "CLI": ["api/axisctl", "api/cell", "api/web/gateway", "daemon/sim", "daemon/*"],
    "sodium": ["api/web/gateway"],
    "systemd": ["daemon", "api/cell", "api/web/gateway"],
}

TIME = re.compile(r"steady_timer|high_resolution_timer|steady_clock::now|high_resolution_clock|\bsleep_for\s*\("
                  r"|this_thread::sleep|\b(u|nano|clock_nano)?sleep\s*\(")
TIME_ALLOWED = re.compile(r"buses/(asio_)?clock\.[ch]pp$")

INCLUDE = re.compile(r'^[ \t]*#[ \t]*include[ \t]*(["<])([^">]+)[">]', re.MULTILINE)
COMMENT_OR_STRING = re.compile(r'//[^\n]*|/\*.*?\*/|"(?:\\.|[^"\\\n])*"', re.DOTALL)
LAYERS = ("buses", "devices", "config", "api", "daemon")
# What a drive is, without the axis that uses it: with the folders of the models these may include nothing of devices/axis.
DRIVE_CONTRACT = {f"devices/{name}.hpp" for name in ("drive", "drive_facets", "drive_values", "setup_values", "descriptor", "canary",
                                                     "rtu_identification", "can_identification", "setup_codes", "released_position",
                                                     "drive_settings", "drive_configuration")}
SHARED_BY_FAMILY = re.compile(r"(registers|parameters)[^/]*\.hpp$")


def within(path, folder):
    if folder.endswith("/*"):
        return path.parent.as_posix() == folder[:-2]
    return folder in [parent.as_posix() for parent in path.parents]


def owner(path, table):
    """The entry of the deepest folder of `table` that holds `path`."""
    return next((table[parent.as_posix()] for parent in path.parents if parent.as_posix() in table), None)


def families(paths):
    """Folders under devices/ with a descriptor: one drive model each."""
    return {path.parent.as_posix() for path in paths
            if path.name == "descriptor.cpp" and path.parent.parent.as_posix() == "devices"}


def with_simulators(paths):
    """Folders under devices/ in which drivers and simulators live side by side."""
    return {path.parent.as_posix() for path in paths
            if path.name.startswith("simulat") and path.parent.parent.as_posix() == "devices"
            and path.parent.name != "simulation"}


def family_finding(path, included, family_folders, mixed_folders):
    """Why `path` must not include `included`, as far as drive families are concerned."""
    own = path.parent.as_posix() if path.parent.as_posix() in family_folders else None
    target = included.rsplit("/", 1)[0]
    if target in family_folders and target != own:
        return "a drive family is reached through its descriptor only"
    if included.startswith("devices/axis/") and (
            path.as_posix() in DRIVE_CONTRACT or path.parent.as_posix() in family_folders | mixed_folders):
        return "a drive knows nothing of the axis that uses it"
    simulates = path.name.startswith("simulat")
    if path.parts[0] == "devices" and own != "devices/simulation" and included.startswith("devices/simulation/"):
        if not simulates and path.parts[1] != "simulation":
            return "only simulators use devices/simulation"
    if target not in mixed_folders or path.parts[0] != "devices":
        return None
    included_simulates = included.rsplit("/", 1)[1].startswith("simulat")
    if simulates != included_simulates and not SHARED_BY_FAMILY.search(included):
        return "simulator and driver share the register table only"
    return None


def include_findings(path, text, family_folders, mixed_folders):
    allowed = owner(path, OURS)
    for match in INCLUDE.finditer(text):
        included = match[2]
        line = text.count("\n", 0, match.start()) + 1
        at = f"{path}:{line}: includes {included}"
        if match[1] == '"' or included.startswith(("axisd/v1/", *(f"{layer}/" for layer in LAYERS))):
            if allowed is None:
                yield f"{at}: this folder has no include rule; add one to tests/checks/layering.py"
            elif not any(included.startswith(prefix) for prefix in allowed):
                yield f"{at}: may include only {', '.join(allowed)}"
            elif (why := family_finding(path, included, family_folders, mixed_folders)) is not None:
                yield f"{at}: {why}"
        for library, folders in THIRD_PARTY.items():
            # "linux/can" also covers linux/can/raw.h and linux/can.h
            if re.match(rf"{library}([/.]|$)", included) and not any(within(path, folder) for folder in folders):
                yield f"{at}: {library} belongs to {', '.join(folders)}"


def time_findings(path, text):
    if TIME_ALLOWED.search(path.as_posix()):
        return
    code = COMMENT_OR_STRING.sub(lambda match: re.sub(r"[^\n]", " ", match[0]), text)
    for match in TIME.finditer(code):
        line = code.count("\n", 0, match.start()) + 1
        yield f"{path}:{line}: {match[0]}: time goes through buses/clock.hpp"


def findings(root):
    paths = tree.files(root)
    family_folders = families(paths)
    mixed_folders = with_simulators(paths)
    found = []
    for path in paths:
        if path.suffix not in tree.CODE or len(path.parts) < 2:
            continue
        layer = path.parts[0] in LAYERS
        if not layer and path.parts[:2] != ("tests", "unit"):
            continue
        text = tree.text(root, path) or ""
        if layer:
            found += include_findings(path, text, family_folders, mixed_folders)
        found += time_findings(path, text)
    return found


if __name__ == "__main__":
    sys.exit(tree.report(findings(Path(sys.argv[1])), "layering"))
