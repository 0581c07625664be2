#include "devices/axis/known_ids.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "devices/axis/id_limits.hpp"

namespace axisd {
namespace {

using std::chrono::seconds;

const TimePoint start{std::chrono::hours(1)};

Command done(const std::string& id) { return {.id = id, .state = CommandState::done}; }

/// Ids r<first>, ... of commands i-<first>, ..., one each millisecond.
std::vector<IdRun> run_of(int first, int count, TimePoint from = start) {
  std::vector<Command> commands;
  commands.reserve(static_cast<std::size_t>(count));
  std::vector<std::string> names;
  names.reserve(static_cast<std::size_t>(count));
  for (int i = first; i < first + count; ++i) {
    commands.push_back(done(fmt::format("i-{}", i)));
    names.push_back(fmt::format("r{}", i));
  }
  std::vector<EndedId> ids;
  ids.reserve(commands.size());
  for (std::size_t i = 0; i < commands.size(); ++i)
    ids.push_back({.request_id = names[i],
                   .digest = "same",
                   .command = &commands[i],
                   .heard_of = from + milliseconds(first + static_cast<int>(i))});
  return runs_of(std::move(ids));
}

TEST(KnownIds, TellsWhatBecameOfARequest) {
  Command failed{.id = "5a1b2-70000000000", .state = CommandState::error};
  failed.cause = Error{.reason = Reason::not_reached, .outcome = Outcome::unknown};
  const auto plain = done("without a number");
  KnownIds known;
  for (auto& run :
       runs_of({{.request_id = "r", .digest = "x home", .command = &failed, .heard_of = start},
                {.request_id = "q", .digest = "x home", .command = &plain, .heard_of = start + seconds(2)}}))
    known.add(std::move(run));
  EXPECT_EQ(known.size(), 2);
  const auto found = known.find("r", "x home");
  ASSERT_TRUE(found);
  EXPECT_TRUE(found->same_content);
  EXPECT_EQ(found->heard_of, start);
  EXPECT_EQ(found->command.id, failed.id);
  EXPECT_EQ(found->command.state, CommandState::error);
  EXPECT_EQ(found->command.cause->reason, Reason::not_reached);
  EXPECT_EQ(found->command.cause->outcome, Outcome::unknown);
  EXPECT_FALSE(known.find("r", "x enable")->same_content);
  EXPECT_EQ(known.find("q", "x home")->command.id, plain.id);
  EXPECT_FALSE(known.find("q", "x home")->command.cause);
  EXPECT_FALSE(known.find("s", "x home"));
}

TEST(KnownIds, FindsEachOfManyInFewRuns) {
  KnownIds known;
  constexpr int count = 200'000, batch = 500;
  for (int first = 0; first < count; first += batch)
    for (auto& run : run_of(first, batch)) known.add(std::move(run));
  ASSERT_EQ(known.size(), count);
  for (int i = 0; i < count; i += 37) {
    const auto found = known.find(fmt::format("r{}", i), "same");
    ASSERT_TRUE(found) << i;
    EXPECT_EQ(found->command.id, i == 0 ? "i-0" : fmt::format("i-{}", i));
    EXPECT_EQ(found->heard_of, start + milliseconds(i));
  }
  EXPECT_FALSE(known.find(fmt::format("r{}", count), "same"));
  EXPECT_LT(known.runs().size(), 20) << "each is searched";
}

TEST(KnownIds, ForgetsWhatWasHeardOfFirstAndNothingTooEarly) {
  KnownIds known;
  for (int minute = 0; minute < 10; ++minute)
    for (auto& run : run_of(minute * 60'000 + 1, 10)) known.add(std::move(run));
  EXPECT_EQ(known.oldest(), start + milliseconds(10));
  EXPECT_EQ(known.forget_one(start + milliseconds(10)), 0);
  EXPECT_EQ(known.forget_one(start + milliseconds(11)), 10);
  EXPECT_FALSE(known.find("r1", "same"));
  EXPECT_TRUE(known.find("r60001", "same"));
  while (known.forget_one(TimePoint::max()) > 0) {
  }
  EXPECT_EQ(known.size(), 0);
}

TEST(KnownIds, OfTheSameIdTheLaterOneCounts) {
  KnownIds known;
  for (auto& run : run_of(5, 1)) known.add(std::move(run));
  for (auto& run : run_of(5, 1, start + seconds(5))) known.add(std::move(run));
  EXPECT_EQ(known.runs().size(), 1);
  EXPECT_EQ(known.find("r5", "same")->heard_of, start + seconds(5) + milliseconds(5));
}

TEST(IdLimits, ThereIsAlwaysRoomForOneMore) {
  const IdLimits limits{.total = 90'000};
  std::size_t all = 0;
  std::size_t before = limits.total;
  for (int client = 0; client < 6; ++client) {
    const auto share = limits.share(all);
    EXPECT_LE(share, before);
    EXPECT_GE(share, limits.guaranteed());
    before = share;
    all += share;
  }
  EXPECT_EQ(limits.share(0), 60'000);
  EXPECT_EQ(limits.share(60'000), 20'000);
  EXPECT_EQ(limits.share(limits.total), limits.guaranteed()) << "from the reserve";
  EXPECT_EQ(limits.share(limits.total + limits.reserve()), 0);
}

}  // namespace
}  // namespace axisd
