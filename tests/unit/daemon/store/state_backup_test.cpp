// A copy of the state, taken at any time, and what a start makes of it when it comes back.
#include "daemon/store/state_backup.hpp"

#include <gmock/gmock.h>

#include <boost/asio/io_context.hpp>
#include <filesystem>
#include <memory>
#include <string>

#include "daemon/store/kept_state.hpp"
#include "tests/support/temporary_directory.hpp"

namespace axisd::store {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

class StateBackup : public testing::Test {
 protected:
  std::unique_ptr<KeptState> open() {
    auto opened = KeptState::open(temporary_.path(), WallTime(std::chrono::hours(1)), core_.get_executor());
    if (opened) return *std::move(opened);
    ADD_FAILURE() << to_string(opened.error());
    return nullptr;
  }
  /// One run of a daemon, in which `axis` is homed at `offset` and its drive saves once.
  void run(std::int64_t offset, bool latch = false) {
    const auto kept = open();
    ASSERT_TRUE(kept);
    (void)kept->journal().take_loaded();
    kept->state().save_offset("x", {.offset_pulses = offset, .trust = PositionTrust::homed}, {});
    kept->state().count_eeprom_writes("x", 1, {.saves = 1}, {});
    if (latch) kept->state().save_inhibit({.active = true, .by = "hmi"}, {});
    kept->journal().accepted(
        {.id = "c" + std::to_string(offset), .axis = "x", .request_id = "r", .client = "c"}, "digest");
  }
  std::string backup() const {
    auto text = back_up_state(temporary_.path());
    EXPECT_TRUE(text) << to_string(text.error());
    return text.value_or("");
  }

  test::TemporaryDirectory temporary_;
  boost::asio::io_context core_;
};

TEST_F(StateBackup, IsTheStateFileWhileADaemonUsesIt) {
  run(5);
  const auto kept = open();
  const auto text = backup();
  EXPECT_EQ(text, temporary_.read("state.v1"));
  EXPECT_EQ(decode(text)->state.axes.at("x").eeprom_writes, 1U);
}

TEST_F(StateBackup, ComesBackAsAnOldStateThatSomebodyHasToAccept) {
  run(5);
  const auto text = backup();
  run(6);
  run(7);
  const auto starts = decode(backup())->state.start_count;
  const auto restored = restore_state(temporary_.path(), text);
  ASSERT_TRUE(restored) << to_string(restored.error());
  const auto kept = open();
  ASSERT_TRUE(kept);
  const auto& loaded = kept->state().loaded();
  EXPECT_THAT(loaded.convictions, Not(IsEmpty()));
  EXPECT_THAT(to_string(loaded.convictions), HasSubstr("journal.v1"));
  EXPECT_GT(loaded.start_count, starts) << "no id and no token is given out twice";
  EXPECT_TRUE(loaded.inhibit.active) << "by caution: nobody knows what was asked for last";
  EXPECT_EQ(loaded.axes.at("x").eeprom_writes, 3U) << "an EEPROM does not get younger";
  EXPECT_TRUE(!loaded.axes.at("x").offset || loaded.axes.at("x").offset->trust == PositionTrust::unknown);
  EXPECT_TRUE(kept->journal().loaded().doubtful_until);
  EXPECT_TRUE(std::filesystem::exists(temporary_.path() / "journal.v1.damaged"));
}

TEST_F(StateBackup, EachReturnIsAStartOfItsOwn) {
  run(5);
  const auto text = backup();
  std::uint64_t before = 0;
  for (int i = 0; i < 3; ++i) {
    ASSERT_TRUE(restore_state(temporary_.path(), text));
    const auto now = open()->state().loaded().start_count;
    EXPECT_GT(now, before);
    before = now;
  }
}

TEST_F(StateBackup, ComesBackToAnEmptyDirectory) {
  run(5);
  const auto text = backup();
  const test::TemporaryDirectory other;
  ASSERT_TRUE(restore_state(other.path(), text));
  auto kept = KeptState::open(other.path(), WallTime(std::chrono::hours(1)), core_.get_executor());
  ASSERT_TRUE(kept) << to_string(kept.error());
  EXPECT_THAT((*kept)->state().loaded().convictions, Not(IsEmpty()));
  EXPECT_EQ((*kept)->state().loaded().axes.at("x").eeprom_writes, 1U);
}

TEST_F(StateBackup, ALatchThatCameLaterStands) {
  run(5);
  const auto text = backup();
  run(6, true);
  const auto restored = restore_state(temporary_.path(), text);
  ASSERT_TRUE(restored);
  EXPECT_EQ(restored->state.inhibit.by, "hmi");
}

TEST_F(StateBackup, IsNotRestoredUnderARunningDaemonNorFromAnythingElse) {
  run(5);
  const auto text = backup();
  const auto before = temporary_.read("state.v1");
  auto damaged = text;
  damaged[damaged.size() / 2] ^= 1;
  for (const auto& wrong : {damaged, std::string("axisd-journal 3\n"), std::string()})
    EXPECT_FALSE(restore_state(temporary_.path(), wrong));
  {
    const auto kept = open();
    const auto refused = restore_state(temporary_.path(), text);
    ASSERT_FALSE(refused);
    EXPECT_THAT(refused.error().message, HasSubstr("is used by another axisd"));
  }
  EXPECT_FALSE(std::filesystem::exists(temporary_.path() / "journal.v1.damaged"));
  EXPECT_EQ(decode(temporary_.read("state.v1"))->state.axes, decode(before)->state.axes);
}

}  // namespace
}  // namespace axisd::store
