#include "daemon/store/state_pair.hpp"

#include <gmock/gmock.h>

#include "daemon/store/journal_mark.hpp"

namespace axisd::store {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

FoundFile file(std::string text) { return {.kind = FoundFile::Kind::regular, .text = std::move(text)}; }
FoundFile not_regular() { return {.kind = FoundFile::Kind::other, .what = "a FIFO"}; }

Generation generation(std::uint64_t number, std::string pair = "p", std::uint64_t line = 100) {
  Generation result{.number = number, .journal = {.pair = std::move(pair), .line = line}, .state = {}};
  result.state.start_count = number / 2;
  result.state.axes["x"].offset = OffsetRecord{.offset_pulses = 7};
  return result;
}
FoundFile state(std::uint64_t number, std::string pair = "p", std::uint64_t line = 100) {
  return file(encode(generation(number, std::move(pair), line)));
}
FoundFile journal(std::uint64_t last, std::uint64_t of, std::string pair = "p") {
  auto line = line_of(generation(of, std::move(pair)));
  return file(std::string(journal_header) + encode_line(last, line));
}
FoundFile journal_of_before() {
  return file(std::string(journal_header_2) + encode_line(9, TimeLine{.at = Duration(1)}));
}

const WallTime noon{std::chrono::hours(12)};

Verdict judged(FoundFiles files) {
  auto verdict = judge(std::move(files), "new", noon);
  if (!verdict) {
    ADD_FAILURE() << to_string(verdict.error());
    return {};
  }
  return *std::move(verdict);
}
/// "state.v1 is missing; ...".
std::string found(FoundFiles files) { return to_string(judged(std::move(files)).fresh); }

/// As they are between starts: the journal knows the newest generation, that knows the journal.
FoundFiles intact() { return {.state = state(40), .previous = state(39), .journal = journal(120, 40)}; }
FoundFiles with(FoundFile FoundFiles::* which, FoundFile by) {
  auto files = intact();
  files.*which = std::move(by);
  return files;
}

TEST(StatePair, NeitherFileIsAFirstStart) {
  const auto verdict = judged({});
  EXPECT_THAT(verdict.fresh, IsEmpty());
  EXPECT_EQ(verdict.state.journal, (JournalMark{.pair = "new", .line = 0}));
  EXPECT_EQ(verdict.doubt, "");
}

TEST(StatePair, AnIntactPairGoesOn) {
  const auto verdict = judged(intact());
  EXPECT_EQ(to_string(verdict.fresh), "");
  EXPECT_EQ(verdict.state, generation(40));
  EXPECT_EQ(verdict.doubt, "");
}

TEST(StatePair, WhatAKillLeavesIsNoConviction) {
  const std::vector<std::pair<const char*, FoundFiles>> cases = {
      {"first start: the state is saved, the journal is not there yet", {.state = state(1, "p", 0)}},
      {"first start: the journal is there, the state does not know it yet",
       {.state = state(1, "p", 0), .journal = journal(3, 1)}},
      {"first start: saved twice, the journal was not told yet",
       {.state = state(2, "p", 3), .previous = state(1, "p", 0), .journal = journal(3, 1)}},
      {"a save: the journal was not told yet",
       {.state = state(41), .previous = state(40), .journal = journal(120, 40)}},
      {"a save: the generation before is a second name of the newest",
       with(&FoundFiles::previous, state(40))},
      {"the journal is further than the state knows", with(&FoundFiles::journal, journal(5000, 40))},
      {"upgrade: the state is of today, the journal of before",
       {.state = state(41, "p", 0), .previous = state(40, "", 0), .journal = journal_of_before()}},
      {"both of before",
       {.state = state(41, "", 0), .previous = state(40, "", 0), .journal = journal_of_before()}},
      {"of before there were journals", {.state = state(41, "", 0), .previous = state(40, "", 0)}},
  };
  for (const auto& [name, files] : cases) {
    const auto verdict = judged(files);
    EXPECT_EQ(to_string(verdict.fresh), "") << name;
    EXPECT_EQ(verdict.doubt, "") << name;
    EXPECT_NE(verdict.state.journal.pair, "") << name << ": from now on it has one";
    EXPECT_LT(verdict.state.state.start_count, start_count_jump) << name;
  }
}

TEST(StatePair, EachFileConvictsTheOther) {
  EXPECT_EQ(found(with(&FoundFiles::state, {})), "state.v1 is missing: there was generation 40");
  EXPECT_EQ(found(with(&FoundFiles::state, state(12))),
            "state.v1 was rolled back: it has generation 12, but there was generation 40");
  EXPECT_EQ(found({.state = state(39), .previous = state(39), .journal = journal(120, 40)}),
            "state.v1 was rolled back: it has generation 39, but there was generation 40")
      << "the generation before in its place";
  EXPECT_EQ(found(with(&FoundFiles::state, state(40, "", 0))), "state.v1 was rolled back")
      << "to before the journal vouched for it";
  EXPECT_THAT(found(with(&FoundFiles::state, file("noise"))),
              HasSubstr("state.v1 is damaged: there was generation 40"));
  EXPECT_EQ(found(with(&FoundFiles::state, not_regular())),
            "state.v1 is no regular file: there was generation 40 (it is a FIFO)");
  EXPECT_EQ(found(with(&FoundFiles::journal, {})), "journal.v1 is missing: there was line 100");
  EXPECT_EQ(found(with(&FoundFiles::journal, not_regular())),
            "journal.v1 is no regular file: there was line 100 (it is a FIFO)");
  EXPECT_EQ(found(with(&FoundFiles::journal, journal(99, 40))),
            "journal.v1 was rolled back: it has line 99, but there was line 100");
  EXPECT_EQ(found(with(&FoundFiles::journal, journal_of_before())),
            "journal.v1 was rolled back: it has line 9, but there was line 100");
  EXPECT_THAT(found(with(&FoundFiles::journal, journal(120, 40, "q"))),
              HasSubstr("does not belong to the other"));
  EXPECT_THAT(found(with(&FoundFiles::journal, file("noise"))), HasSubstr("journal.v1 is damaged"));
  EXPECT_EQ(found(with(&FoundFiles::previous, {})), "state.v1.previous is missing: there was generation 39")
      << "copied to another computer without it";
  EXPECT_EQ(found(with(&FoundFiles::previous, state(41))),
            "state.v1 was rolled back: it has generation 40, but there was generation 41");
  EXPECT_EQ(
      found({.state = state(12, "p", 30), .previous = state(39), .journal = journal(31, 12)}),
      "state.v1 was rolled back: it has generation 12, but there was generation 39; journal.v1 was rolled "
      "back: it has line 31, but there was line 100")
      << "old copies of both";
}

TEST(StatePair, TheMarkTellsOfLinesThatTheStateDoesNotKnowYet) {
  const auto marked = [](std::uint64_t line, const std::string& pair) {
    return with(&FoundFiles::mark, file(encode_mark({.pair = pair, .line = line})));
  };
  EXPECT_EQ(found(marked(121, "p")), "journal.v1 was rolled back: it has line 120, but there was line 121");
  EXPECT_EQ(found(marked(120, "p")), "") << "as it is";
  EXPECT_EQ(found(marked(7, "p")), "") << "a power failure left an older one";
  EXPECT_EQ(found(marked(121, "q")), "") << "of another journal";
  for (const auto* text : {"", "axisd-mark 1", "axisd-mark 1 pair=p journal_line=121 crc32=00000000\n"})
    EXPECT_EQ(found(with(&FoundFiles::mark, file(text))), "") << text;
  EXPECT_EQ(found(with(&FoundFiles::mark, not_regular())), "");
}

TEST(StatePair, SwappedFilesAreReadAsWhatTheyAre) {
  auto files = intact();
  std::swap(files.state, files.journal);
  const auto verdict = judged(files);
  EXPECT_THAT(to_string(verdict.fresh), HasSubstr("holds what belongs into another file"));
  EXPECT_EQ(verdict.state.number, 40U);
  EXPECT_TRUE(verdict.journal);
  EXPECT_EQ(verdict.doubt, "");
}

TEST(StatePair, AConvictionCostsTrustAndCountsFarAhead) {
  const auto rolled_back = judged(with(&FoundFiles::state, state(12)));
  EXPECT_EQ(rolled_back.state.state.axes.at("x").offset->trust, PositionTrust::unknown);
  EXPECT_EQ(rolled_back.state.state.start_count, 20U + start_count_jump) << "as the journal knows it";
  EXPECT_EQ(rolled_back.state.number, 40U);
  EXPECT_EQ(rolled_back.state.journal, (JournalMark{.pair = "new", .line = 0}))
      << "no older copy fits any more";
  EXPECT_THAT(rolled_back.aside, ElementsAre(KeptFile::state));
  EXPECT_EQ(rolled_back.doubt, "") << "the journal knows all requests";
  ASSERT_EQ(rolled_back.state.state.convictions.size(), 1U);
  EXPECT_EQ(rolled_back.state.state.convictions[0].since, noon);
  const auto lost = judged(with(&FoundFiles::journal, {}));
  EXPECT_EQ(lost.state.state.axes.at("x").offset->trust, PositionTrust::unknown)
      << "nobody vouches for the state";
  EXPECT_EQ(lost.state.state.start_count, 20U + start_count_jump);
  EXPECT_THAT(lost.doubt, HasSubstr("journal.v1 is missing"));
}

TEST(StatePair, TheSameAgainIsNotConvictedTwice) {
  auto once = generation(40);
  once.state.convictions = {{.file = KeptFile::journal, .fault = KeptFault::missing, .since = WallTime{}}};
  const auto again = judged({.state = file(encode(once)), .previous = state(39)});
  ASSERT_EQ(again.state.state.convictions.size(), 1U);
  EXPECT_EQ(again.state.state.convictions[0].since, WallTime{}) << "since when it was found first";
}

TEST(StatePair, AKillAfterAConvictionKeepsTheDoubt) {
  auto convicted = generation(41, "new", 0);
  convicted.state.convictions = {{.file = KeptFile::journal, .fault = KeptFault::rolled_back}};
  for (const auto& left : {journal(50, 20), FoundFile{}}) {
    const auto again = judged({.state = file(encode(convicted)), .previous = state(40), .journal = left});
    EXPECT_EQ(to_string(again.fresh), "");
    EXPECT_EQ(again.state.state.convictions.size(), 1U);
    EXPECT_NE(again.doubt, "");
  }
  // As the one before, with a state that was missing: the generation before it is further back.
  convicted.state.convictions = {{.file = KeptFile::state, .fault = KeptFault::missing}};
  const auto again =
      judged({.state = file(encode(convicted)), .previous = state(39), .journal = journal(120, 40)});
  EXPECT_EQ(to_string(again.fresh), "");
}

TEST(StatePair, LatchAndHoldsOutliveEitherFile) {
  auto latched = generation(40);
  latched.state.inhibit = {.active = true, .by = "panel", .since = noon};
  latched.state.axes["x"].holds[{.holder = "hmi", .request_id = "r1"}] = noon;
  const FoundFiles files{.state = file(encode(latched)),
                         .previous = state(39),
                         .journal = file(std::string(journal_header) + encode_line(120, line_of(latched)))};
  for (auto which : {&FoundFiles::state, &FoundFiles::journal})
    for (const auto& damage : {FoundFile{}, file("noise"), not_regular()}) {
      auto damaged = files;
      damaged.*which = damage;
      const auto verdict = judged(damaged);
      EXPECT_FALSE(verdict.fresh.empty());
      EXPECT_EQ(verdict.state.state.inhibit, latched.state.inhibit);
      EXPECT_EQ(verdict.state.state.axes.at("x").holds.size(), 1U);
    }
  auto neither_state = files;
  neither_state.state = neither_state.previous = file("noise");
  const auto verdict = judged(neither_state);
  EXPECT_EQ(verdict.state.state.inhibit, latched.state.inhibit);
  EXPECT_EQ(verdict.state.state.start_count, 20U + start_count_jump);
}

TEST(StatePair, WhereNobodyKnowsTheMachineIsLatched) {
  const auto verdict = judged({.state = file("noise"), .previous = state(39), .journal = file("noise")});
  EXPECT_TRUE(verdict.state.state.inhibit.active);
  EXPECT_THAT(verdict.state.state.inhibit.by, HasSubstr("not known"));
  EXPECT_TRUE(judged({.state = state(39), .previous = state(39), .journal = file("noise")})
                  .state.state.inhibit.active)
      << "the generation before may have taken the newest one's place";
  for (const auto& journal : {FoundFile{}, file("noise"), not_regular(), journal_of_before()})
    EXPECT_TRUE(judged({.state = state(12, "p", 30), .previous = state(11, "p", 30), .journal = journal})
                    .state.state.inhibit.active)
        << "old copies of both state files, which no journal convicts";
  EXPECT_FALSE(judged(with(&FoundFiles::state, state(12))).state.state.inhibit.active) << "the journal knows";
}

TEST(StatePair, OldCopiesThatNobodyElseKnowsAreNotTrusted) {
  // Each time two files agree, and may be old; the third that would tell cannot be read.
  for (const auto& files :
       {FoundFiles{.state = state(12, "p", 30), .previous = {}, .journal = journal(31, 12)},
        FoundFiles{.state = not_regular(), .previous = state(11, "p", 30), .journal = journal(31, 12)},
        FoundFiles{.state = file("noise"), .previous = state(9), .journal = journal(120, 40)},
        FoundFiles{.state = file("noise"), .previous = state(39), .journal = journal(110, 39)},
        FoundFiles{.state = state(12, "p", 30), .previous = state(39), .journal = journal(110, 39)}}) {
    const auto verdict = judged(files);
    EXPECT_TRUE(verdict.state.state.inhibit.active);
    EXPECT_NE(verdict.doubt, "") << "requests that it does not know may have been executed";
    EXPECT_GT(verdict.state.state.start_count, start_count_jump);
  }
}

TEST(StatePair, WithoutACountOfStartsThereIsNone) {
  for (const auto& left : {FoundFile{}, file("noise"), journal_of_before()}) {
    const auto refused = judge({.state = file("noise"), .previous = file("x"), .journal = left}, "new", noon);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().reason, Reason::storage);
    EXPECT_THAT(refused.error().message, HasSubstr("state.v1"));
    EXPECT_THAT(refused.error().remedy, HasSubstr("homing"));
  }
  EXPECT_FALSE(judge({.journal = journal_of_before()}, "new", noon));
}

TEST(StatePair, ANewerFormatIsNotTakenForDamage) {
  const auto refused = judge(with(&FoundFiles::journal, file("axisd-journal 4\nwhatever\n")), "new", noon);
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message, HasSubstr("journal.v1 was written by a newer axisd"));
}

}  // namespace
}  // namespace axisd::store
