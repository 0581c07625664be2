// Work on a drive beside motion: parameters, segments, memory.
#pragma once

#include <memory>

#include "devices/axis/axis_context.hpp"
#include "devices/axis/shaft.hpp"

namespace axisd {

class DriftCheck;
class Execution;
class Preconditions;

/// Knows who works on the drive, and keeps commands other than stops away meanwhile. Thread: core.
class DriveWork {
 public:
  DriveWork(const AxisContext& context, const Shaft& shaft, const Preconditions& preconditions,
            const Execution& execution, DriftCheck& drift)
      : context_(context),
        shaft_(shaft),
        preconditions_(preconditions),
        execution_(execution),
        drift_(drift) {}
  DriveWork(const DriveWork&) = delete;

  /// Keeps commands other than stops away from the drive while it lives. Errors: moving, fault (the power
  /// stage is on), busy, and those of Preconditions::check_online().
  Result<std::shared_ptr<void>> begin_maintenance();
  /// What begin_maintenance() returned lives.
  [[nodiscard]] bool under_way() const { return !maintenance_.expired(); }
  /// Keeps the axis from being exchanged while it lives.
  [[nodiscard]] std::shared_ptr<void> use() { return users_; }
  [[nodiscard]] bool used() const { return users_.use_count() > 1; }

  /// The drive's segment table holds targets that count from its own zero.
  [[nodiscard]] bool absolute_segments() const { return absolute_segments_; }
  void set_absolute_segments(bool absolute) { absolute_segments_ = absolute; }

 private:
  const AxisContext& context_;
  const Shaft& shaft_;
  const Preconditions& preconditions_;
  const Execution& execution_;
  DriftCheck& drift_;

  std::weak_ptr<void> maintenance_;                       ///< of begin_maintenance()
  std::shared_ptr<int> users_ = std::make_shared<int>();  ///< of use()
  bool absolute_segments_ = context_.settings.segments && context_.settings.segments->absolute;
};

}  // namespace axisd
