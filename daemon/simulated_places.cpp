#include "daemon/simulated_places.hpp"

#include <algorithm>
#include <string_view>

namespace axisd {

namespace {

/// The drive, or what it stands in, is another one; all else only concerns how it is used.
bool is_other_drive(const ConfigurationChange& change) {
  if (change.section != "axes") return false;
  return change.kind != ConfigurationChangeKind::changed ||
         std::ranges::any_of(change.keys, [](std::string_view key) {
           return key == "bus" || key == "node" || key == "model" || key.starts_with("scale.") ||
                  key == "drive.eds" || key.starts_with("simulate.");
         });
}

}  // namespace

void SimulatedPlaces::set(const config::Configuration& configuration) {
  places_.clear();
  for (const auto& [axis, simulation] : configuration.axes)
    places_.emplace(axis.name, Place{.bus = axis.bus, .node = axis.node});
}

void SimulatedPlaces::change(const config::Configuration& configuration,
                             const std::vector<ConfigurationChange>& changes,
                             const std::function<void(const Place&)>& remove,
                             const std::function<void(const config::AxisEntry&)>& add) {
  for (const auto& change : changes)
    if (const auto known = places_.find(change.name); is_other_drive(change) && known != places_.end())
      remove(known->second);
  for (const auto& change : changes) {
    const auto entry = std::ranges::find_if(configuration.axes,
                                            [&](const auto& each) { return each.axis.name == change.name; });
    if (is_other_drive(change) && entry != configuration.axes.end()) add(*entry);
  }
  set(configuration);
}

}  // namespace axisd
