#include "daemon/store/journal_file.hpp"

#include <gmock/gmock.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <csignal>
#include <optional>
#include <set>
#include <thread>

#include "tests/support/temporary_directory.hpp"

namespace axisd::store {
namespace {

using testing::HasSubstr;

/// A disk that can be full.
struct Faults {
  std::atomic<bool> append{false}, sync{false}, replace{false};
  std::atomic<int> syncs{0};  ///< those asked for
};
class FaultyDisk final : public JournalDisk {
 public:
  FaultyDisk(std::unique_ptr<JournalDisk> disk, std::shared_ptr<Faults> faults)
      : disk_(std::move(disk)), faults_(std::move(faults)) {}
  Result<FoundFile> read() override { return disk_->read(); }
  Result<void> append(std::string_view text) override {
    if (!faults_->append) return disk_->append(text);
    (void)disk_->append(text.substr(0, text.size() / 2));
    return full();
  }
  Result<void> sync() override {
    ++faults_->syncs;
    return faults_->sync ? full() : disk_->sync();
  }
  Result<void> replace(std::string_view text) override {
    return faults_->replace ? full() : disk_->replace(text);
  }
  Result<void> keep_damaged() override { return disk_->keep_damaged(); }
  Result<FoundFile> read_mark() override { return disk_->read_mark(); }
  Result<void> mark(std::string_view text) override { return faults_->append ? full() : disk_->mark(text); }
  Result<void> append_ids(std::uint32_t file, std::uint64_t offset, std::string_view bytes) override {
    return faults_->replace ? full() : disk_->append_ids(file, offset, bytes);
  }
  Result<std::string> read_ids(std::uint32_t file, std::uint64_t most) override {
    return disk_->read_ids(file, most);
  }
  void keep_ids(const std::vector<std::uint32_t>& files) override { disk_->keep_ids(files); }

 private:
  static Result<void> full() { return fail(Reason::storage, "cannot write journal.v1: full", "free space"); }
  std::unique_ptr<JournalDisk> disk_;
  std::shared_ptr<Faults> faults_;
};

Command command(const std::string& id, const std::string& axis = "x") {
  return {.id = id, .axis = axis, .request_id = "r" + id, .client = "c", .kind = CommandKind::move_relative};
}
Command done(const std::string& id) {
  auto command = axisd::store::command(id);
  command.state = CommandState::done;
  return command;
}

/// With what is on the disk, as a start that convicts nothing.
Result<std::unique_ptr<JournalFile>> begin(std::unique_ptr<JournalDisk> disk, WallTime now, Executor core,
                                           JournalOptions options = {}) {
  const auto found = disk->read();
  if (!found) return fail(found.error());
  auto loaded = found->regular() ? std::optional(load_journal(found->text)) : std::nullopt;
  return JournalFile::begin(std::move(disk), std::move(loaded), now, std::move(core), std::move(options));
}

class JournalFileTest : public testing::Test {
 protected:
  std::unique_ptr<JournalFile> open(WallTime now = WallTime(std::chrono::hours(1)),
                                    JournalOptions options = {}) {
    auto disk = open_journal_disk(temporary_.path());
    if (!disk) ADD_FAILURE() << to_string(disk.error());
    auto journal = begin(std::make_unique<FaultyDisk>(std::move(*disk), faults_), now, core_.get_executor(),
                         std::move(options));
    if (!journal) {
      ADD_FAILURE() << to_string(journal.error());
      return nullptr;
    }
    return *std::move(journal);
  }
  CommandJournal::Callback record() {
    return [this](Result<void> result) { results_.push_back(std::move(result)); };
  }
  void wait_for(std::size_t count) {
    while (results_.size() < count) core_.run_one();
  }
  /// Until the journal tells of trouble, or of its end.
  void wait_for_trouble(const JournalFile& journal, bool trouble) {
    while (journal.trouble().has_value() != trouble) core_.run_one_for(std::chrono::seconds(5));
  }
  std::string text() const { return temporary_.read("journal.v1"); }

