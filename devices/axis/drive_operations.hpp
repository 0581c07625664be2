// Work on the drive behind an axis that is not motion: parameters, segments, memory, address.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "buses/task.hpp"
#include "devices/axis/axis.hpp"
#include "devices/drive_access.hpp"

namespace axisd {

/// As DriveAccess describes them. All but the reading ones need the axis at rest and released, and keep
/// commands other than stops away meanwhile. Thread: core.
class DriveOperations {
 public:
  explicit DriveOperations(Axis& axis) : axis_(&axis) {}

  [[nodiscard]] DriveInfo info() const;
  Task<Result<std::vector<ParameterValue>>> read_parameters(std::vector<std::uint32_t> addresses) const;
  /// `before` (may be null; outlives it): what the drive held, which is read first.
  Task<Result<std::vector<ParameterValue>>> write_parameters(
      std::vector<ParameterValue> values, std::vector<ParameterValue>* before = nullptr) const;
  Task<Result<SegmentSettings>> read_segments() const;
  Task<Result<SegmentSettings>> write_segments(SegmentSettings segments) const;
  Task<Result<void>> save_parameters() const;
  /// `taken`: addresses of other nodes on the bus.
  Task<Result<std::string>> restore_factory(std::vector<std::uint8_t> taken) const;
  Task<Result<std::string>> change_serial(SerialChange change, std::vector<std::uint8_t> taken) const;

 private:
  [[nodiscard]] Error error(Reason reason, std::string message, std::string remedy) const;
  /// Error: not_supported, where the model lacks it.
  template <class Facet>
  Result<Facet*> needed(Facet* facet, std::string_view what, std::string remedy) const;
  [[nodiscard]] Result<ParametersFacet*> parameters() const;
  [[nodiscard]] Result<SegmentsFacet*> segments_facet() const;
  [[nodiscard]] Result<MemoryFacet*> memory() const;
  [[nodiscard]] const ParameterSpec* find(std::uint32_t address) const;
  [[nodiscard]] Result<void> check_write(const ParameterValue& value) const;

  Axis* axis_;
};

}  // namespace axisd
