// A machine that gets another configuration while it runs, in virtual time.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "config/fields.hpp"
#include "tests/unit/daemon/core/machine_rig.hpp"

namespace axisd::core {

/// a1 and a2 on one line; spare drives at nodes 3 and 4.
class ReloadedMachine : public MachineOnALine {
 protected:
  ReloadedMachine() : MachineOnALine("two", {1, 2}) {
    start_with({1, 2, 3, 4});
    line_->forget_wire();
  }

  /// Asks for `wanted`; what stands against it is in `refusals_` once `answered_`.
  void ask(const config::Configuration& wanted, const std::string& client = "fitter") {
    answered_ = false;
    wanted_ = wanted;
    machine_->reload({.client = client,
                      .configuration = wanted,
                      .changes = config::differences(configuration_, wanted),
                      .before = "r1",
                      .revision = "r2"},
                     [this](std::vector<Error> refusals) {
                       answered_ = true;
                       refusals_ = std::move(refusals);
                       if (refusals_.empty()) configuration_ = wanted_;
                     });
  }
  void reload(const config::Configuration& wanted, const std::string& client = "fitter") {
    ask(wanted, client);
    EXPECT_TRUE(world_.run_until([this] { return answered_; }, std::chrono::seconds(10)));
  }
  /// The present configuration with another limit for an axis.
  config::Configuration slower(std::size_t axis, double velocity = 50) {
    auto wanted = configuration_;
    wanted.axes.at(axis).axis.limits.velocity = velocity;
    return wanted;
  }
  std::vector<Reason> reasons() const {
    std::vector<Reason> all;
    for (const auto& refusal : refusals_) {
      all.push_back(refusal.reason);
      EXPECT_FALSE(refusal.remedy.empty()) << to_string(refusal);
    }
    return all;
  }
  Command complete(const std::string& axis, const Action& action) {
    const auto command = machine_->submit(axis, action, options());
    EXPECT_TRUE(command) << to_string(command.error());
    EXPECT_TRUE(world_.run_until([&] { return (*command)->has_ended(); }, std::chrono::seconds(60)));
    return (*command)->value();
  }
  CommandOptions options() { return {.client = "hmi", .request_id = std::to_string(++requests_)}; }
  AxisSnapshotPtr state(const std::string& axis) { return machine_->find(axis)->snapshot(); }
  bool online(const std::string& axis) {
    return world_.run_until([&] { return state(axis)->link == LinkState::online; }, std::chrono::seconds(10));
  }
  int writes(std::uint8_t node, std::uint16_t address) {
    return static_cast<int>(std::ranges::count_if(line_->wire(), [&](const auto& entry) {
      return entry.node() == node && entry.is_write() && entry.address() == address;
    }));
  }

  config::Configuration wanted_;
  std::vector<Error> refusals_;
  bool answered_ = false;
  int requests_ = 0;
};

}  // namespace axisd::core
