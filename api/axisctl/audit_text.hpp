// Records of the audit as lines. Pure.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "axisd/v1/audit_service.pb.h"

namespace axisd::axisctl {

/// "2026-01-02T03:04:05.678Z  12  feeder  hmi-1  refused: MoveAbsolute 300: ...".
std::string audit_line(const v1::AuditRecord& record);
/// "command", "stop-hold" ... Throws Failure (usage).
v1::AuditKind parse_audit_kind(std::string_view text);
/// All of them.
std::vector<std::string> audit_kinds();

}  // namespace axisd::axisctl
