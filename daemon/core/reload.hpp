#pragma once

#include <cstdint>
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

/// Axes that a reload exchanges or removes, until their successors are there.
///
///   none      -- reload() ------------------------------------> under_way
///   under_way -- all have made room, and it is carried out ---> none
///   under_way -- all have made room, and the daemon ends -----> given_up
struct Exchange {
  enum class State : std::uint8_t { none, under_way, given_up };
  State state = State::none;
  Leaving leaving;
  std::map<std::string, LeftBehind, std::less<>> left_behind;
  int stops_on_their_way = 0;  ///< of those that are leaving
  bool unconfirmed = false;    ///< a stop of one of them was not confirmed
};

}  // namespace axisd::core
