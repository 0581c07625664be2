// A machine whose groups start at a moment that is told once they are prepared.
#pragma once

#include <algorithm>
#include <map>
#include <string>
#include <vector>

#include "tests/rules/m22_group_rig.hpp"

namespace axisd::test {

inline constexpr std::uint16_t start_register = 0x0027;

struct MomentRig : GroupRig {
  using GroupRig::GroupRig;

  GroupRunPtr begin(const std::map<std::string, double>& places, const CommandOptions& options = {}) {
    auto request = to(places);
    request.start = GroupStart::when_told;
    return move(request, options);
  }
  GroupRunPtr prepare(const std::map<std::string, double>& places, const CommandOptions& options = {}) {
    auto run = begin(places, options);
    EXPECT_TRUE(run_until([&] { return run->prepared(); }, 5s));
    EXPECT_FALSE(ended(run->state())) << (run->value().cause ? to_string(*run->value().cause) : "");
    return run;
  }
  /// And all others, too.
  TimePoint tell(const GroupRunPtr& run, Duration ahead = 500ms) {
    const auto at = tell_alone(run, ahead);
    run->renew(GroupRenewal::all_told);
    return at;
  }
  TimePoint tell_alone(const GroupRunPtr& run, Duration ahead = 500ms) {
    const auto at = world.now() + ahead;
    const auto told = run->start_at(at);
    EXPECT_TRUE(told) << to_string(told.error());
    return at;
  }
  bool ends(const GroupRunPtr& run, Duration limit) {
    const bool over = run_until([&] { return ended(run->state()); }, limit);
    this->run(1ms);
    return over;
  }
  /// As its coordinator does.
  void keep(const GroupRunPtr& run, Duration duration, GroupRenewal renewal = GroupRenewal::all_told) {
    for (const auto end = world.now() + duration; world.now() < end;) {
      run->renew(renewal);
      this->run(std::min<Duration>(200ms, end - world.now()));
    }
  }
  [[nodiscard]] int all_starts() {
    int sum = 0;
    for (const auto& axis : configuration.axes) sum += starts(axis.axis.name);
    return sum;
  }
  /// Of x and y.
  [[nodiscard]] std::vector<TimePoint> start_frames() const {
    std::vector<TimePoint> begins;
    for (const auto& entry : line->wire())
      if (entry.node() <= 2 && entry.is_write() && entry.address() == start_register)
        begins.push_back(entry.begin);
    return begins;
  }
  /// Nothing has started, nothing does, and each axis can be moved again.
  void expect_nothing_started(const GroupRunPtr& run) {
    EXPECT_TRUE(ends(run, 5s));
    EXPECT_TRUE(rests(4s));
    EXPECT_EQ(all_starts(), 0);
    EXPECT_TRUE(start_frames().empty());
    for (const auto& member : run->value().members) {
      SCOPED_TRACE(describe(member.command));
      EXPECT_NE(member.command.state, CommandState::done);
      ASSERT_TRUE(member.command.cause);
      EXPECT_NE(member.command.cause->outcome, Outcome::unknown);
    }
  }
};

inline std::string cause_of(const GroupRunPtr& run) {
  const auto cause = run->value().cause;
  return cause ? to_string(*cause) : std::string();
}

}  // namespace axisd::test
