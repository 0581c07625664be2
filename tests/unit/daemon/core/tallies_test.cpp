#include "daemon/core/tallies.hpp"

#include <gtest/gtest.h>

#include <memory>

namespace axisd::core {
namespace {

CommandChange command(CommandKind kind, CommandState state) {
  return {.command = std::make_shared<const Command>(Command{.kind = kind, .state = state})};
}

TEST(Tallies, CountsWhatEventsTell) {
  Tallies tallies;
  tallies.add("feeder", command(CommandKind::move_absolute, CommandState::accepted));
  tallies.add("feeder", command(CommandKind::move_absolute, CommandState::done));
  tallies.add("feeder", command(CommandKind::move_group, CommandState::unknown));
  tallies.add("feeder", LeaseChange{.what = LeaseChange::What::taken, .holder = "b", .before = "a"});
  tallies.add("feeder", LinkChange{.to = LinkState::offline, .detail = ""});
  tallies.add("feeder", LinkChange{.to = LinkState::online, .detail = ""});
  tallies.add("feeder", AxisFault{.cause = {.reason = Reason::alarm}});
  tallies.add({}, InhibitChange{.what = InhibitChange::What::latched, .by = "a"});
  tallies.add({}, InhibitChange{.what = InhibitChange::What::released, .by = "a"});
  EXPECT_EQ(tallies.commands(CommandKind::move_absolute, CommandState::accepted), 1U);
  EXPECT_EQ(tallies.commands(CommandKind::move_absolute, CommandState::done), 1U);
  EXPECT_EQ(tallies.commands(CommandKind::move_group, CommandState::unknown), 1U);
  EXPECT_EQ(tallies.commands(CommandKind::stop, CommandState::done), 0U);
  EXPECT_EQ(tallies.leases(LeaseChange::What::taken), 1U);
  EXPECT_EQ(tallies.leases(LeaseChange::What::expired), 0U);
  EXPECT_EQ(tallies.of("feeder").link_losses, 1U);
  EXPECT_EQ(tallies.of("feeder").faults, 1U);
  EXPECT_EQ(tallies.of("other").faults, 0U);
  EXPECT_EQ(tallies.stop_alls(), 1U);
}

}  // namespace
}  // namespace axisd::core
