#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "config/configuration.hpp"
#include "devices/axis/axis_face.hpp"
#include "devices/axis/command_book.hpp"
#include "devices/budget.hpp"
#include "devices/configuration_change.hpp"

namespace axisd::core {

/// What a machine is to become while it runs.
struct Reload {
  std::string client;  ///< who asks for it
  config::Configuration configuration;
  std::vector<ConfigurationChange> changes;  ///< from the present one to that
  std::vector<BusBudgetReport> budgets;      ///< of that one
  std::string before, revision;              ///< of the texts
};
/// With what stands against it (then nothing was changed), or with nothing once it is through.
using ReloadDone = std::function<void(std::vector<Error> refusals)>;

/// A stop for an axis that is being exchanged: whichever axis is there next executes it.
struct HeldStop {
  StopRequest request;
  CommandOptions options;
  CommandPtr command;
};
/// Axes that make room, by name.
using Leaving = std::map<std::string, std::vector<HeldStop>, std::less<>>;
/// What is left of one for its successor.
struct LeftBehind {
  AxisFacePtr face;
  std::string bus;
  std::uint8_t node = 0;
  bool answered = false;      ///< by the drive, until then
  bool owes_release = false;  ///< a lease ended meanwhile, and the axis is to be disabled for it
};

}  // namespace axisd::core
