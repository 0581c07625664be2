// How far the journal had come is known to the state file, so that a start recognises one that was cut.
#include <gmock/gmock.h>

#include <array>
#include <atomic>
#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <thread>

#include "daemon/store/kept_state.hpp"
#include "tests/support/temporary_directory.hpp"

namespace axisd::store {
namespace {

using testing::IsEmpty;
using testing::SizeIs;

Command command(const std::string& id) { return {.id = id, .axis = "x", .request_id = id, .client = "c"}; }

class KnownJournalTest : public testing::Test {
 protected:
  std::unique_ptr<KeptState> open() {
    auto kept = KeptState::open(temporary_.path(), WallTime(std::chrono::hours(1)), core_.get_executor());
    if (!kept) throw std::runtime_error(to_string(kept.error()));
    return *std::move(kept);
  }
  /// Runs the core until `count` results have arrived.
  void wait_for(std::size_t count) {
    while (results_.size() < count) core_.run_one();
  }
  Persistence::Callback record() {
    return [this](Result<void> result) { results_.push_back(std::move(result)); };
  }

  test::TemporaryDirectory temporary_;
  boost::asio::io_context core_;
  boost::asio::executor_work_guard<boost::asio::io_context::executor_type> running_ =
      boost::asio::make_work_guard(core_);
  std::vector<Result<void>> results_;
};

/// What the state file has to know of: neither what it told itself, nor the time.
TEST_F(KnownJournalTest, AFactIsWhatNobodyElseKnows) {
  const auto kept = open();
  auto& journal = kept->journal();
  const auto before = journal.durable_fact();
  ASSERT_TRUE(journal.note({.pair = "p", .generation = 1}));
  ASSERT_TRUE(journal.note({.pair = "p", .generation = 2}));
  EXPECT_EQ(journal.durable_fact(), before);
  const auto line = journal.durable_line();
  EXPECT_GT(line, before);
  journal.accepted(command("1"), "one");
  journal.sending(command("1"), {}, record());
  wait_for(1);
  EXPECT_GT(journal.durable_fact(), line);
  EXPECT_EQ(journal.durable_fact(), journal.durable_line());
  ASSERT_TRUE(journal.note({.pair = "p", .generation = 3}));
  EXPECT_LT(journal.durable_fact(), journal.durable_line());
}

/// Wherever the journal is cut after the daemon has ended, no start takes what was sent for not sent.
TEST_F(KnownJournalTest, AJournalThatWasCutAfterTheEndIsRecognised) {
  {
    const auto kept = open();
    auto& journal = kept->journal();
    for (const auto* id : {"1", "2"}) {
      journal.accepted(command(id), "d");
      journal.sending(command(id), {}, record());
      wait_for(results_.size() + 1);
      // Of this the files tell each other while the next one comes.
      kept->state().save_offset("x", {.offset_pulses = std::stoi(id)}, record());
    }
    wait_for(4);
  }
  const auto whole = temporary_.read("journal.v1"), state = temporary_.read("state.v1"),
             previous = temporary_.read("state.v1.previous");
  const auto sent = whole.find(" sending id=2 ");
  ASSERT_NE(sent, std::string::npos);
  const auto end_of_line = whole.find('\n', sent);
  for (std::size_t cut = journal_header.size(); cut < end_of_line; cut += 61) {
    // In the middle of a line, and behind the one before.
    for (const auto size : {cut, whole.rfind('\n', cut) + 1}) {
      temporary_.write("journal.v1", whole.substr(0, size));
      temporary_.write("state.v1", state);
      temporary_.write("state.v1.previous", previous);
      EXPECT_THAT(open()->state().loaded().convictions, SizeIs(1)) << size;
    }
  }
}

/// Also right after it was written, when the state file does not know of it: what a kill left, and somebody
/// cut.
TEST_F(KnownJournalTest, AJournalThatWasCutRightAfterAKillIsRecognised) {
  std::array<std::string, 4> left;
  const std::array names{"state.v1", "state.v1.previous", "journal-mark.v1", "journal.v1"};
  {
    const auto kept = open();
    kept->journal().accepted(command("1"), "d");
    kept->journal().sending(command("1"), {}, record());
    wait_for(1);
    for (std::size_t i = 0; i < names.size(); ++i) left.at(i) = temporary_.read(names.at(i));
  }
  const auto put_back = [&](const std::string& journal) {
    for (std::size_t i = 0; i + 1 < names.size(); ++i) temporary_.write(names.at(i), left.at(i));
    temporary_.write("journal.v1", journal);
  };
  put_back(left.back());
  EXPECT_THAT(open()->state().loaded().convictions, IsEmpty());
  const auto accepted = left.back().find(" accepted id=1 ");
  ASSERT_NE(accepted, std::string::npos);
  put_back(left.back().substr(0, left.back().rfind('\n', accepted) + 1));
  EXPECT_THAT(open()->state().loaded().convictions, SizeIs(1));
}

/// A journal that others write to as well.
struct BusyWitness final : StateWitness {
  std::atomic<std::uint64_t> line = 0, fact = 0;
  std::atomic<int> meanwhile = 0;  ///< facts that are written right before it is told of a save
  void write_fact() { fact = ++line; }
  Result<void> note(StateLine /*line*/) override {
    for (; meanwhile > 0; --meanwhile) write_fact();
    ++line;
    return {};
  }
  [[nodiscard]] std::uint64_t durable_line() const override { return line; }
  [[nodiscard]] std::uint64_t durable_fact() const override { return fact; }
};

class BusyJournal : public KnownJournalTest {
 protected:
  void begin(Duration known) {
    auto directory = StateDirectory::open(temporary_.path());
    ASSERT_TRUE(directory);
    auto begun = FileStore::begin(*std::move(directory), {.journal = {.pair = "p"}}, {}, core_.get_executor(),
                                  {.known = known});
    ASSERT_TRUE(begun && (*begun)->serve(witness_));
    store_ = *std::move(begun);
  }
  [[nodiscard]] std::uint64_t mark() const { return decode(temporary_.read("state.v1"))->journal.line; }

  BusyWitness witness_;
  std::unique_ptr<FileStore> store_;  // ends first
};

/// A single line, of which the state file is told together with its own save.
TEST_F(BusyJournal, IsKnownWholeAtTheEndWhateverCameBetween) {
  begin(std::chrono::hours(1));
  witness_.meanwhile = 1;
  store_->save_offset("x", {.offset_pulses = 1}, record());
  wait_for(1);
  EXPECT_LT(mark(), witness_.fact.load());
  witness_.meanwhile = 1;
  store_->close();
  EXPECT_GE(mark(), witness_.fact.load());
}

TEST_F(BusyJournal, IsKnownInTimeWhileSavesThatChangeNothingCome) {
  begin(std::chrono::milliseconds(1));
  witness_.write_fact();
  while (mark() < witness_.fact) {  // ends with the test's time limit where it is never known
    store_->save_inhibit({}, {});
    std::this_thread::yield();
  }
}

TEST_F(BusyJournal, IsKnownInTimeWhereNothingIsSaved) {
  begin(std::chrono::milliseconds(1));
  witness_.meanwhile = 1;
  store_->save_offset("x", {.offset_pulses = 1}, record());
  wait_for(1);
  while (mark() < witness_.fact) std::this_thread::yield();
  const auto last = temporary_.read("state.v1");
  store_->close();
  EXPECT_EQ(temporary_.read("state.v1"), last) << "nothing new: nothing is written";
}

}  // namespace
}  // namespace axisd::store
