// What any page may say over its lane, at any pace, while the daemon answers as it likes.
#include <string>
#include <variant>
#include <vector>

#include "api/web/gateway/lane_state.hpp"
#include "tests/fuzz/target.hpp"

namespace axisd::fuzz {

void run(Input input) {
  using namespace web;
  TimePoint now{std::chrono::hours(1)};
  std::uint64_t last = 0;
  LaneState lane([&] { return ++last; });
  std::vector<std::uint64_t> open;
  bool closed = false;
  const auto take = [&](const LaneEffects& effects, bool of_the_page) {
    for (const auto& effect : effects) {
      if (const auto* call = std::get_if<LaneCall>(&effect)) {
        expect(of_the_page || is_stop(call->method), "nothing starts or renews by itself");
        open.push_back(call->number);
      } else if (std::holds_alternative<LaneClose>(effect)) {
        closed = true;
      } else {
        expect(!closed, "nothing is said behind the end");
      }
    }
  };
  while (!input.empty()) {
    const auto what = input.byte();
    now += std::chrono::milliseconds(input.byte());
    if (what % 4 == 0 && !open.empty()) {
      const auto place = input.byte() % open.size();
      const auto number = open[place];
      open.erase(open.begin() + static_cast<std::ptrdiff_t>(place));
      const auto status = static_cast<int>(input.byte() % 17);
      take(lane.answered(number, {.code = status}, text(input.take(input.byte() % 32)), now), false);
    } else if (what % 4 == 1) {
      take(lane.pass(now), false);
    } else {
      take(lane.receive(text(input.take(input.byte())), now), true);
    }
  }
  take(lane.close(now), false);
  // Once the daemon has answered everything, nothing is owed any more.
  for (int i = 0; i < 1000 && !lane.at_rest(); ++i) {
    for (const auto number : std::exchange(open, {})) take(lane.answered(number, {}, {}, now), false);
    now = std::max(now, lane.next_due() == TimePoint::max() ? now : lane.next_due());
    take(lane.pass(now), false);
  }
  expect(lane.at_rest(), "it comes to rest");
}

}  // namespace axisd::fuzz
