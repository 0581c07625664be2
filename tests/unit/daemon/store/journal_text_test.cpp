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
          EndedLine{.command = ended(command("a-1"), CommandState::unknown), .awaits_reset = true},
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
  const auto load = load_journal(journal_of(all_kinds()), {});
  EXPECT_EQ(load.damage, "");
  const auto again = load_journal(journal_of(load.model.lines()), {});
  EXPECT_EQ(again.damage, "");
  EXPECT_EQ(journal_of(again.model.lines()), journal_of(load.model.lines()));
  const auto content = again.model.content();
  ASSERT_EQ(content.commands.size(), 3);
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
  auto unknown = load_journal(journal_of(lines), TimePoint(std::chrono::hours(1))).model;
  ASSERT_TRUE(unknown.content().unknown_outcomes.contains("feeder"));
  EXPECT_EQ(unknown.content().unknown_outcomes.at("feeder").first, "a-1");
  unknown.forget_before(TimePoint::max());
  EXPECT_TRUE(unknown.content().unknown_outcomes.contains("feeder")) << "not by age";
  unknown.apply(all_kinds().back(), {});
  EXPECT_TRUE(unknown.content().unknown_outcomes.empty());
  const auto anew = load_journal(journal_of(unknown.lines()), {}).model;
  EXPECT_TRUE(anew.content().unknown_outcomes.empty());
}

TEST(JournalModel, OnlyWhatHasEndedIsForgotten) {
  JournalModel model;
  const TimePoint long_ago(std::chrono::hours(1)), now(std::chrono::hours(2));
  model.apply(AcceptedLine{.command = command("open"), .digest = "d"}, long_ago);
  model.apply(AcceptedLine{.command = command("old"), .digest = "d"}, long_ago);
  model.apply(AcceptedLine{.command = command("repeated"), .digest = "d"}, long_ago);
  for (const auto* id : {"old", "repeated"})
    model.apply(EndedLine{.command = ended(command(id), CommandState::done)}, long_ago);
  model.apply(AttachedLine{.command = "repeated", .request = {"c", "r", "d"}}, now);
  model.forget_before(now);
  const auto content = model.content();
  ASSERT_EQ(content.commands.size(), 2);
  EXPECT_EQ(content.commands[0].command.id, "open");
  EXPECT_EQ(content.commands[1].command.id, "repeated");
}

/// It was not durable, as its end is written with it: nothing was sent for it, so nothing is in doubt.
TEST(JournalModel, ALastLineThatWasCutShortIsLeftOut) {
  const auto text = journal_of(all_kinds());
  const auto before = text.substr(0, text.rfind('\n', text.size() - 2) + 1);
  for (auto size = before.size(); size < text.size(); ++size) {
    const auto load = load_journal(text.substr(0, size), {});
    EXPECT_EQ(load.damage, "") << size;
    const bool whole = size + 1 == text.size() || size == before.size();
    EXPECT_EQ(load.torn, whole ? 0 : size - before.size());
  }
  EXPECT_EQ(load_journal(text + std::string(100, '\0'), {}).torn, 100) << "a block that was never filled";
  auto rotten = text.substr(0, text.size() - 10);
  rotten[rotten.find("sending")] = 'S';
  EXPECT_NE(load_journal(rotten, {}).damage, "") << "a line before it is wrong";
}

TEST(JournalModel, DamageAnywhereIsNoticedAndTheRestIsRead) {
  const auto text = journal_of(all_kinds());
  EXPECT_NE(load_journal(text + std::string(100, '\0') + "\n", {}).damage, "") << "zeros";
  EXPECT_NE(load_journal("", {}).damage, "") << "emptied";
  EXPECT_NE(load_journal("axisd-jour", {}).damage, "");
  // A whole line is gone.
  auto gone = text;
  const auto at = gone.find("attached");
  gone.erase(gone.rfind('\n', at), gone.find('\n', at) - gone.rfind('\n', at));
  const auto load = load_journal(gone, {});
  EXPECT_NE(load.damage, "");
  EXPECT_EQ(load.model.size(), 3);
  EXPECT_TRUE(load_journal("axisd-journal 2\nwhatever\n", {}).newer_format);
}

}  // namespace
}  // namespace axisd::store
