// What the drive no longer holds as configured, because somebody else changed it.
#pragma once

#include <memory>
#include <string>

#include "buses/gate.hpp"
#include "buses/task.hpp"
#include "devices/axis/axis_context.hpp"
#include "devices/axis/drift_watch.hpp"
#include "devices/axis/link_machine.hpp"
#include "devices/axis/shaft.hpp"

namespace axisd {

class DriveConnection;
class DriveWork;
class Execution;
class Publisher;
class Readings;
class Sequences;
class StateReader;
class Stopper;

/// Compares the drive with its configuration now and then. Thread: core.
class DriftCheck {
 public:
  DriftCheck(const AxisContext& context, Sequences& sequences, Shaft& shaft, const LinkMachine& link,
             DriveConnection& connection, const DriveWork& work, StateReader& reader, Readings& readings,
             Execution& execution, Stopper& stopper, Publisher& publisher)
      : context_(context),
        sequences_(sequences),
        shaft_(shaft),
        link_(link),
        connection_(connection),
        work_(work),
        reader_(reader),
        readings_(readings),
        execution_(execution),
        stopper_(stopper),
        publisher_(publisher) {}
  DriftCheck(const DriftCheck&) = delete;

  /// It is time for a comparison.
  [[nodiscard]] bool drift_is_next() const;
  /// At rest: compares, or applies the configuration again to a drive that lost it.
  void look_for_drift();
  /// Compares now. Errors: of Drive::check_drift().
  Task<Result<void>> check_for_drift(TransactionOptions options);
  /// What is being compared counts no more.
  void give_up_comparison();
  /// The configuration was applied.
  void applied();

  [[nodiscard]] bool drifted() const { return watch_.drifted(); }
  [[nodiscard]] const std::string& text() const { return watch_.text(); }
  [[nodiscard]] const DriftWatch& watch() const { return watch_; }

 private:
  Task<> compare();
  void set_drift(const std::string& text);

  const AxisContext& context_;
  Sequences& sequences_;
  Shaft& shaft_;
  const LinkMachine& link_;
  DriveConnection& connection_;
  const DriveWork& work_;
  StateReader& reader_;
  Readings& readings_;
  Execution& execution_;
  Stopper& stopper_;
  Publisher& publisher_;

  DriftWatch watch_{context_.settings.drift_check};
  std::shared_ptr<AxisGate> comparison_gate_ = std::make_shared<AxisGate>();  ///< of what compare() reads
};

}  // namespace axisd
