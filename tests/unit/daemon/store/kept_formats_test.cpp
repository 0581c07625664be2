// Directories as each format of the files left them: a start goes on with all that they say.
#include <gmock/gmock.h>

#include <boost/asio/io_context.hpp>
#include <filesystem>
#include <string>

#include "daemon/store/kept_state.hpp"
#include "tests/support/source_tree.hpp"
#include "tests/support/temporary_directory.hpp"

namespace axisd::store {
namespace {

using testing::IsEmpty;
using testing::SizeIs;
using testing::StartsWith;

class KeptFormats : public testing::TestWithParam<std::string> {
 protected:
  KeptFormats() {
    const std::filesystem::path from = test::in_source_tree("tests/golden/state/" + GetParam());
    for (const auto* name : {"state.v1", "state.v1.previous", "journal.v1"})
      std::filesystem::copy_file(from / name, temporary_.path() / name);
  }
  std::unique_ptr<KeptState> open() {
    const WallTime soon(std::chrono::seconds(1'700'000'010));
    auto opened = KeptState::open(temporary_.path(), soon, core_.get_executor());
    if (opened) return *std::move(opened);
    ADD_FAILURE() << to_string(opened.error());
    return nullptr;
  }

  test::TemporaryDirectory temporary_;
  boost::asio::io_context core_;
};

TEST_P(KeptFormats, AreReadWholeAndWrittenInTheFormatOfToday) {
  {
    const auto kept = open();
    ASSERT_TRUE(kept);
    const auto& state = kept->state().loaded();
    EXPECT_THAT(state.convictions, IsEmpty()) << to_string(state.convictions);
    EXPECT_EQ(state.start_count, 8U);
    EXPECT_TRUE(state.inhibit.active);
    EXPECT_EQ(state.inhibit.by, "panel");
    const auto& axis = state.axes.at("feeder");
    EXPECT_EQ(axis.eeprom_writes, 3U);
    ASSERT_TRUE(axis.offset);
    EXPECT_EQ(axis.offset->offset_pulses, -120);
    EXPECT_EQ(axis.offset->trust, PositionTrust::homed);
    const auto known = kept->journal().take_loaded();
    EXPECT_FALSE(known.doubtful_until);
    ASSERT_THAT(known.commands, SizeIs(2));
    EXPECT_EQ(known.commands[0].command.state, CommandState::done);
    EXPECT_EQ(known.commands[0].command.asked.distance, 5);
    EXPECT_EQ(known.commands[1].command.request_id, "43");
    EXPECT_TRUE(known.commands[1].sent);
    EXPECT_EQ(known.commands[1].note.target_pulses, 2000);
  }
  EXPECT_THAT(temporary_.read("state.v1"), StartsWith("axisd-state 2\n"));
  EXPECT_THAT(temporary_.read("journal.v1"), StartsWith("axisd-journal 3\n"));
  const auto again = open();
  ASSERT_TRUE(again);
  EXPECT_THAT(again->state().loaded().convictions, IsEmpty());
  EXPECT_THAT(again->journal().loaded().commands, SizeIs(2));
}

/// One folder for each pair of formats that were ever written together.
INSTANTIATE_TEST_SUITE_P(Each, KeptFormats,
                         testing::Values("state-1-journal-1", "state-1-journal-2", "state-2-journal-3"));

}  // namespace
}  // namespace axisd::store