  test::TemporaryDirectory temporary_;
  std::shared_ptr<Faults> faults_ = std::make_shared<Faults>();
  boost::asio::io_context core_;
  boost::asio::executor_work_guard<boost::asio::io_context::executor_type> running_ =
      boost::asio::make_work_guard(core_);
  std::vector<Result<void>> results_;
};

TEST_F(JournalFileTest, CommandsAreKnownAfterARestart) {
  {
    const auto journal = open();
    EXPECT_TRUE(journal->take_loaded().commands.empty());
    journal->accepted(command("1"), "one");
    journal->sending(command("1"), {.start_pulses = 5, .target_pulses = 6}, record());
    wait_for(1);
    EXPECT_TRUE(results_[0]);
    EXPECT_THAT(text(), HasSubstr("sending id=1")) << "before it is told";
    journal->ended(done("1"));
    journal->accepted(command("2"), "two");
    journal->attached("2", {"c", "more", "two"}, record());
    wait_for(2);
  }
  for (int start = 0; start < 3; ++start) {
    const auto content = open()->take_loaded();
    ASSERT_EQ(content.commands.size(), 2);
    EXPECT_EQ(content.commands[0].command.state, CommandState::done);
    EXPECT_EQ(content.commands[0].digest, "one");
    EXPECT_TRUE(content.commands[0].sent);
    EXPECT_FALSE(content.commands[1].sent);
    EXPECT_EQ(content.commands[1].attached, (std::vector<RequestKey>{{"c", "more", "two"}}));
    EXPECT_FALSE(content.doubtful_until);
  }
}

TEST_F(JournalFileTest, WhatIsAcceptedIsWrittenAlsoWhereNothingFollows) {
  auto journal = open();
  journal->accepted(command("1"), "one");
  core_.poll();
  while (!text().contains("accepted id=1 ")) std::this_thread::yield();
  journal->accepted(command("2"), "two");
  journal.reset();
  EXPECT_THAT(text(), HasSubstr("accepted id=2 "));
  core_.poll();
}

/// An end without its sync costs a restart a look at the drive, and nothing else.
TEST_F(JournalFileTest, EndsShareASync) {
  const WallTime now(std::chrono::hours(1));
  {
    const auto journal = open(now, {.sync_within = std::chrono::hours(1)});
    const auto before = faults_->syncs.load();
    for (int number = 1; number <= 20; ++number) {
      const auto id = std::to_string(number);
      journal->accepted(command(id), id);
      journal->ended(done(id));
      while (!text().contains("ended id=" + id + " ")) std::this_thread::yield();  // a crash leaves it known
    }
    EXPECT_EQ(faults_->syncs, before);
    journal->sending(command("21"), {}, record());
    wait_for(1);
    EXPECT_EQ(faults_->syncs, before + 1);
    journal->ended(done("21"));
  }
  EXPECT_EQ(open()->take_loaded().commands.back().command.state, CommandState::done) << "closing syncs";
}

TEST_F(JournalFileTest, AnEndIsDurableSoonByItself) {
  const auto journal = open(WallTime(std::chrono::hours(1)), {.sync_within = std::chrono::milliseconds(1)});
  const auto before = faults_->syncs.load();
  journal->accepted(command("1"), "one");
  journal->ended(done("1"));
  while (faults_->syncs == before) std::this_thread::yield();
}

TEST_F(JournalFileTest, AFullDiskFailsWhatIsToBeSentUntilThereIsSpaceAgain) {
  const auto journal = open();
  for (auto* fault : {&faults_->append, &faults_->sync}) {
    *fault = true;
    faults_->replace = true;
    journal->accepted(command("1"), "one");
    journal->sending(command("1"), {}, record());
    wait_for(1);
    EXPECT_EQ(results_[0].error().reason, Reason::storage);
    wait_for_trouble(*journal, true);
    EXPECT_THAT(journal->trouble()->message, HasSubstr("full"));
    journal->sending(command("2"), {}, record());
    wait_for(2);
    EXPECT_FALSE(results_[1]) << "nothing is taken for durable on a disk that failed";
    *fault = false;
    faults_->replace = false;
    wait_for_trouble(*journal, false);  // by itself
    journal->sending(command("3"), {}, record());
    wait_for(3);
    EXPECT_TRUE(results_[2]);
    results_.clear();
  }
}

TEST_F(JournalFileTest, AfterAFailedWriteTheFileIsWholeAgain) {
  {
    const auto journal = open();
    // Whether the two lines are written together or, as two attempts, the second by a rewrite.
    faults_->append = faults_->replace = true;
    journal->accepted(command("1"), "one");
    journal->sending(command("1"), {}, record());
    wait_for(1);
    EXPECT_FALSE(results_[0]);
    wait_for_trouble(*journal, true);
    faults_->append = faults_->replace = false;
    wait_for_trouble(*journal, false);
    journal->sending(command("2"), {}, record());
    wait_for(2);
    EXPECT_TRUE(results_[1]);
  }
  const auto content = open()->take_loaded();
  EXPECT_FALSE(content.doubtful_until) << content.damage;
  EXPECT_EQ(content.commands.size(), 2);
}

TEST_F(JournalFileTest, DamageIsRememberedForAsLongAsARequestIsValid) {
  const WallTime start(std::chrono::hours(1));
  {
    const auto journal = open(start);
    journal->accepted(command("1"), "one");
    journal->sending(command("1"), {}, record());
    wait_for(1);
  }
  temporary_.write("journal.v1", text().substr(0, text().size() - 10) + "\n");
  const auto torn = text();
  for (const auto minutes : {0, 1, 9}) {
    const auto content = open(start + std::chrono::minutes(minutes))->take_loaded();
    ASSERT_TRUE(content.doubtful_until) << minutes;
    EXPECT_EQ(*content.doubtful_until, start + longest_validity);
    EXPECT_THAT(content.damage, HasSubstr("line "));
    EXPECT_EQ(content.commands.size(), 1);
  }
  EXPECT_EQ(temporary_.read("journal.v1.damaged"), torn);
  EXPECT_TRUE(open(start - std::chrono::hours(1))->take_loaded().doubtful_until) << "the clock was set back";
  EXPECT_FALSE(open(start + longest_validity)->take_loaded().doubtful_until);
  EXPECT_FALSE(open(start)->take_loaded().doubtful_until) << "it is over for good";
}

TEST_F(JournalFileTest, ALineThatACrashCutShortLocksNothing) {
  {
    const auto journal = open();
    journal->accepted(command("1"), "one");
    journal->sending(command("1"), {}, record());
    wait_for(1);
    journal->accepted(command("2"), "two");
  }
  temporary_.write("journal.v1", text().substr(0, text().size() - 10));
  for (int start = 0; start < 2; ++start) {
    const auto content = open()->take_loaded();
    EXPECT_FALSE(content.doubtful_until);
    ASSERT_EQ(content.commands.size(), 1);
    EXPECT_TRUE(content.commands[0].sent);
  }
  EXPECT_EQ(load_journal(text()).torn, 0);
}

TEST_F(JournalFileTest, ItDoesNotGrowWithoutEndAndKeepsWhatIsStillNeeded) {
  const auto journal = open();
  journal->accepted(command("open"), std::string(100, 'd'));
  for (int i = 0; i < 40; ++i) {
    for (int k = 0; k < 200; ++k) {
      auto ended = command("same");
      ended.state = CommandState::error;
      ended.cause = Error{.message = std::string(200, 'm')};
      journal->ended(ended);
    }
    journal->sending(command("same"), {}, record());
    wait_for(static_cast<std::size_t>(i) + 1);
  }
  EXPECT_LT(text().size(), std::size_t{2} << 20U);
  const auto load = load_journal(text());
  EXPECT_EQ(load.damage, "");
  EXPECT_EQ(load.model.content().commands.front().command.id, "open");
}

/// Of many commands the ids are kept, in little space, whenever the daemon is restarted.
TEST_F(JournalFileTest, OfManyCommandsTheIdsAreKept) {
  constexpr int count = 12'000;
  std::size_t told = 0;
  {
    const auto journal = open();
    for (int i = 1; i <= count; ++i) {
      const auto id = "i-" + std::to_string(i);
      journal->accepted(command(id), std::string(100, 'd'));
      journal->ended(done(id));
      if (i % 500 != 0) continue;
      journal->sending(command("open"), {}, record());
      wait_for(++told);
    }
  }
  for (int start = 0; start < 3; ++start) {
    auto content = open()->take_loaded();
    EXPECT_FALSE(content.doubtful_until) << content.damage;
    std::set<std::string> known;
    for (const auto& each : content.commands) known.insert(each.command.id);
    EXPECT_LT(known.size(), 6'000);
    EXPECT_TRUE(known.contains("open"));
    KnownIds ids;
    for (auto& [client, run] : content.ids) {
      EXPECT_EQ(client, "c");
      EXPECT_LE(run.newest, content.now);
      ids.add(std::move(run));
    }
    for (int i = 1; i <= count; ++i) {
      const auto id = "i-" + std::to_string(i);
      if (known.contains(id)) continue;
      const auto found = ids.find("ri-" + std::to_string(i), std::string(100, 'd'));
      ASSERT_TRUE(found) << i;
      EXPECT_TRUE(found->same_content);
      EXPECT_EQ(found->command.id, id);
    }
    EXPECT_EQ(known.size() - 1 + ids.size(), count);
    EXPECT_LT(text().size(), std::size_t{1} << 20U) << "those are elsewhere";
  }
  // One of the files is damaged: nobody knows what was in it.
  auto bytes = temporary_.read("journal-ids-1.v1");
  bytes[100] = static_cast<char>(bytes[100] ^ 1);
  temporary_.write("journal-ids-1.v1", bytes);
  EXPECT_TRUE(open()->take_loaded().doubtful_until);
  EXPECT_TRUE(open()->take_loaded().doubtful_until) << "as long as a request is valid";
}

/// The ids cannot be written, then the journal: nothing is lost, and nothing is taken for durable.
TEST_F(JournalFileTest, AFullDiskLosesNoIds) {
  {
    const auto journal = open();
    faults_->replace = true;
    for (int i = 1; i <= 6'000; ++i) {
      const auto id = "i-" + std::to_string(i);
      journal->accepted(command(id), std::string(100, 'd'));
      journal->ended(done(id));
    }
    journal->sending(command("open"), {}, record());
    wait_for_trouble(*journal, true);
    faults_->replace = false;
    wait_for_trouble(*journal, false);
  }
  const auto content = open()->take_loaded();
  EXPECT_FALSE(content.doubtful_until) << content.damage;
  std::size_t ids = content.commands.size();
  for (const auto& each : content.ids) ids += each.run.records.size();
  EXPECT_EQ(ids, 6'001);
}

TEST_F(JournalFileTest, ANewerFormatIsNotTakenForDamage) {
  temporary_.write("journal.v1", "axisd-journal 4\nwhatever\n");
  auto disk = open_journal_disk(temporary_.path());
  const auto journal = begin(std::move(*disk), WallTime(), core_.get_executor());
  ASSERT_FALSE(journal);
  EXPECT_THAT(journal.error().message, HasSubstr("newer"));
  EXPECT_EQ(text(), "axisd-journal 4\nwhatever\n");
}

/// What was told to be durable is there when the process is killed at any moment.
TEST_F(JournalFileTest, WhatWasDurableSurvivesAKill) {
  for (int round = 0; round < 15; ++round) {
    std::array<int, 2> pipes{};
    ASSERT_EQ(pipe(pipes.data()), 0);
    const auto child = fork();
    if (child == 0) {
      boost::asio::io_context core;
      auto disk = open_journal_disk(temporary_.path());
      auto journal = begin(std::move(*disk), std::chrono::system_clock::now(), core.get_executor());
      if (!journal) _exit(1);
      for (unsigned char i = 0; i < 200; ++i) {
        const auto id = std::to_string(round) + "-" + std::to_string(i);
        (*journal)->accepted(command(id), "d");
        std::optional<bool> durable;
        (*journal)->sending(command(id), {},
                            [&](const Result<void>& result) { durable = result.has_value(); });
        auto work = boost::asio::make_work_guard(core);
        core.restart();
        while (!durable) core.run_one();
        if (!*durable || write(pipes[1], &i, 1) != 1) _exit(1);
      }
      _exit(0);
    }
    close(pipes[1]);
    int told = -1;
    unsigned char number = 0;
    while (told < 3 * round && read(pipes[0], &number, 1) == 1) told = number;
    kill(child, SIGKILL);
    while (read(pipes[0], &number, 1) == 1) told = number;
    close(pipes[0]);
    int status = 0;
    waitpid(child, &status, 0);
    const auto content = open()->take_loaded();
    EXPECT_FALSE(content.doubtful_until) << content.damage;
    int found = 0;
    for (const auto& journalled : content.commands)
      found += journalled.command.id.starts_with(std::to_string(round) + "-") && journalled.sent ? 1 : 0;
    EXPECT_GE(found, told + 1);
  }
}

}  // namespace
}  // namespace axisd::store
