#include "daemon/store/journal_text.hpp"

#include <gtest/gtest.h>

#include "daemon/store/journal_model.hpp"

namespace axisd::store {
namespace {

using std::chrono::milliseconds;

Command command(const std::string& id, CommandKind kind = CommandKind::move_relative) {
  return {.id = id,
          .axis = "feeder",
          .request_id = "request of\n%" + id,
          .client = "tls:hmi 1",
          .kind = kind,
          .asked = {.distance = -1.0 / 3, .velocity = 12.5, .acceleration_time = milliseconds(80)},
          .accepted_at = WallTime(milliseconds(1700000000123))};
}

Command ended(Command of, CommandState state) {
  of.granted = {.position = -0.0, .velocity = 1e-300, .hold = milliseconds(300)};
  of.state = state;
  of.started_at = WallTime(milliseconds(5));
  of.ended_at = WallTime(milliseconds(6));
  if (state != CommandState::done)
    of.cause = Error{.reason = Reason::no_reply,
                     .message = "line-a: no reply; 100 %",
                     .remedy = "check",
                     .outcome = Outcome::unknown,
                     .where = {.bus = "line-a", .node = 7}};
  return of;
}

Command heard_again() {
  Command heard{
      .id = "a-4", .axis = "feeder", .kind = CommandKind::home, .accepted_at = WallTime(milliseconds(4))};
  heard.state = CommandState::aborted;
  heard.ended_at = WallTime(milliseconds(5));
  heard.cause = Error{.reason = Reason::superseded, .message = "by a stop", .outcome = Outcome::not_executed};
  return heard;
}

std::vector<JournalLine> all_kinds() {
  return {DoubtLine{.until = WallTime(milliseconds(9)), .damage = "line 3: wrong"},
          AcceptedLine{.command = command("a-1"), .digest = "feeder relative -0x1p+0 - - -"},
          AttachedLine{.command = "a-1", .request = {"tls:hmi 1", "r2", "feeder jog"}},
          SendingLine{.command = ended(command("a-1"), CommandState::active),
                      .note = {.start_pulses = -5,
                               .target_pulses = 2147483647,
                               .tolerance_pulses = 3,
                               .marks = {{5, 100, 100, 60, 0, 5000}, {0xFFFF, 0, 1, 2, 3, 4}}}},
          SendingLine{.command = command("a-2", CommandKind::home), .note = {}},
          TimeLine{.at = milliseconds(-7), .boot = "5fd3-1", .uptime = milliseconds(70'000)},
          EndedLine{.command = ended(command("a-1"), CommandState::unknown), .awaits_reset = true},
          HeardLine{.command = heard_again(), .request = {"tls:hmi 1", "r9 %", "feeder home"}},
          IdsLine{.file = 3,
                  .bytes = 1'000'000,
                  .count = 50'000,
                  .begin = milliseconds(1),
                  .newest = milliseconds(2)},
          StateLine{.pair = "5fd3",
                    .generation = 41,
                    .start_count = 7,
                    .inhibit = {.active = true, .by = "tls:hmi 1", .since = WallTime(milliseconds(3))},
                    .holds = {{"feeder",
                               {{{.holder = "hmi 1", .request_id = "r1"}, WallTime(milliseconds(4))},
                                {{.holder = "panel", .request_id = ""}, WallTime(milliseconds(5))}}},
                              {"table", {{{.holder = "hmi", .request_id = ""}, WallTime{}}}}}},
          EndedLine{.command = ended(command("a-3", CommandKind::reset), CommandState::done),
                    .awaits_reset = false}};
}

std::string journal_of(const std::vector<JournalLine>& lines) {
  std::string text(journal_header);
  std::uint64_t number = 40;
  for (const auto& line : lines) text += encode_line(++number, line);
  return text;
}

TEST(JournalText, EveryKindOfLineIsReadAsItWasWritten) {
  for (const auto& line : all_kinds()) {
    const auto text = encode_line(7, line);
    ASSERT_TRUE(text.ends_with('\n'));
    const auto read = decode_line(std::string_view(text).substr(0, text.size() - 1));
    ASSERT_TRUE(read) << text;
    EXPECT_EQ(read->number, 7);
    EXPECT_EQ(encode_line(7, read->line), text);
  }
}

TEST(JournalText, NoFlippedBitAndNoCutIsAccepted) {
  for (const auto& line : all_kinds()) {
    const auto text = encode_line(7, line);
    const auto whole = std::string_view(text).substr(0, text.size() - 1);
    for (std::size_t size = 0; size < whole.size(); ++size) EXPECT_FALSE(decode_line(whole.substr(0, size)));
    for (std::size_t bit = 0; bit < 8 * whole.size(); ++bit) {
      std::string flipped(whole);
      flipped[bit / 8] = static_cast<char>(flipped[bit / 8] ^ (1 << (bit % 8)));
      EXPECT_FALSE(decode_line(flipped)) << flipped;
    }
  }
}

TEST(JournalModel, AJournalThatWasWrittenAnewSaysTheSame) {
  const auto load = load_journal(journal_of(all_kinds()));
  EXPECT_EQ(load.damage, "");
  const auto again = load_journal(journal_of(load.model.lines()));
  EXPECT_EQ(again.damage, "");
  EXPECT_EQ(journal_of(again.model.lines()), journal_of(load.model.lines()));
  const auto content = again.model.content();
  ASSERT_EQ(content.commands.size(), 4);
  const auto& first = content.commands.front();
  EXPECT_EQ(first.command.request_id, command("a-1").request_id);
  EXPECT_EQ(first.command.state, CommandState::unknown);
  EXPECT_EQ(first.command.asked.distance, command("a-1").asked.distance);
  EXPECT_EQ(first.command.cause->where.node, 7);
  EXPECT_EQ(first.attached.front().request_id, "r2");
  EXPECT_TRUE(first.sent);
  EXPECT_EQ(first.note.target_pulses, 2147483647);
  EXPECT_EQ(content.doubtful_until, WallTime(milliseconds(9)));
}

TEST(JournalModel, AnUnknownOutcomeStandsUntilItsAxisIsReset) {
  auto lines = all_kinds();
  lines.pop_back();
  auto unknown = load_journal(journal_of(lines)).model;
  ASSERT_TRUE(unknown.content().unknown_outcomes.contains("feeder"));
  EXPECT_EQ(unknown.content().unknown_outcomes.at("feeder").first, "a-1");
  unknown.forget_before(Duration::max());
  EXPECT_TRUE(unknown.content().unknown_outcomes.contains("feeder")) << "not by age";
  unknown.apply(all_kinds().back());
  EXPECT_TRUE(unknown.content().unknown_outcomes.empty());
  const auto anew = load_journal(journal_of(unknown.lines())).model;
  EXPECT_TRUE(anew.content().unknown_outcomes.empty());
}

TEST(JournalModel, OnlyWhatHasEndedIsForgotten) {
  JournalModel model;
  const Duration long_ago = std::chrono::hours(1), now = std::chrono::hours(2);
  model.apply(TimeLine{.at = long_ago});
  for (const auto* id : {"open", "old", "repeated", "heard"})
    model.apply(AcceptedLine{.command = command(id), .digest = "d"});
  for (const auto* id : {"old", "repeated", "heard"})
    model.apply(EndedLine{.command = ended(command(id), CommandState::done)});
  model.apply(TimeLine{.at = now});
  model.apply(AttachedLine{.command = "repeated", .request = {"c", "r", "d"}});
  model.apply(HeardLine{.command = ended(command("heard"), CommandState::done),
                        .request = {"tls:hmi 1", command("heard").request_id, "d"}});
  model.forget_before(now);
  const auto content = model.content();
  ASSERT_EQ(content.commands.size(), 3);
  EXPECT_EQ(content.commands[0].command.id, "open");
  EXPECT_EQ(content.commands[1].command.id, "repeated");
  EXPECT_EQ(content.commands[2].command.id, "heard");
  EXPECT_TRUE(content.commands[2].attached.empty()) << "it was the same request";
  EXPECT_EQ(content.commands[2].heard_of - content.commands[0].heard_of, now - long_ago);
}

TEST(JournalModel, TimeGoesOnWithTheComputersAndStandsStillWhileItIsOff) {
  JournalModel model;
  model.apply(model.time_after("first", std::chrono::hours(7)));
  EXPECT_EQ(model.now(), Duration{0});
  model.apply(AcceptedLine{.command = command("a"), .digest = "d"});
  model.apply(EndedLine{.command = ended(command("a"), CommandState::done)});
  model.apply(model.time_after("first", std::chrono::hours(7) + milliseconds(250)));
  EXPECT_EQ(model.now(), milliseconds(250));
  auto anew = load_journal(journal_of(model.lines())).model;
  EXPECT_EQ(anew.now(), milliseconds(250));
  anew.apply(anew.time_after("first", std::chrono::hours(8)));
  EXPECT_EQ(anew.now(), std::chrono::hours(1)) << "the daemon was restarted";
  anew.apply(anew.time_after("first", std::chrono::hours(2)));
  EXPECT_EQ(anew.now(), std::chrono::hours(1)) << "never back";
  auto booted = load_journal(journal_of(anew.lines())).model;
  booted.apply(booted.time_after("second", std::chrono::seconds(40)));
  EXPECT_EQ(booted.now(), std::chrono::hours(1)) << "nobody knows how long it was off";
  booted.apply(booted.time_after("second", std::chrono::seconds(41)));
  EXPECT_EQ(booted.now(), std::chrono::hours(1) + std::chrono::seconds(1));
  const auto content = booted.content();
  EXPECT_EQ(content.now - content.commands.front().heard_of, booted.now());
}

TEST(JournalModel, OfWhatHasEndedIdsAreEnough) {
  JournalModel model;
  for (int i = 1; i <= 5; ++i) {
    const auto id = "a-" + std::to_string(i);
    model.apply(AcceptedLine{.command = command(id), .digest = "d"});
    model.apply(SendingLine{.command = command(id), .note = {}});
    model.apply(EndedLine{.command = ended(command(id), CommandState::done)});
  }
  model.apply(AttachedLine{.command = "a-2", .request = {"tls:hmi 1", "more", "d"}});
  const auto settled = model.settled(2);
  EXPECT_EQ(settled.commands, (std::vector<std::string>{"a-1", "a-2", "a-3"}));
  ASSERT_EQ(settled.runs.size(), 1);
  EXPECT_EQ(settled.runs.front().client, "tls:hmi 1");
  EXPECT_EQ(settled.runs.front().run.records.size(), 4) << "and the one that was taken into another";
  KnownIds known;
  known.add(settled.runs.front().run);
  EXPECT_EQ(known.find("more", "d")->command.id, "a-2");
  EXPECT_EQ(known.find(command("a-3").request_id, "d")->command.state, CommandState::done);
  model.drop(settled.commands);
  EXPECT_EQ(model.size(), 2);
}

/// What was sent after an open command tells what became of that; what awaits a reset is asked for by its
/// axis.
TEST(JournalModel, WhatIsStillNeededIsKeptInFull) {
  JournalModel model;
  const auto accept = [&](const std::string& id, bool sent, std::optional<CommandState> end) {
    model.apply(AcceptedLine{.command = command(id), .digest = "d"});
    if (sent) model.apply(SendingLine{.command = command(id), .note = {}});
    if (end) model.apply(EndedLine{.command = ended(command(id), *end)});
  };
  accept("before", true, CommandState::done);
  accept("unknown", true, CommandState::unknown);
  accept("open", true, std::nullopt);
  accept("after", true, CommandState::done);
  accept("waited and was cancelled", false, CommandState::aborted);
  EXPECT_EQ(model.settled(0).commands, (std::vector<std::string>{"before", "waited and was cancelled"}));
}

/// It was not durable, as its end is written with it: nothing was sent for it, so nothing is in doubt.
TEST(JournalModel, ALastLineThatWasCutShortIsLeftOut) {
  const auto text = journal_of(all_kinds());
  const auto before = text.substr(0, text.rfind('\n', text.size() - 2) + 1);
  for (auto size = before.size(); size < text.size(); ++size) {
    const auto load = load_journal(text.substr(0, size));
    EXPECT_EQ(load.damage, "") << size;
    const bool whole = size + 1 == text.size() || size == before.size();
    EXPECT_EQ(load.torn, whole ? 0 : size - before.size());
  }
  EXPECT_EQ(load_journal(text + std::string(100, '\0')).torn, 100) << "a block that was never filled";
  auto rotten = text.substr(0, text.size() - 10);
  rotten[rotten.find("sending")] = 'S';
  EXPECT_NE(load_journal(rotten).damage, "") << "a line before it is wrong";
}

TEST(JournalModel, DamageAnywhereIsNoticedAndTheRestIsRead) {
  const auto text = journal_of(all_kinds());
  EXPECT_NE(load_journal(text + std::string(100, '\0') + "\n").damage, "") << "zeros";
  EXPECT_NE(load_journal("").damage, "") << "emptied";
  EXPECT_NE(load_journal("axisd-jour").damage, "");
  // A whole line is gone.
  auto gone = text;
  const auto at = gone.find("attached");
  gone.erase(gone.rfind('\n', at), gone.find('\n', at) - gone.rfind('\n', at));
  const auto load = load_journal(gone);
  EXPECT_NE(load.damage, "");
  EXPECT_EQ(load.model.size(), 4);
  EXPECT_TRUE(load_journal("axisd-journal 4\nwhatever\n").newer_format);
}

TEST(JournalModel, TheFormatsBeforeThisOneAreRead) {
  auto lines = all_kinds();
  std::erase_if(lines, [](const JournalLine& line) {
    return std::holds_alternative<TimeLine>(line) || std::holds_alternative<HeardLine>(line) ||
           std::holds_alternative<IdsLine>(line) || std::holds_alternative<StateLine>(line);
  });
  for (const auto header : {journal_header_1, journal_header_2}) {
    auto text = journal_of(lines);
    text.replace(0, journal_header.size(), header);
    const auto load = load_journal(text);
    EXPECT_EQ(load.damage, "");
    EXPECT_EQ(load.model.size(), 3);
    EXPECT_EQ(load.model.now(), Duration{0}) << "all counts as being heard of now";
    EXPECT_FALSE(load.model.state());
  }
}

}  // namespace
}  // namespace axisd::store
