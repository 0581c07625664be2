#include "daemon/store/audit_log.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <filesystem>
#include <memory>
#include <sstream>
#include <string>
#include <vector>

#include "tests/support/temporary_directory.hpp"

namespace axisd::store {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

/// "NUMBER REVISION WHAT".
std::string encode(const AuditHead& head, const AuditEntry& entry) {
  std::string what;
  if (const auto* run = std::get_if<DaemonRun>(&entry.content)) what = run->version;
  if (const auto* gap = std::get_if<AuditGap>(&entry.content)) what = fmt::format("gap {}", gap->left_out);
  if (const auto* call = std::get_if<AuditedCall>(&entry.content)) what = call->text;
  if (const auto* earlier = std::get_if<RecoveredCommand>(&entry.content))
    what = fmt::format("recovered {} {} {}", earlier->command.id, to_string(earlier->command.state),
                       earlier->sent ? "sent" : "not sent");
  if (std::holds_alternative<Event>(entry.content)) what = "event";
  return fmt::format("{} {} {}", head.number, head.revision, what);
}

/// Of the texts of calls: "command ID accepted" and "command ID ended".
std::optional<AuditFormat::Told> command_of(std::string_view line) {
  const auto found = line.find("command ");
  if (found == std::string_view::npos) return std::nullopt;
  const auto rest = line.substr(found + 8);
  return AuditFormat::Told{.id = std::string(rest.substr(0, rest.find(' '))),
                           .ended = rest.ends_with("ended")};
}

AuditEntry call(std::string text) {
  return {.content = AuditedCall{.rpc = "r", .client = "c", .text = std::move(text)}};
}

RecoveredCommand earlier(const std::string& id, CommandState state, bool sent) {
  return {.command = {.id = id, .axis = "x", .request_id = "r", .client = "c", .state = state}, .sent = sent};
}

AuditEntry change(std::string request_id, CommandState state) {
  Command command{.id = "i", .axis = "x", .request_id = std::move(request_id), .client = "c", .state = state};
  if (state == CommandState::error) command.cause = Error{.message = "failed"};
  return {.content = Event{.axis = "x",
                           .content = CommandChange{.command = std::make_shared<const Command>(command)}}};
}

class AuditLogTest : public testing::Test {
 protected:
  std::unique_ptr<AuditLog> open(std::vector<RecoveredCommand> commands = {}, std::size_t most = 1'000) {
    return std::make_unique<AuditLog>(AuditOptions{.directory = temporary_.path() / "audit",
                                                   .format = {.encode = encode, .command_of = command_of},
                                                   .instance_id = "i",
                                                   .revision = "r1",
                                                   .earlier = std::move(commands),
                                                   .gather_within = std::chrono::hours(1),
                                                   .most_waiting = most});
  }
  /// Of the only file.
  std::vector<std::string> lines() const {
    std::istringstream text(temporary_.read("audit/audit-000000000001.jsonl"));
    std::vector<std::string> all;
    for (std::string line; std::getline(text, line);) all.push_back(line);
    return all;
  }
  template <class Condition>
  static void wait_for(Condition condition) {
    while (!condition()) block_until(monotonic_now() + std::chrono::milliseconds(1));
  }

