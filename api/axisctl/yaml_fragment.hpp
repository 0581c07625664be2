// What a scan found as lines for the configuration file. Pure.
#pragma once

#include <google/protobuf/repeated_ptr_field.h>

#include <set>
#include <string>
#include <vector>

#include "axisd/v1/bus_service.pb.h"

namespace axisd::axisctl {

/// The bus that was scanned, and names that are taken.
struct FragmentContext {
  std::string bus;
  std::uint32_t baud = 0;         ///< of the bus; a drive with another one cannot be an axis there
  std::set<std::string> taken{};  ///< names of axes
};

/// Entries for `axes:` of a configuration, two blanks deep: one for each drive of a known model that is not
/// configured yet and can be reached as the bus is set. The others are named in comments. Empty: nothing new.
std::string yaml_fragment(const std::vector<v1::FoundNode>& found, const FragmentContext& context);

}  // namespace axisd::axisctl
