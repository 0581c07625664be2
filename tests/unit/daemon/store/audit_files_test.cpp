#include "daemon/store/audit_files.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <chrono>
#include <filesystem>
#include <string>
#include <vector>

#include "tests/support/temporary_directory.hpp"

namespace axisd::store {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;
using testing::SizeIs;

class AuditFilesTest : public testing::Test {
 protected:
  std::filesystem::path directory() const { return temporary_.path() / "audit"; }
  /// Some lines of 10 bytes, each of which says its number.
  static void add(AuditFiles& files, int count) {
    for (int i = 0; i < count; ++i) {
      const auto line = fmt::format("{:09}\n", files.newest() + 1);
      const auto added = files.append(line, 1);
      ASSERT_TRUE(added) << to_string(added.error());
    }
  }
  AuditFiles open(AuditBounds bounds = {}) const {
    AuditFiles files(directory(), bounds);
    const auto opened = files.open();
    EXPECT_TRUE(opened) << to_string(opened.error());
    return files;
  }
  std::vector<std::string> names() const {
    std::vector<std::string> all;
    for (const auto& entry : std::filesystem::directory_iterator(directory()))
      all.push_back(entry.path().filename().string());
    std::ranges::sort(all);
    return all;
  }
  /// Numbers of the lines, and where the look ended.
  std::pair<std::vector<int>, AuditSeen> look(std::uint64_t after, std::uint64_t newest,
                                              std::size_t most = 1'000, WallTime since = {}) const {
    std::vector<int> numbers;
    const auto seen = look_at_audit(directory(), after, newest, since, most, [&](std::string_view line) {
      numbers.push_back(std::stoi(std::string(line)));
      return true;
    });
    EXPECT_TRUE(seen);
    return {numbers, seen.value_or(AuditSeen{})};
  }

  test::TemporaryDirectory temporary_;
};

TEST_F(AuditFilesTest, NumbersGoOnOverARestart) {
  {
    auto files = open();
    EXPECT_EQ(files.newest(), 0U);
    add(files, 3);
    EXPECT_TRUE(files.sync());
  }
  auto files = open();
  EXPECT_EQ(files.newest(), 3U);
  add(files, 1);
  EXPECT_THAT(names(), ElementsAre("audit-000000000001.jsonl"));
  EXPECT_THAT(look(0, 4).first, ElementsAre(1, 2, 3, 4));
}

TEST_F(AuditFilesTest, TheOldestFilesGo) {
  auto files = open({.files = 3, .file_bytes = 30});
  add(files, 14);
  EXPECT_THAT(names(), ElementsAre("audit-000000000007.jsonl", "audit-000000000010.jsonl",
                                   "audit-000000000013.jsonl"));
  const auto [numbers, seen] = look(0, 14);
  EXPECT_THAT(numbers, ElementsAre(7, 8, 9, 10, 11, 12, 13, 14));
  EXPECT_EQ(seen.oldest, 7U);
  EXPECT_EQ(seen.cursor, 14U);
}

TEST_F(AuditFilesTest, WhatWasNotWrittenWholeIsCutOff) {
  {
    auto files = open();
    add(files, 2);
  }
  temporary_.write("audit/audit-000000000001.jsonl", "000000001\n000000002\n0000");
  auto files = open();
  EXPECT_EQ(files.newest(), 2U);
  add(files, 1);
  EXPECT_EQ(temporary_.read("audit/audit-000000000001.jsonl"), "000000001\n000000002\n000000003\n");
}

TEST_F(AuditFilesTest, ALookGoesOnWithItsCursor) {
  auto files = open({.files = 9, .file_bytes = 30});
  add(files, 8);
  EXPECT_THAT(look(5, 8).first, ElementsAre(6, 7, 8));
  EXPECT_THAT(look(8, 8).first, IsEmpty());
  EXPECT_EQ(look(99, 8).second.cursor, 8U);
  std::vector<int> all;
  for (std::uint64_t cursor = 0; cursor < 8;) {
    const auto [numbers, seen] = look(cursor, 8, 2);
    ASSERT_THAT(numbers, SizeIs(2));
    all.insert(all.end(), numbers.begin(), numbers.end());
    cursor = seen.cursor;
  }
  EXPECT_THAT(all, ElementsAre(1, 2, 3, 4, 5, 6, 7, 8));
  // What is being written now is not looked at.
  EXPECT_THAT(look(0, 4).first, ElementsAre(1, 2, 3, 4));
}

TEST_F(AuditFilesTest, OlderFilesAreLeftOut) {
  auto files = open({.files = 9, .file_bytes = 30});
  add(files, 7);
  const auto old = std::filesystem::file_time_type::clock::now() - std::chrono::hours(2);
  for (const auto* name : {"audit-000000000001.jsonl", "audit-000000000004.jsonl"})
    std::filesystem::last_write_time(directory() / name, old);
  const auto now = std::chrono::system_clock::now();
  EXPECT_THAT(look(0, 7, 1'000, now - std::chrono::hours(1)).first, ElementsAre(7));
  EXPECT_THAT(look(0, 7, 1'000, now - std::chrono::hours(3)).first, SizeIs(7));
}

TEST_F(AuditFilesTest, OtherFilesAreLeftAlone) {
  {
    auto files = open();
    add(files, 1);
  }
  temporary_.write("audit/audit-1.jsonl", "x\n");
  temporary_.write("audit/notes.txt", "x\n");
  EXPECT_EQ(open().newest(), 1U);
  EXPECT_THAT(names(), SizeIs(3));
}

TEST_F(AuditFilesTest, NeitherALinkNorADirectoryIsWrittenTo) {
  std::filesystem::create_directories(directory());
  temporary_.write("elsewhere", "kept\n");
  std::filesystem::create_symlink(temporary_.path() / "elsewhere", directory() / "audit-000000000001.jsonl");
  AuditFiles files(directory(), {});
  const auto opened = files.open();
  ASSERT_FALSE(opened);
  EXPECT_EQ(opened.error().reason, Reason::storage);
  EXPECT_EQ(temporary_.read("elsewhere"), "kept\n");
}

TEST_F(AuditFilesTest, NothingIsThereBeforeTheFirstLine) {
  const auto [numbers, seen] = look(0, 0);
  EXPECT_THAT(numbers, IsEmpty());
  EXPECT_EQ(seen.oldest, 0U);
}

}  // namespace
}  // namespace axisd::store
