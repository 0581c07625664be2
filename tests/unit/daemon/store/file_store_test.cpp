#include <gmock/gmock.h>
#include <sys/wait.h>
#include <unistd.h>

#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <csignal>
#include <optional>
#include <random>
#include <thread>

#include "daemon/store/kept_state.hpp"
#include "daemon/store/state_pair.hpp"
#include "tests/support/temporary_directory.hpp"

namespace axisd::store {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

OffsetRecord offset(std::int64_t pulses) {
  return {.offset_pulses = pulses,
          .trust = PositionTrust::homed,
          .canary = {5, 100, 100, 300, 0, 1},
          .last_position_pulses = 10,
          .pulses_per_revolution = 10000,
          .invert = false};
}

/// What is left of it where nobody vouches for it: by its canary a restart of the drive is found.
OffsetRecord distrusted(std::int64_t pulses) {
  auto record = offset(pulses);
  record.trust = PositionTrust::unknown;
  return record;
}

class FileStoreTest : public testing::Test {
 protected:
  /// As a start of the daemon does it, with the journal beside it.
  struct Opened {
    std::unique_ptr<KeptState> kept;
    FileStore* operator->() const { return &kept->state(); }
    explicit operator bool() const { return kept != nullptr; }
  };
  Opened open() {
    auto kept = KeptState::open(temporary_.path(), WallTime(std::chrono::hours(1)), core_.get_executor());
    if (!kept) ADD_FAILURE() << to_string(kept.error());
    return {kept ? *std::move(kept) : nullptr};
  }
  /// Runs the core until `count` results have arrived.
  void wait_for(std::size_t count) {
    while (results_.size() < count) core_.run_one();
  }
  Persistence::Callback record() {
    return [this](Result<void> result) { results_.push_back(std::move(result)); };
  }
  void break_disk() { std::filesystem::create_directory(temporary_.path() / "state.v1.new"); }
  void repair_disk() { std::filesystem::remove(temporary_.path() / "state.v1.new"); }

