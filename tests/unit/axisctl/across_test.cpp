#include "api/axisctl/across.hpp"

#include <gmock/gmock.h>

#include <atomic>
#include <condition_variable>
#include <mutex>
#include <stdexcept>

namespace axisd::axisctl {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

TEST(Selection, WithoutWordsIsEverything) {
  const Selection all({});
  EXPECT_TRUE(all.everything());
  EXPECT_TRUE(all.has("press-9"));
  EXPECT_THAT(all.machines(), IsEmpty());
  EXPECT_THAT(all.axes_of("press-1"), IsEmpty());
}

TEST(Selection, OfMachinesAndAxes) {
  const Selection some({"press-2/b", "press-1", "press-2/a", "press-3/*"});
  EXPECT_FALSE(some.everything());
  EXPECT_THAT(some.machines(), ElementsAre("press-1", "press-2", "press-3"));
  EXPECT_THAT(some.axes_of("press-1"), IsEmpty());
  EXPECT_THAT(some.axes_of("press-2"), ElementsAre("press-2/b", "press-2/a"));
  EXPECT_THAT(some.axes_of("press-3"), IsEmpty());
  EXPECT_FALSE(some.has("press-4"));
}

TEST(Selection, AllOfAMachineIsMoreThanOneOfItsAxes) {
  EXPECT_THAT(Selection({"press-1/a", "press-1"}).axes_of("press-1"), IsEmpty());
  EXPECT_THAT(Selection({"press-1", "press-1/a"}).axes_of("press-1"), IsEmpty());
  EXPECT_TRUE(Selection({"press-1", "press-1/a"}).has("press-1"));
}

TEST(Selection, RefusesWhatIsNoName) {
  for (const auto* wrong : {"", "/", "press-1/", "*", "Press"})
    EXPECT_THROW(Selection({wrong}), Failure) << wrong;
}

TEST(ForEachMachine, RunsThemAtOnceAndEachOnce) {
  std::mutex mutex;
  std::condition_variable changed;
  std::vector<std::vector<std::size_t>> seen;
  for_each_machine({"a/x", "b/x", "a/y", "c/x"}, [&](const std::vector<std::size_t>& indices) {
    std::unique_lock lock(mutex);
    seen.push_back(indices);
    changed.notify_all();
    changed.wait(lock, [&] { return seen.size() == 3; });  // for ever, if one waited for another
  });
  EXPECT_THAT(seen, testing::UnorderedElementsAre(ElementsAre(0, 2), ElementsAre(1), ElementsAre(3)));
}

TEST(ForEachMachine, TellsWhatOneThrewWhenAllAreDone) {
  std::atomic<int> done = 0;
  EXPECT_THROW(for_each_machine({"a/x", "b/x"},
                                [&](const std::vector<std::size_t>& indices) {
                                  ++done;
                                  if (indices.front() == 0) throw std::runtime_error("a");
                                }),
               std::runtime_error);
  EXPECT_EQ(done, 2);
}

}  // namespace
}  // namespace axisd::axisctl