  test::TemporaryDirectory temporary_;
};

TEST_F(AuditLogTest, WhatIsAddedIsWrittenAtOnceInOrder) {
  auto log = open();
  for (int i = 0; i < 600; ++i) log->add(call(std::to_string(i)));
  wait_for([&] { return log->newest() == 600; });
  EXPECT_FALSE(log->trouble());
  EXPECT_EQ(lines().at(599), "600 r1 599");
  log.reset();
  log = open();
  log->add(call("more"));
  log.reset();
  EXPECT_EQ(lines().at(600), "601 r1 more");
}

/// A kill takes nothing from the audit that the journal does not tell.
TEST_F(AuditLogTest, WhatTheJournalTellsTooIsWrittenWithWhatComesNext) {
  auto log = open();
  log->add(call("first"));
  wait_for([&] { return log->newest() == 1; });
  log->add(change("r", CommandState::accepted));
  log->add(change("r", CommandState::done));
  EXPECT_EQ(log->newest(), 1);
  log->add(call("next"));
  wait_for([&] { return log->newest() == 4; });
  EXPECT_THAT(lines(), ElementsAre("1 r1 first", "2 r1 event", "3 r1 event", "4 r1 next"));
}

TEST_F(AuditLogTest, WhatTheJournalDoesNotTellIsWrittenAtOnce) {
  auto log = open();
  log->add(change("", CommandState::accepted));
  wait_for([&] { return log->newest() == 1; });
  log->add(change("r", CommandState::error));
  wait_for([&] { return log->newest() == 2; });
}

TEST_F(AuditLogTest, WhoReadsFindsWhatWasAddedBefore) {
  auto log = open();
  log->write_all();
  for (std::uint64_t i = 1; i <= 20; ++i) {
    log->add(change("r", CommandState::accepted));
    log->write_all();
    EXPECT_EQ(log->newest(), i);
  }
  log->add(change("r", CommandState::accepted));
  log.reset();
  EXPECT_EQ(lines().size(), 21);
}

TEST_F(AuditLogTest, NobodyWaitsForADiskThatFails) {
  temporary_.write("audit", "in the place of the directory");
  auto log = open();
  log->add(change("r", CommandState::accepted));
  log->write_all();
  EXPECT_TRUE(log->trouble());
}

TEST_F(AuditLogTest, EachRecordNamesTheConfigurationThatIsServed) {
  auto log = open();
  log->add(call("before"));
  log->add(
      {.content = Event{.axis = {},
                        .content = ConfigurationReloaded{.client = "c", .before = "r1", .revision = "r2"}}});
  log->add(call("behind"));
  log.reset();
  EXPECT_THAT(lines(), ElementsAre("1 r1 before", "2 r2 event", "3 r2 behind"));
}

/// Whatever was sent is in the journal: what a kill kept from the audit comes from there.
TEST_F(AuditLogTest, WhatTheJournalKnowsAndNoRecordTellsComesFirst) {
  {
    auto log = open();
    log->add(call("command both accepted"));
    log->add(call("command both ended"));
    log->add(call("command half accepted"));
  }
  const std::vector<RecoveredCommand> known = {
      earlier("in a file that is gone", CommandState::done, true), earlier("both", CommandState::done, true),
      earlier("half", CommandState::done, true), earlier("lost", CommandState::accepted, true),
      earlier("never", CommandState::accepted, false)};
  {
    auto log = open(known);
    log->add(call("begins"));
  }
  EXPECT_THAT(lines(), ElementsAre("1 r1 command both accepted", "2 r1 command both ended",
                                   "3 r1 command half accepted", "4 r1 recovered half done sent",
                                   "5 r1 recovered lost accepted sent",
                                   "6 r1 recovered never accepted not sent", "7 r1 begins"));
}

TEST_F(AuditLogTest, ADiskThatFailsIsTroubleUntilItIsWrittenAgain) {
  temporary_.write("audit", "in the place of the directory");
  auto log = open({}, 3);
  wait_for([&] { return log->trouble().has_value(); });
  EXPECT_EQ(log->trouble()->reason, Reason::storage);
  EXPECT_THAT(log->trouble()->message, HasSubstr("audit"));
  for (int i = 0; i < 5; ++i) log->add(call(std::to_string(i)));
  std::filesystem::remove(temporary_.path() / "audit");
  wait_for([&] { return log->newest() == 4; });
  wait_for([&] { return !log->trouble(); });
  EXPECT_THAT(lines(), ElementsAre("1 r1 0", "2 r1 1", "3 r1 2", "4 r1 gap 2"));
}

}  // namespace
}  // namespace axisd::store
