// The terminals of an axis: what their bits mean.
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "devices/axis/settings.hpp"
#include "devices/axis/snapshot.hpp"
#include "devices/descriptor.hpp"
#include "devices/drive.hpp"

namespace axisd {

/// Reads terminals by the functions that they are configured with. Pure. Thread: core.
class Terminals {
 public:
  /// Both outlive this.
  Terminals(const AxisSettings& settings, const DriveDescriptor& descriptor)
      : settings_(&settings), descriptor_(&descriptor) {}

  /// An input with that function is configured.
  [[nodiscard]] bool has(std::string_view function) const;
  [[nodiscard]] bool active(const DriveSample& sample, std::string_view function) const;
  [[nodiscard]] bool active(const DriveSample& sample, const TerminalSettings& input) const;
  [[nodiscard]] bool starts_motion(const TerminalSettings& input) const;
  /// Some input is configured to start motions.
  [[nodiscard]] bool may_start_motion() const;
  /// Some of them is active.
  [[nodiscard]] bool start_active(const DriveSample& sample) const;
  /// What is shown of them.
  [[nodiscard]] std::vector<TerminalState> inputs(std::uint32_t bits) const;
  [[nodiscard]] std::vector<TerminalState> outputs(std::uint32_t bits) const;

 private:
  const AxisSettings* settings_;
  const DriveDescriptor* descriptor_;
};

}  // namespace axisd
