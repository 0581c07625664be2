// The audit's entries as messages and as the lines of its files.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "axisd/v1/audit_service.pb.h"
#include "devices/audit.hpp"

namespace axisd::server {

/// All but what the writer of the files knows: number, instance_id and revision.
void to_proto(const AuditEntry& from, v1::AuditRecord& to);

/// One line of JSON with the names of the proto, without its end.
[[nodiscard]] std::string audit_line(const v1::AuditRecord& record);
/// nullopt: it is no record. What another version has added is left out.
[[nodiscard]] std::optional<v1::AuditRecord> audit_record(std::string_view line);

/// An accepted command that a line tells of.
struct ToldCommand {
  std::string id;
  bool ended = false;
};
/// Without reading all of the line; nullopt: it tells of none.
[[nodiscard]] std::optional<ToldCommand> told_command(std::string_view line);

/// What ListAudit asks for; anything else is left out.
class AuditFilter {
 public:
  explicit AuditFilter(v1::ListAuditRequest request) : request_(std::move(request)) {}
  [[nodiscard]] bool passes(const v1::AuditRecord& record) const;

 private:
  v1::ListAuditRequest request_;
};

}  // namespace axisd::server