  test::TemporaryDirectory temporary_;
  boost::asio::io_context core_;
  boost::asio::executor_work_guard<boost::asio::io_context::executor_type> running_ =
      boost::asio::make_work_guard(core_);
  std::vector<Result<void>> results_;
};

TEST_F(FileStoreTest, SavesAreThereAfterARestart) {
  const InhibitRecord inhibit{.active = true, .by = "panel", .since = WallTime(std::chrono::seconds(7))};
  const EepromRecord saves{.saves = 5, .by_hour = {{472'222, 3}}};
  {
    auto store = open();
    store->save_offset("x", offset(1), record());
    store->save_offset("x", offset(2), record());
    store->save_offset("y", offset(3), record());
    store->forget_offset("y", record());
    store->save_inhibit(inhibit, record());
    store->count_eeprom_writes("y", 4, saves, record());
    EXPECT_TRUE(results_.empty()) << "a callback never comes from inside the call";
    wait_for(6);
    for (const auto& result : results_) EXPECT_TRUE(result);
    EXPECT_TRUE(store->loaded().axes.empty()) << "loaded() stays what it was";
  }
  const auto store = open();
  EXPECT_THAT(store->loaded().convictions, IsEmpty());
  EXPECT_EQ(store->loaded().axes.at("x").offset, offset(2));
  EXPECT_EQ(store->loaded().axes.at("y"),
            (AxisRecord{.offset = {}, .eeprom_writes = 4, .holds = {}, .eeprom = saves}));
  EXPECT_EQ(store->loaded().inhibit, inhibit);
}

TEST_F(FileStoreTest, HoldsOutliveARestartUntilTheyAreForgotten) {
  const HoldKey hmi{.holder = "hmi", .request_id = "r1"}, panel{.holder = "panel", .request_id = {}};
  const WallTime noon{std::chrono::hours(12)};
  {
    auto store = open();
    store->save_hold("x", hmi, noon, record());
    store->save_hold("x", panel, noon, record());
    wait_for(2);
    EXPECT_EQ(decode(temporary_.read("state.v1"))->state.axes.at("x").holds.size(), 2U);
  }
  {
    auto store = open();
    EXPECT_EQ(store->loaded().axes.at("x").holds, (HoldRecords{{hmi, noon}, {panel, noon}}));
    store->forget_holds("x", {{hmi, noon}}, record());
    wait_for(3);
    break_disk();
    store->forget_holds("x", {{panel, noon}}, record());
    store->save_hold("y", hmi, noon, record());
    wait_for(5);
    EXPECT_EQ(results_[3].error().reason, Reason::storage);
    EXPECT_EQ(store->current().axes.at("x").holds, (HoldRecords{{panel, noon}})) << "not released";
    repair_disk();
    store->count_eeprom_writes("x", 1, {}, record());
    wait_for(6);
    EXPECT_TRUE(results_[5]);
  }
  const auto store = open();
  EXPECT_EQ(store->loaded().axes.at("x").holds, (HoldRecords{{panel, noon}}));
  EXPECT_EQ(store->loaded().axes.at("y").holds, (HoldRecords{{hmi, noon}})) << "as soon as the disk worked";
}

TEST_F(FileStoreTest, AReportedSaveIsOnTheDiskAlready) {
  auto store = open();
  store->save_offset("x", offset(77), [this](Result<void> result) {
    results_.push_back(std::move(result));
    EXPECT_EQ(decode(temporary_.read("state.v1"))->state.axes.at("x").offset, offset(77));
  });
  wait_for(1);
  EXPECT_TRUE(results_.at(0));
}

TEST_F(FileStoreTest, ClosingSavesWhatIsPending) {
  open()->save_offset("x", offset(1), {});
  EXPECT_EQ(open()->loaded().axes.at("x").offset, offset(1));
}

TEST_F(FileStoreTest, StartsAreCountedStrictly) {
  for (std::uint64_t start = 1; start < 5; ++start) EXPECT_EQ(open()->loaded().start_count, start);
  temporary_.write("state.v1", "damaged");
  EXPECT_EQ(open()->loaded().start_count, 5U + start_count_jump);
  temporary_.write("state.v1", "damaged");
  EXPECT_EQ(open()->loaded().start_count, 6U + 2 * start_count_jump)
      << "a second damage must not repeat a count";
}

TEST_F(FileStoreTest, DamageCostsTrustAndLatchesTheMachine) {
  {
    auto store = open();
    store->save_offset("x", offset(1), {});
    store->count_eeprom_writes("x", 2, {}, record());
    wait_for(1);
    store->save_offset("x", offset(2), record());  // so that the generation before has an offset, too
    wait_for(2);
  }
  temporary_.write("state.v1", temporary_.read("state.v1").substr(1));
  for (int start = 0; start < 2; ++start) {
    const auto store = open();
    EXPECT_THAT(store->loaded().convictions, SizeIs(1)) << "until it is accepted";
    EXPECT_EQ(store->loaded().axes.at("x"),
              (AxisRecord{.offset = distrusted(1), .eeprom_writes = 2, .holds = {}}));
    EXPECT_TRUE(store->loaded().inhibit.active) << "the other two may be old copies";
  }
}

/// Whatever has the names under which damaged files are kept.
TEST_F(FileStoreTest, ADirectoryInTheWayOfADamagedFileBlocksNoStart) {
  {
    ASSERT_TRUE(open());
  }
  for (const std::string name : {"state.v1", "journal.v1"}) {
    std::filesystem::create_directory(temporary_.path() / (name + ".damaged"));
    temporary_.write(name + ".damaged/of-somebody", "else");
  }
  for (const auto* damage : {"first", "second"}) {
    temporary_.write("state.v1", damage);
    temporary_.write("journal.v1", damage);
    {
      const auto store = open();
      ASSERT_TRUE(store);
      EXPECT_FALSE(store->loaded().convictions.empty());
    }
    for (const std::string name : {"state.v1", "journal.v1"}) {
      EXPECT_EQ(temporary_.read(name + ".damaged.2"), damage) << "the newest one is kept";
      EXPECT_EQ(temporary_.read(name + ".damaged/of-somebody"), "else");
    }
  }
}

TEST_F(FileStoreTest, AFailingDiskIsReportedAndGrantsNothing) {
  const InhibitRecord latched{.active = true, .by = "panel", .since = {}};
  {
    auto store = open();
    store->save_offset("x", offset(1), record());
    wait_for(1);
    break_disk();
    store->save_offset("x", offset(2), record());
    store->save_inhibit(latched, record());
    store->count_eeprom_writes("x", 1, {}, record());
    wait_for(4);
    for (std::size_t i = 1; i < 4; ++i) {
      ASSERT_FALSE(results_[i]);
      EXPECT_EQ(results_[i].error().reason, Reason::storage);
    }
    repair_disk();
    store->count_eeprom_writes("x", 1, {}, record());
    wait_for(5);
    EXPECT_TRUE(results_[4]);
  }
  const auto store = open();
  EXPECT_EQ(store->loaded().axes.at("x"), (AxisRecord{.offset = distrusted(2), .eeprom_writes = 2}));
  EXPECT_EQ(store->loaded().inhibit, latched);
}

TEST_F(FileStoreTest, ClosingRetriesWhatFailed) {
  {
    auto store = open();
    break_disk();
    store->save_inhibit({.active = true, .by = "panel", .since = {}}, record());
    wait_for(1);
    ASSERT_FALSE(results_[0]);
    repair_disk();
  }
  EXPECT_TRUE(open()->loaded().inhibit.active);
}

TEST_F(FileStoreTest, AnUnchangedStateIsNotWrittenAgain) {
  auto store = open();
  store->save_offset("x", offset(1), record());
  wait_for(1);
  const auto before = temporary_.read("state.v1");
  store->save_offset("x", offset(1), record());
  wait_for(2);
  EXPECT_TRUE(results_[1]);
  EXPECT_EQ(temporary_.read("state.v1"), before);
}

TEST_F(FileStoreTest, ManySavesShareWrites) {
  auto store = open();
  const auto before = decode(temporary_.read("state.v1"))->number;
  constexpr std::size_t saves = 2000;
  for (std::size_t i = 0; i < saves; ++i)
    store->save_offset("x", offset(static_cast<std::int64_t>(i)), record());
  wait_for(saves);
  const auto generation = decode(temporary_.read("state.v1"));
  EXPECT_EQ(generation->state.axes.at("x").offset, offset(saves - 1));
  EXPECT_LT(generation->number - before, saves);
}

TEST_F(FileStoreTest, OpenFailsClearlyWhereNothingCanBeSaved) {
  break_disk();
  const auto store = KeptState::open(temporary_.path(), {}, core_.get_executor());
  ASSERT_FALSE(store);
  EXPECT_EQ(store.error().reason, Reason::storage);
  EXPECT_FALSE(store.error().remedy.empty());
}

TEST_F(FileStoreTest, ASecondStoreIsRefusedWhileOneIsOpen) {
  const auto store = open();
  const auto second = KeptState::open(temporary_.path(), {}, core_.get_executor());
  ASSERT_FALSE(second);
  EXPECT_THAT(second.error().message, HasSubstr("another axisd"));
}

/// Whoever has an older copy of the journal, made in this run, does not get it past the next start.
TEST_F(FileStoreTest, AtItsEndTheStateKnowsTheWholeJournal) {
  std::string older;
  {
    auto store = open();
    older = temporary_.read("journal.v1");
    auto& journal = store.kept->journal();
    const Command command{.id = "1", .axis = "x", .request_id = "r1", .client = "c"};
    journal.accepted(command, "d");
    journal.sending(command, {}, record());
    wait_for(1);
    journal.ended(command);
  }
  EXPECT_THAT(open()->loaded().convictions, IsEmpty());
  temporary_.write("journal.v1", older);
  const auto store = open();
  ASSERT_THAT(store->loaded().convictions, SizeIs(1));
  EXPECT_EQ(store->loaded().convictions[0].fault, KeptFault::rolled_back);
  EXPECT_EQ(temporary_.read("journal.v1.damaged"), older);
}

/// The journal's disk fails, the state file's does not.
struct BrokenWitness final : StateWitness {
  bool failing = false;
  std::vector<StateLine> told;
  Result<void> note(StateLine line) override {
    told.push_back(std::move(line));
    if (failing) return fail(Reason::storage, "full", "free space");
    return {};
  }
  [[nodiscard]] std::uint64_t durable_line() const override { return 0; }
  [[nodiscard]] std::uint64_t durable_fact() const override { return 0; }
};

TEST_F(FileStoreTest, WhatIsInOneFileOnlyIsNotGranted) {
  BrokenWitness witness;
  {
    auto directory = StateDirectory::open(temporary_.path());
    ASSERT_TRUE(directory);
    auto begun =
        FileStore::begin(*std::move(directory), {.journal = {.pair = "p"}}, {}, core_.get_executor());
    ASSERT_TRUE(begun);
    const auto store = *std::move(begun);
    ASSERT_TRUE(store->serve(witness));
    EXPECT_EQ(witness.told.back().generation, 2U);
    store->save_inhibit({.active = true, .by = "panel", .since = {}}, record());
    wait_for(1);
    EXPECT_TRUE(results_[0]);
    EXPECT_TRUE(witness.told.back().inhibit.active);
    witness.failing = true;
    store->save_inhibit({.active = false, .by = "hmi", .since = {}}, record());
    wait_for(2);
    EXPECT_EQ(results_[1].error().reason, Reason::storage);
    EXPECT_TRUE(decode(temporary_.read("state.v1"))->state.inhibit.active)
        << "the release does not stand there";
    witness.failing = false;
    break_disk();
    store->save_hold("x", {.holder = "hmi", .request_id = {}}, {}, record());
    store->save_inhibit({.active = false, .by = "hmi", .since = {}}, record());
    wait_for(4);
    EXPECT_FALSE(results_[2]);
    EXPECT_TRUE(witness.told.back().inhibit.active);
    EXPECT_EQ(witness.told.back().holds.size(), 1U) << "what the state file could not take";
    repair_disk();
  }
  EXPECT_TRUE(decode(temporary_.read("state.v1"))->state.inhibit.active);
}

/// As of an axis that rests there.
OffsetRecord at(std::int64_t pulses) {
  auto record = offset(1);
  record.last_position_pulses = pulses;
  record.canary[0] = static_cast<std::uint16_t>(pulses);
  return record;
}

/// A file store alone, with delays of its own, and an axis that rests at 0.
class SaveDelaysTest : public FileStoreTest {
 protected:
  void begin(SaveDelays delays) {
    auto directory = StateDirectory::open(temporary_.path());
    if (!directory) ADD_FAILURE() << to_string(directory.error());
    auto begun =
        FileStore::begin(*std::move(directory), {.journal = {.pair = "p"}}, {}, core_.get_executor(), delays);
    ASSERT_TRUE(begun && (*begun)->serve(witness_));
    store_ = *std::move(begun);
    store_->save_offset("x", at(0), record());
    wait_for(1);
    told_ = witness_.told.size();
  }
  [[nodiscard]] std::optional<OffsetRecord> saved() const {
    return decode(temporary_.read("state.v1"))->state.axes.at("x").offset;
  }
  [[nodiscard]] std::size_t writes() const { return witness_.told.size() - told_; }
  /// Ends with the test's time limit where it is never saved.
  void wait_until_saved(const std::optional<OffsetRecord>& record) const {
    while (saved() != record) std::this_thread::yield();
  }
  static constexpr SaveDelays never{.settled = std::chrono::hours(1), .latest = std::chrono::hours(1)};

  BrokenWitness witness_;
  std::unique_ptr<FileStore> store_;  // ends first
  std::size_t told_ = 0;
};

TEST_F(SaveDelaysTest, WhereAnAxisRestsSharesTheNextWrite) {
  begin(never);
  for (std::int64_t pulses = 1; pulses <= 20; ++pulses) store_->save_offset("x", at(pulses), {});
  EXPECT_EQ(store_->current().axes.at("x").offset, at(20));
  store_->save_hold("x", {.holder = "hmi", .request_id = {}}, {}, record());
  wait_for(2);
  EXPECT_TRUE(results_[1]);
  EXPECT_EQ(saved(), at(20));
  EXPECT_EQ(writes(), 1U);
}

TEST_F(SaveDelaysTest, ASaveThatSomebodyWaitsForIsNotDelayed) {
  begin(never);
  store_->save_offset("x", at(1), {});
  store_->save_offset("x", at(2), record());
  wait_for(2);
  EXPECT_EQ(saved(), at(2));
}

/// The record on the disk fits where the axis stands: a restart would find it.
TEST_F(SaveDelaysTest, WhatTheCounterMeansIsSavedAtOnce) {
  begin(never);
  auto meaning = at(0);
  meaning.offset_pulses = 7;
  store_->save_offset("x", meaning, {});
  wait_until_saved(meaning);
  meaning.trust = PositionTrust::set;
  store_->save_offset("x", meaning, {});
  wait_until_saved(meaning);
  meaning.canary = {9, 9, 9, 9, 9, 9};
  store_->save_offset("x", meaning, {});
  wait_until_saved(meaning);
  store_->forget_offset("x", {});
  wait_until_saved(std::nullopt);
  store_->save_offset("x", at(1), {});
  wait_until_saved(at(1));
}

TEST_F(SaveDelaysTest, WhereAnAxisRestsIsSavedWhenItGoesOnResting) {
  begin({.settled = std::chrono::milliseconds(1), .latest = std::chrono::hours(1)});
  store_->save_offset("x", at(1), {});
  wait_until_saved(at(1));
}

TEST_F(SaveDelaysTest, WhereAnAxisRestsIsSavedAtTheLatestWhateverElseComes) {
  begin({.settled = std::chrono::hours(1), .latest = std::chrono::milliseconds(1)});
  store_->save_offset("x", at(1), {});
  store_->save_offset("x", at(2), {});
  wait_until_saved(at(2));
}

TEST_F(SaveDelaysTest, ClosingWaitsForNoDelay) {
  begin(never);
  store_->save_offset("x", at(3), {});
  store_->close();
  EXPECT_EQ(saved(), at(3));
}

/// Saves rising offsets without end and reports each durable one through `acknowledge`.
[[noreturn]] void save_until_killed(const std::filesystem::path& directory, int acknowledge) {
  boost::asio::io_context core;
  const auto guard = boost::asio::make_work_guard(core);
  auto store = KeptState::open(directory, std::chrono::system_clock::now(), core.get_executor());
  if (!store) _exit(1);
  std::function<void(std::int64_t)> save = [&](std::int64_t number) {
    (*store)->state().save_offset("x", offset(number), [&, number](const Result<void>& result) {
      if (!result || write(acknowledge, &number, sizeof number) != sizeof number) _exit(2);
      save(number + 1);
    });
  };
  const auto& loaded = (*store)->state().loaded().axes;
  save(loaded.contains("x") ? loaded.at("x").offset->offset_pulses + 1 : 1);
  core.run();
  (void)guard;
  _exit(3);
}

TEST_F(FileStoreTest, NoAcknowledgedSaveIsLostByAKill) {
  std::mt19937 random(7);
  std::int64_t last = 0;
  for (int round = 0; round < 10; ++round) {
    int channel[2];
    ASSERT_EQ(pipe(channel), 0);
    const pid_t child = fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
      close(channel[0]);
      save_until_killed(temporary_.path(), channel[1]);
    }
    close(channel[1]);
    const auto wanted = random() % 12;  // killed at another point of its work each time
    for (std::uint32_t i = 0; i <= wanted; ++i) ASSERT_EQ(read(channel[0], &last, sizeof last), sizeof last);
    kill(child, SIGKILL);
    int status = 0;
    ASSERT_EQ(waitpid(child, &status, 0), child);
    ASSERT_TRUE(WIFSIGNALED(status)) << WEXITSTATUS(status);
    while (read(channel[0], &last, sizeof last) == sizeof last) {  // acknowledged before the kill
    }
    close(channel[0]);

    const auto store = open();
    ASSERT_TRUE(store);
    EXPECT_THAT(store->loaded().convictions, IsEmpty());
    EXPECT_GE(store->loaded().axes.at("x").offset->offset_pulses, last);
    EXPECT_EQ(store->loaded().start_count, 2U * static_cast<unsigned>(round) + 2U);
  }
}

}  // namespace
}  // namespace axisd::store
