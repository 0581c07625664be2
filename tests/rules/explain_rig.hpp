// What stands in the way, situation by situation, held against what is really refused.
#pragma once

#include <gmock/gmock.h>

#include <string>
#include <vector>

#include "tests/support/rig.hpp"

namespace axisd::test {

/// One of each, so that every situation is looked at from all of them.
inline const std::vector<Action>& every_action() {
  static const std::vector<Action> all{EnableRequest{},
                                       HomeRequest{},
                                       MoveAbsoluteRequest{.position = 10},
                                       MoveRelativeRequest{.distance = 5},
                                       MoveVelocityRequest{.velocity = 5},
                                       JogRequest{.velocity = 5},
                                       ResetRequest{},
                                       SetPositionRequest{.position = 3}};
  return all;
}

/// "disabled", or "(moving)" where it does not block.
inline std::string word(const Obstacle& obstacle) {
  const auto reason = std::string(to_string(obstacle.error.reason));
  return obstacle.blocking ? reason : "(" + reason + ")";
}

class ExplainRig : public Rig {
 public:
  explicit ExplainRig(RigOptions options = {}) : Rig(std::move(options)) {}

  /// The whole list, after it was held against the refusals: of every request the first that blocks is what
  /// it is refused with, and looking changes nothing.
  std::vector<Obstacle> explain(const std::optional<Action>& action, const CommandOptions& options = {}) {
    const auto before = line->wire().size();
    const auto revision = state()->revision;
    for (const auto& each : every_action()) compare(each, options);
    if (action) compare(*action, options);
    auto found = axis().explain(action, options);
    EXPECT_EQ(state()->revision, revision) << "only looks";
    EXPECT_EQ(line->wire().size(), before);
    for (const auto& obstacle : found) {
      EXPECT_FALSE(obstacle.error.message.empty());
      EXPECT_FALSE(obstacle.error.remedy.empty()) << obstacle.error.message;
    }
    return found;
  }
  std::vector<std::string> reasons(const std::optional<Action>& action, const CommandOptions& options = {}) {
    std::vector<std::string> words;
    for (const auto& obstacle : explain(action, options)) words.push_back(word(obstacle));
    return words;
  }
  /// Message and remedy of the one with this reason.
  std::string text(const std::optional<Action>& action, Reason reason, const CommandOptions& options = {}) {
    for (const auto& obstacle : explain(action, options))
      if (obstacle.error.reason == reason) return obstacle.error.message + " -> " + obstacle.error.remedy;
    ADD_FAILURE() << to_string(reason) << " is not among them";
    return {};
  }

 private:
  /// Only what is refused is asked for: that changes nothing either.
  void compare(const Action& action, const CommandOptions& options) {
    SCOPED_TRACE(to_string(kind_of(action)));
    for (const auto& obstacle : axis().explain(action, options)) {
      if (!obstacle.blocking) continue;
      const auto refused = try_submit(action, options);
      ASSERT_FALSE(refused) << "explained as refused: " << obstacle.error.message;
      EXPECT_EQ(refused.error().reason, obstacle.error.reason);
      EXPECT_EQ(refused.error().message, obstacle.error.message);
      EXPECT_EQ(refused.error().remedy, obstacle.error.remedy);
      return;
    }
  }
};

}  // namespace axisd::test
