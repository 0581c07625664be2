// What an axis did, counted from the audit. Pure.
#pragma once

#include <google/protobuf/struct.pb.h>

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "axisd/v1/audit_service.pb.h"

namespace axisd::axisctl {

class AxisReport {
 public:
  /// Records of the axis, in the order of the audit.
  void add(const v1::AuditRecord& record);
  /// A line each; `unit` is the axis's.
  [[nodiscard]] std::vector<std::string> lines(std::string_view unit) const;
  /// The same for scripts.
  [[nodiscard]] google::protobuf::Struct values() const;

 private:
  void add(const v1::Command& command);
  void add_way(const v1::Command& command);

  std::map<std::string, std::uint64_t> motions_;  ///< by how they ended
  std::map<std::string, std::uint64_t> faults_;   ///< by reason
  std::uint64_t stops_ = 0, refused_ = 0, unknown_ = 0;
  std::uint64_t eeprom_writes_ = 0;  ///< registers
  double distance_ = 0;              ///< of what is done, from start to target
  std::uint64_t not_measured_ = 0;   ///< motions that it does not have
  std::optional<double> at_;         ///< what was reached last and still holds: old records tell no way
};

}  // namespace axisd::axisctl
