// The messages of the stop lane's calls, and what they are answered with.
#include <memory>
#include <string>

#include "api/server/lane/stop_calls.hpp"
#include "tests/fuzz/target.hpp"
#include "tests/unit/api/fake_machine.hpp"

namespace axisd::fuzz {
namespace {

/// A machine that does everything on this thread. It remembers all that it was asked, so it does not live for
/// ever.
struct Lane {
  Lane() { machine.hold(); }
  testing::FakeMachine machine;
  server::lane::StopCalls calls{machine};
};

Lane& lane() {
  constexpr int most = 10'000;
  static std::unique_ptr<Lane> made;
  static int asked = 0;
  if (asked++ % most == 0) made = std::make_unique<Lane>();
  return *made;
}

std::optional<std::string> claim(Input& input) {
  const auto size = input.byte() % 16U;
  return size == 0 ? std::nullopt : std::optional(std::string(text(input.take(size))));
}

}  // namespace

void run(Input input) {
  using server::lane::StopCalls;
  static const auto paths = StopCalls::paths();
  const auto path = input.byte() % (paths.size() + 1);
  const auto kind = input.byte();
  server::Claim claimed;
  // Of most calls nobody claims anything.
  if (kind % 4 == 0) claimed = {.user = claim(input), .role = claim(input)};
  auto& [machine, calls] = lane();
  int answers = 0;
  calls.start({.stream = 1,
               .path = std::string(path < paths.size() ? paths[path] : "/axisd.v1.AxisService/Home"),
               .message = std::string(text(input.rest())),
               .claim = std::move(claimed)},
              {.name = "fuzz"}, [&](StopCalls::Make make) {
                const auto answer = make();
                expect(answer.code != 0 || answer.error.empty(), "what succeeds says no error");
                ++answers;
              });
  machine.run_held();
  expect(answers == 1, "each call is answered once");
}

}  // namespace axisd::fuzz
