// The messages of the stop lane's calls, and what they are answered with.
#include <string>

#include "api/server/lane/stop_calls.hpp"
#include "tests/fuzz/target.hpp"
#include "tests/unit/api/fake_machine.hpp"

namespace axisd::fuzz {

void run(Input input) {
  using server::lane::StopCalls;
  static testing::FakeMachine machine;
  static StopCalls calls(machine);
  static const auto paths = StopCalls::paths();
  const auto path = input.byte() % (paths.size() + 1);
  calls.start({.stream = 1,
               .path = std::string(path < paths.size() ? paths[path] : "/axisd.v1.AxisService/Home"),
               .message = std::string(text(input.rest()))},
              {.name = "fuzz"}, [](StopCalls::Make make) { (void)make(); });
}

}  // namespace axisd::fuzz
