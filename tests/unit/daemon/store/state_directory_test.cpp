#include "daemon/store/state_directory.hpp"

#include <gmock/gmock.h>

#include "daemon/store/state_pair.hpp"
#include "tests/support/temporary_directory.hpp"

namespace axisd::store {
namespace {

using testing::HasSubstr;

Generation generation(std::uint64_t number) {
  Generation result{.number = number, .state = {}};
  result.state.axes["x"].eeprom_writes = number;
  return result;
}

/// Opens, judges and closes again, as a start would; without a journal.
Result<Verdict> load(const std::filesystem::path& path) {
  auto directory = StateDirectory::open(path);
  if (!directory) return std::unexpected(directory.error());
  auto found = directory->find();
  if (!found) return std::unexpected(found.error());
  return judge({.state = found->newest, .previous = found->previous}, {}, {});
}

class StateDirectoryTest : public testing::Test {
 protected:
  void save(std::uint64_t number) {
    auto directory = StateDirectory::open(temporary_.path());
    ASSERT_TRUE(directory);
    ASSERT_TRUE(directory->save(encode(generation(number))));
  }
  void expect_loads(std::uint64_t number, bool damaged = false) {
    const auto loaded = load(temporary_.path());
    ASSERT_TRUE(loaded) << to_string(loaded.error());
    EXPECT_EQ(loaded->state.number, number);
    EXPECT_EQ(loaded->state.state.axes, generation(number).state.axes);
    EXPECT_EQ(!loaded->fresh.empty(), damaged);
  }
  test::TemporaryDirectory temporary_;
};

TEST_F(StateDirectoryTest, AnEmptyDirectoryIsAFreshStart) {
  const auto loaded = load(temporary_.path() / "made" / "here");
  ASSERT_TRUE(loaded);
  EXPECT_EQ(loaded->state.number, 0U);
  EXPECT_TRUE(loaded->fresh.empty());
}

TEST_F(StateDirectoryTest, KeepsTheGenerationBefore) {
  save(1);
  expect_loads(1);
  EXPECT_EQ(temporary_.read("state.v1.previous"), "");
  save(2);
  save(3);
  expect_loads(3);
  EXPECT_EQ(temporary_.read("state.v1.previous"), encode(generation(2)));
}

TEST_F(StateDirectoryTest, ADamagedFileFallsBackAndSaysSo) {
  save(1);
  save(2);
  for (const auto* text : {"", "axisd-state 1\n", "\0\0\0\0"}) {
    temporary_.write("state.v1", text);
    expect_loads(1, true);
  }
  std::filesystem::remove(temporary_.path() / "state.v1");
  expect_loads(1, true);
}

TEST_F(StateDirectoryTest, BothDamagedIsAnErrorThatSaysWhatToDo) {
  save(1);
  save(2);
  temporary_.write("state.v1", "x");
  temporary_.write("state.v1.previous", "y");
  const auto loaded = load(temporary_.path());
  ASSERT_FALSE(loaded);
  EXPECT_EQ(loaded.error().reason, Reason::storage);
  EXPECT_THAT(loaded.error().message, HasSubstr("state.v1"));
  EXPECT_THAT(loaded.error().remedy, HasSubstr("homing"));
}

TEST_F(StateDirectoryTest, ANewerFormatIsNotTakenForDamage) {
  save(1);
  save(2);
  const std::string body = "axisd-state 3\nmore\n";
  char checksum[16];
  std::snprintf(checksum, sizeof checksum, "crc32 %08x\n", crc32(body));
  temporary_.write("state.v1", body + checksum);
  const auto loaded = load(temporary_.path());
  ASSERT_FALSE(loaded);
  EXPECT_THAT(loaded.error().message, HasSubstr("newer"));
}

TEST_F(StateDirectoryTest, AnOversizedFileIsDamagedNotRead) {
  save(1);
  save(2);
  std::filesystem::resize_file(temporary_.path() / "state.v1", 1ULL << 40U);  // sparse
  expect_loads(1, true);
}

TEST_F(StateDirectoryTest, ADamagedFileSetAsideNeverBecomesThePreviousOne) {
  save(1);
  save(2);
  temporary_.write("state.v1", "x");
  {
    auto directory = StateDirectory::open(temporary_.path());
    ASSERT_TRUE(directory);
    ASSERT_TRUE(directory->set_aside(KeptFile::state));
  }
  EXPECT_EQ(temporary_.read("state.v1.damaged"), "x");
  expect_loads(1, true);
  save(2);
  expect_loads(2);
  EXPECT_EQ(temporary_.read("state.v1.previous"), encode(generation(1)));
}

TEST_F(StateDirectoryTest, WhatWasKeptStaysWhereThereIsNothingToKeep) {
  save(1);
  temporary_.write("state.v1.previous.damaged", "of before");
  auto directory = StateDirectory::open(temporary_.path());
  ASSERT_TRUE(directory);
  EXPECT_TRUE(directory->set_aside(KeptFile::previous));
  EXPECT_EQ(temporary_.read("state.v1.previous.damaged"), "of before");
}

// Each state in which a power cut can leave the directory, in the order of save()'s steps.
TEST_F(StateDirectoryTest, EveryInterruptedSaveLeavesACompleteGeneration) {
  namespace fs = std::filesystem;
  save(1);
  save(2);
  const auto at = [this](const char* name) { return temporary_.path() / name; };
  const auto text = encode(generation(3));

  for (std::size_t length = 0; length <= text.size(); length += 7) {
    temporary_.write("state.v1.new", text.substr(0, length));
    expect_loads(2);
  }
  temporary_.write("state.v1.new", text);
  fs::create_hard_link(at("state.v1"), at("state.v1.previous.new"));
  expect_loads(2);
  fs::rename(at("state.v1.previous.new"), at("state.v1.previous"));
  expect_loads(2);
  EXPECT_EQ(fs::hard_link_count(at("state.v1")), 2U);

  save(3);  // goes through over what the interruption left
  expect_loads(3);
  EXPECT_EQ(temporary_.read("state.v1.previous"), encode(generation(2)));
  save(4);
  expect_loads(4);
  EXPECT_EQ(temporary_.read("state.v1.previous"), encode(generation(3)));
}

TEST_F(StateDirectoryTest, TwoDaemonsCannotShareIt) {
  auto first = StateDirectory::open(temporary_.path());
  ASSERT_TRUE(first);
  const auto second = StateDirectory::open(temporary_.path());
  ASSERT_FALSE(second);
  EXPECT_EQ(second.error().reason, Reason::storage);
  EXPECT_THAT(second.error().message, HasSubstr("another axisd"));
  first = fail(Reason::internal, "closes it");
  EXPECT_TRUE(StateDirectory::open(temporary_.path()));
}

TEST_F(StateDirectoryTest, AnUnusablePathIsAClearError) {
  temporary_.write("file", "");
  const auto directory = StateDirectory::open(temporary_.path() / "file");
  ASSERT_FALSE(directory);
  EXPECT_THAT(directory.error().message, HasSubstr("file"));
  EXPECT_THAT(directory.error().remedy, HasSubstr("--state-directory"));
}

TEST_F(StateDirectoryTest, AFailedSaveIsAnErrorAndLeavesTheFilesAlone) {
  save(1);
  auto directory = StateDirectory::open(temporary_.path());
  ASSERT_TRUE(directory);
  std::filesystem::create_directory(temporary_.path() / "state.v1.new");
  const auto saved = directory->save(encode(generation(2)));
  ASSERT_FALSE(saved);
  EXPECT_EQ(saved.error().reason, Reason::storage);
  EXPECT_THAT(saved.error().message, HasSubstr("state.v1.new"));
  EXPECT_EQ(directory->find()->newest.text, encode(generation(1)));
}

}  // namespace
}  // namespace axisd::store
