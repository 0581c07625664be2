#include "api/axisctl/axis_report.hpp"

#include <fmt/format.h>

#include <cmath>

#include "api/axisctl/format.hpp"

namespace axisd::axisctl {
namespace {

bool is_stop(v1::CommandKind kind) {
  return kind == v1::COMMAND_KIND_HALT || kind == v1::COMMAND_KIND_STOP ||
         kind == v1::COMMAND_KIND_QUICK_STOP;
}

bool is_motion(v1::CommandKind kind) {
  switch (kind) {
    case v1::COMMAND_KIND_HOME:
    case v1::COMMAND_KIND_MOVE_ABSOLUTE:
    case v1::COMMAND_KIND_MOVE_RELATIVE:
    case v1::COMMAND_KIND_MOVE_VELOCITY:
    case v1::COMMAND_KIND_JOG:
    case v1::COMMAND_KIND_MOVE_GROUP:
      return true;
    default:
      return false;
  }
}

/// ": 12 done, 1 aborted"; empty: there are none.
std::string parts(const std::map<std::string, std::uint64_t>& counts) {
  std::string text;
  for (const auto& [what, count] : counts)
    text += fmt::format("{}{} {}", text.empty() ? ": " : ", ", count, what);
  return text;
}

std::uint64_t sum(const std::map<std::string, std::uint64_t>& counts) {
  std::uint64_t total = 0;
  for (const auto& [what, count] : counts) total += count;
  return total;
}

}  // namespace

void AxisReport::add(const v1::AuditRecord& record) {
  switch (record.content_case()) {
    case v1::AuditRecord::kEvent:
      if (record.event().has_command_change()) add(record.event().command_change().command());
      if (record.event().has_axis_fault())
        ++faults_[lower_word(v1::Reason_Name(record.event().axis_fault().cause().reason()), "REASON_")];
      eeprom_writes_ += record.event().eeprom_written().registers();
      return;
    case v1::AuditRecord::kRecovered:
      return add(record.recovered().command());
    case v1::AuditRecord::kRefused:
      refused_ += 1 + record.refused().left_out();
      return;
    default:
      return;
  }
}

void AxisReport::add(const v1::Command& command) {
  if (!ended(command)) return;
  if (command.state() == v1::COMMAND_STATE_UNKNOWN) ++unknown_;
  if (is_stop(command.kind())) ++stops_;
  if (command.kind() == v1::COMMAND_KIND_SET_POSITION && command.state() == v1::COMMAND_STATE_DONE)
    at_ = command.asked().position();
  if (!is_motion(command.kind())) return;
  ++motions_[lower_word(v1::CommandState_Name(command.state()), "COMMAND_STATE_")];
  add_way(command);
}

void AxisReport::add_way(const v1::Command& command) {
  const auto& asked = command.asked();
  if (command.state() == v1::COMMAND_STATE_DONE && asked.has_distance()) {
    distance_ += std::abs(asked.distance());
    if (at_) *at_ += asked.distance();
    return;
  }
  if (command.state() == v1::COMMAND_STATE_DONE && asked.has_position()) {
    if (command.granted().has_distance())  // an axis that turns without end takes the shorter way, too
      distance_ += std::abs(command.granted().distance());
    else if (at_)
      distance_ += std::abs(asked.position() - *at_);
    else
      ++not_measured_;
    at_ = asked.position();
    return;
  }
  const auto outcome = command.cause().outcome();
  if (outcome == v1::OUTCOME_NOT_SENT || outcome == v1::OUTCOME_NOT_EXECUTED) return;
  ++not_measured_;
  at_.reset();
}

std::vector<std::string> AxisReport::lines(std::string_view unit) const {
  auto way = with_unit(distance_, unit) + " from start to target";
  if (not_measured_ > 0)
    way += fmt::format(", without {} motion{} of which it is not known", not_measured_,
                       not_measured_ == 1 ? "" : "s");
  return {
      fmt::format("{:<18}{}{}", "motions:", sum(motions_), parts(motions_)),
      fmt::format("{:<18}{}", "distance:", way),
      fmt::format("{:<18}{}", "stops:", stops_),
      fmt::format("{:<18}{}{}", "faults:", sum(faults_), parts(faults_)),
      fmt::format("{:<18}{}", "refused:", refused_),
      fmt::format("{:<18}{}", "unknown outcomes:", unknown_),
      fmt::format("{:<18}{} register{}", "EEPROM writes:", eeprom_writes_, eeprom_writes_ == 1 ? "" : "s")};
}

google::protobuf::Struct AxisReport::values() const {
  google::protobuf::Struct all;
  const auto set = [&all](const char* name, auto value) {
    (*all.mutable_fields())[name].set_number_value(static_cast<double>(value));
  };
  const auto set_parts = [&all](const char* name, const std::map<std::string, std::uint64_t>& counts) {
    auto& fields = *(*all.mutable_fields())[name].mutable_struct_value()->mutable_fields();
    for (const auto& [what, count] : counts) fields[what].set_number_value(static_cast<double>(count));
  };
  set_parts("motions", motions_);
  set_parts("faults", faults_);
  set("distance", distance_);
  set("distance_not_known", not_measured_);
  set("stops", stops_);
  set("refused", refused_);
  set("unknown_outcomes", unknown_);
  set("eeprom_writes", eeprom_writes_);
  return all;
}

}  // namespace axisd::axisctl
