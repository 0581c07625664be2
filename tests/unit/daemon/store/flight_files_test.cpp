#include "daemon/store/flight_files.hpp"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <optional>

#include "tests/support/temporary_directory.hpp"
#include "tests/support/virtual_world.hpp"

namespace axisd::store {
namespace {

using namespace std::chrono_literals;

class FlightFilesTest : public ::testing::Test {
 protected:
  void open(std::size_t keep = 3) { files_.emplace(directory_ / "flight", keep, world_.executor()); }
  /// Waits for the answer to one request.
  template <class T, class Ask>
  Result<T> answer(const Ask& ask) {
    std::optional<Result<T>> got;
    ask([&got](Result<T> result) { got = std::move(result); });
    while (!got) world_.loop().step(true);
    return std::move(*got);
  }
  Result<void> write(const std::string& name, const std::string& text) {
    return answer<void>([&](auto done) { files_->write(name, [text] { return text; }, done); });
  }
  Result<std::vector<FlightRecord>> list() {
    return answer<std::vector<FlightRecord>>([&](auto done) { files_->list(done); });
  }
  Result<std::string> read(const std::string& name) {
    return answer<std::string>([&](auto done) { files_->read(name, done); });
  }

  axisd::test::TemporaryDirectory directory_;
  axisd::test::VirtualWorld world_;
  std::optional<FlightFiles> files_;
};

TEST_F(FlightFilesTest, GivesBackWhatWasWritten) {
  open();
  EXPECT_TRUE(list()->empty());
  const auto head = record_head("line-a", "feeder: ErrorStop:\nno reply", TimePoint(5ns), WallTime(1500ms));
  ASSERT_TRUE(write("line-a-1.wire", head + "5 line-a tx 01\n"));
  const auto records = list();
  ASSERT_TRUE(records);
  ASSERT_EQ(records->size(), 1U);
  EXPECT_EQ(records->front().name, "line-a-1.wire");
  EXPECT_EQ(records->front().bus, "line-a");
  EXPECT_EQ(records->front().reason, "feeder: ErrorStop: no reply");
  EXPECT_EQ(records->front().size, head.size() + 15);
  EXPECT_EQ(*read("line-a-1.wire"),
            "# bus: line-a\n# reason: feeder: ErrorStop: no reply\n"
            "# CLOCK_MONOTONIC 5 ns is 1.500000000 s since 1970\n# format: 2\n5 line-a tx 01\n");
}

TEST_F(FlightFilesTest, KeepsTheNewest) {
  open(2);
  for (int i = 1; i <= 5; ++i) {
    const auto name = "a-" + std::to_string(i) + ".wire";
    ASSERT_TRUE(write(name, "x"));
    std::filesystem::last_write_time(directory_ / "flight/" + name,
                                     std::filesystem::file_time_type::clock::now() - (10h - i * 1h));
  }
  ASSERT_TRUE(write("a-6.wire", "x"));
  const auto records = list();
  ASSERT_EQ(records->size(), 2U);
  EXPECT_EQ(records->at(0).name, "a-5.wire");
  EXPECT_EQ(records->at(1).name, "a-6.wire");
}

TEST_F(FlightFilesTest, ReadsNothingButRecords) {
  open();
  ASSERT_TRUE(write("a.wire", "x"));
  std::ofstream(directory_ / "secret.wire") << "y";
  for (const auto* name : {"../secret.wire", "b.wire", "", ".", "a"}) {
    const auto text = read(name);
    ASSERT_FALSE(text) << name;
    EXPECT_EQ(text.error().reason, Reason::invalid_argument);
  }
}

TEST_F(FlightFilesTest, SaysWhyItCannotWrite) {
  std::ofstream(directory_ / "flight") << "a file, no directory";
  open();
  const auto written = write("a.wire", "x");
  ASSERT_FALSE(written);
  EXPECT_EQ(written.error().reason, Reason::storage);
}

TEST_F(FlightFilesTest, FinishesWhatWasAskedForAtItsEnd) {
  open();
  for (int i = 0; i < 3; ++i) files_->write(std::to_string(i) + ".wire", [] { return "x"; }, [](auto) {});
  files_.reset();
  open();
  EXPECT_EQ(list()->size(), 3U);
}

TEST(RecordName, TellsBusAndTime) {
  const auto t = std::chrono::sys_days(std::chrono::year(2026) / 11 / 21) + 13h + 44min + 55s + 123ms;
  EXPECT_EQ(record_name("line-a", t), "line-a-20261121T134455.123Z.wire");
}

}  // namespace
}  // namespace axisd::store
