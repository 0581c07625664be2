#include "daemon/store/id_files.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "daemon/store/id_blocks.hpp"
#include "tests/support/temporary_directory.hpp"

namespace axisd::store {
namespace {

using std::chrono::minutes;

ClientRun run_of(const std::string& client, int count, Duration at) {
  const Command command{.id = "i-7", .state = CommandState::done};
  std::vector<std::string> names;
  names.reserve(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) names.push_back(fmt::format("{}", i));
  std::vector<EndedId> ids;
  ids.reserve(names.size());
  for (const auto& name : names)
    ids.push_back({.request_id = name, .digest = "d", .command = &command, .heard_of = TimePoint(at)});
  return {.client = client, .run = runs_of(std::move(ids)).front()};
}

void expect_same(const ClientRun& a, const ClientRun& b) {
  EXPECT_EQ(a.client, b.client);
  EXPECT_EQ(a.run.instance, b.run.instance);
  EXPECT_EQ(a.run.last_number, b.run.last_number);
  EXPECT_EQ(a.run.begin, b.run.begin);
  EXPECT_EQ(a.run.newest, b.run.newest);
  EXPECT_EQ(a.run.records, b.run.records);
}

TEST(IdBlocks, AreReadAsTheyWereWritten) {
  const std::vector<ClientRun> first = {run_of("tls:hmi 1", 30, minutes(1)), run_of("", 1, minutes(2))};
  const std::vector<ClientRun> second = {run_of("b", 3, minutes(-3))};
  const auto bytes = encode_ids(first) + encode_ids(second);
  const auto read = decode_ids(bytes);
  EXPECT_EQ(read.good, bytes.size());
  ASSERT_EQ(read.runs.size(), 3);
  expect_same(read.runs[0], first[0]);
  expect_same(read.runs[1], first[1]);
  expect_same(read.runs[2], second[0]);
}

TEST(IdBlocks, NoFlippedBitAndNoCutIsAccepted) {
  const auto first = encode_ids({run_of("a", 2, minutes(1))});
  const auto both = first + encode_ids({run_of("b", 3, minutes(1))});
  for (std::size_t size = first.size(); size < both.size(); ++size) {
    const auto read = decode_ids(std::string_view(both).substr(0, size));
    EXPECT_EQ(read.good, first.size());
    EXPECT_EQ(read.runs.size(), 1);
  }
  for (std::size_t bit = 8 * first.size(); bit < 8 * both.size(); ++bit) {
    auto flipped = both;
    flipped[bit / 8] = static_cast<char>(flipped[bit / 8] ^ (1 << (bit % 8)));
    EXPECT_EQ(decode_ids(flipped).good, first.size()) << bit;
  }
}

class IdFilesTest : public testing::Test {
 protected:
  std::string name(std::uint32_t file) const { return fmt::format("journal-ids-{}.v1", file); }

  test::TemporaryDirectory temporary_;
  std::unique_ptr<JournalDisk> disk_ = open_journal_disk(temporary_.path()).value();
};

TEST_F(IdFilesTest, AreFilledOneAfterTheOther) {
  std::vector<IdsLine> files;
  for (int minute = 0; minute < 12; ++minute) {
    const auto line = append_ids(*disk_, files, {run_of("a", 100, minutes(minute))}).value();
    if (!files.empty() && files.back().file == line.file) files.pop_back();
    files.push_back(line);
  }
  ASSERT_EQ(files.size(), 2);
  EXPECT_EQ(files[0].count, 600);
  EXPECT_EQ(files[1].newest, minutes(11));
  const auto load = load_ids(*disk_, files).value();
  EXPECT_EQ(load.damage, "");
  EXPECT_EQ(load.runs.size(), 12);
  EXPECT_EQ(load.files, files);
}

TEST_F(IdFilesTest, WhatTheJournalDoesNotNameDoesNotCount) {
  const auto line = append_ids(*disk_, {}, {run_of("a", 5, minutes(1))}).value();
  (void)append_ids(*disk_, {line}, {run_of("lost", 5, minutes(1))});
  EXPECT_EQ(load_ids(*disk_, {line})->runs.size(), 1);
  const auto again = append_ids(*disk_, {line}, {run_of("b", 5, minutes(1))}).value();
  const auto load = load_ids(*disk_, {again}).value();
  ASSERT_EQ(load.runs.size(), 2);
  EXPECT_EQ(load.runs[1].client, "b");
  (void)append_ids(*disk_, {IdsLine{.file = 8, .bytes = std::uint64_t{2} << 20U}},
                   {run_of("c", 1, minutes(1))});
  disk_->keep_ids({1});
  EXPECT_TRUE(std::filesystem::exists(temporary_.path() / name(1)));
  EXPECT_FALSE(std::filesystem::exists(temporary_.path() / name(9)));
}

TEST_F(IdFilesTest, DamageIsToldAndTheRestIsRead) {
  const auto one = append_ids(*disk_, {}, {run_of("a", 5, minutes(1))}).value();
  const auto two = append_ids(*disk_, {one}, {run_of("b", 5, minutes(1))}).value();
  auto bytes = temporary_.read(name(1));
  bytes[bytes.size() - 3] = static_cast<char>(bytes[bytes.size() - 3] ^ 1);
  temporary_.write(name(1), bytes);
  const auto load = load_ids(*disk_, {two}).value();
  EXPECT_NE(load.damage, "");
  EXPECT_EQ(load.runs.size(), 1);
  EXPECT_EQ(load.files.front().bytes, one.bytes);
  std::filesystem::remove(temporary_.path() / name(1));
  EXPECT_NE(load_ids(*disk_, {two})->damage, "") << "it is gone";
}

TEST_F(IdFilesTest, AreKeptByAgeAndWithinTheirBound) {
  std::vector<IdsLine> files;
  files.reserve(40);
  for (std::uint32_t i = 0; i < 40; ++i)
    files.push_back({.file = i, .bytes = 1, .count = 1'000, .begin = minutes(i), .newest = minutes(i)});
  const auto numbers = [](const std::vector<IdsLine>& kept) {
    return std::pair(kept.front().file, kept.back().file);
  };
  EXPECT_EQ(numbers(still_needed(files, minutes(39), {.most = 1'000'000})), std::pair(9U, 39U));
  EXPECT_EQ(numbers(still_needed(files, minutes(39), {.most = 20'000})), std::pair(20U, 39U));
  EXPECT_EQ(numbers(still_needed(files, minutes(39), {.most = 1})), std::pair(28U, 39U))
      << "11 minutes in any case";
}

}  // namespace
}  // namespace axisd::store
