// What the journal is told beside the text of a line.
#include "buses/log_about.hpp"

#include <gmock/gmock.h>
#include <spdlog/sinks/ostream_sink.h>
#include <spdlog/spdlog.h>

#include <memory>
#include <set>
#include <sstream>
#include <string>

namespace axisd {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::MatchesRegex;
using ::testing::Not;
using ::testing::StartsWith;

std::vector<std::string> fields_of(LogKind kind, const LogSubject& subject, std::string_view text) {
  return journal_fields(spdlog::level::warn, log_source_line(kind), log_payload(subject, text));
}

TEST(JournalFields, SayWhatALineIsAbout) {
  const auto fields = fields_of(
      LogKind::axis_fault,
      {.bus = "line-a", .axis = "feeder", .client = "anna via web", .command = "i-7", .node = 3}, "alarm 2");
  EXPECT_THAT(fields, ElementsAre("PRIORITY=4", "SYSLOG_IDENTIFIER=axisd", "MESSAGE=alarm 2",
                                  StartsWith("MESSAGE_ID="), "AXISD_EVENT=axis_fault", "AXISD_BUS=line-a",
                                  "AXISD_NODE=3", "AXISD_AXIS=feeder", "AXISD_CLIENT=anna via web",
                                  "AXISD_COMMAND=i-7"));
}

TEST(JournalFields, WhatIsNotKnownIsLeftOut) {
  EXPECT_THAT(fields_of(LogKind::none, {}, "hello"),
              ElementsAre("PRIORITY=4", "SYSLOG_IDENTIFIER=axisd", "MESSAGE=hello"));
}

TEST(JournalFields, AnOrdinaryLineHasNone) {
  EXPECT_THAT(journal_fields(spdlog::level::info, 0, "line-a: port /dev/x is open"),
              ElementsAre("PRIORITY=6", "SYSLOG_IDENTIFIER=axisd", "MESSAGE=line-a: port /dev/x is open"));
}

TEST(JournalFields, ALineOfTextHasItsPriorityInstead) {
  const auto payload = log_payload({.axis = "feeder"}, "alarm 2");
  EXPECT_EQ(journal_text(spdlog::level::warn, log_source_line(LogKind::axis_fault), payload), "<4>alarm 2");
  EXPECT_EQ(journal_text(spdlog::level::info, 0, "line-a: port /dev/x is open"),
            "<6>line-a: port /dev/x is open");
}

/// Texts have names in them that clients chose.
TEST(JournalFields, NoTextMakesFields) {
  const std::string forged =
      "hello\x1e"
      "AXISD_CLIENT=root\x1f";
  EXPECT_THAT(journal_fields(spdlog::level::info, 0, forged), Not(Contains("AXISD_CLIENT=root")));
  const auto fields = fields_of(LogKind::call_denied,
                                {.client = "x\x1f"
                                           "AXISD_AXIS=lifter"},
                                forged);
  EXPECT_THAT(fields, Not(Contains("AXISD_CLIENT=root")));
  EXPECT_THAT(fields, Not(Contains("AXISD_AXIS=lifter")));
  EXPECT_THAT(fields, Contains("AXISD_CLIENT=x?AXISD_AXIS=lifter"));
}

TEST(JournalFields, EachKindHasAnIdOfItsOwn) {
  std::set<std::string_view> ids, names;
  int index = 0;
  for (const auto& entry : log_kinds()) {
    EXPECT_THAT(std::string(entry.id), MatchesRegex("[0-9a-f]{32}")) << entry.name;
    EXPECT_EQ(static_cast<int>(entry.kind), ++index) << entry.name;
    ids.insert(entry.id);
    names.insert(entry.name);
  }
  EXPECT_EQ(ids.size(), log_kinds().size());
  EXPECT_EQ(names.size(), log_kinds().size());
}

TEST(LogAbout, IsALineOfTextWhereTheLogTakesNoFields) {
  const auto before = spdlog::default_logger();
  std::ostringstream text;
  auto logger = std::make_shared<spdlog::logger>("", std::make_shared<spdlog::sinks::ostream_sink_mt>(text));
  logger->set_pattern("%l %v");
  spdlog::set_default_logger(logger);
  log_about(spdlog::level::info, LogKind::axis_online, {.axis = "feeder"}, "feeder: {} online");
  log_about(spdlog::level::debug, LogKind::axis_online, {.axis = "feeder"}, "not at this level");
  spdlog::set_default_logger(before);
  EXPECT_EQ(text.str(), "info feeder: {} online\n");
}

}  // namespace
}  // namespace axisd
