#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "buses/clock.hpp"
#include "devices/audit.hpp"

namespace axisd::core {

/// What of that which happens on a machine goes into the audit. Thread: core.
class AuditTrail {
 public:
  /// Refusals of one client that are told in a minute; further ones are counted: one client does not write
  /// the others out of files of a bounded size (M32).
  static constexpr std::uint64_t refusals_a_minute = 60;

  /// `sink` may be null: nothing is kept.
  AuditTrail(Clock& clock, AuditSink* sink) : clock_(&clock), sink_(sink) {}

  [[nodiscard]] bool kept() const { return sink_ != nullptr; }
  /// Commands, faults, and what somebody did to leases, holds, StopAll, the configuration and the state.
  void event(const Event& event);
  void refused(const std::string& axis, const Action& action, const CommandOptions& options, Error cause);
  void call(AuditedCall call);

 private:
  struct Minute {
    TimePoint begin{};
    std::uint64_t told = 0, left_out = 0;
  };
  void add(AuditContent content);
  [[nodiscard]] Minute& minute_of(const std::string& client);

  Clock* clock_;
  AuditSink* sink_;
  std::map<std::string, Minute> minutes_;  ///< by client
};

}  // namespace axisd::core
