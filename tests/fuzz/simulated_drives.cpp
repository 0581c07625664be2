// What whoever may connect to the control socket of simulated drives says there, line by line.
#include <algorithm>
#include <chrono>

#include "devices/simulation/control.hpp"
#include "devices/simulation/simulator.hpp"
#include "tests/fuzz/target.hpp"

namespace axisd::fuzz {

void run(Input input) {
  TimePoint now{std::chrono::seconds(1)};
  simulation::RtuNetwork network;
  network.advance(now);
  simulation::SimulatedNodeSettings settings;
  settings.address = 1;
  network.add(*simulation::make_node("ykd2405pr", settings));
  for (auto rest = text(input.rest()); !rest.empty();) {
    const auto line = rest.substr(0, rest.find('\n'));
    rest.remove_prefix(std::min(line.size() + 1, rest.size()));
    const auto reply = simulation::execute_control(network, line);
    expect(reply.starts_with("ok") || reply.starts_with("error"), "each command has its reply");
    expect(!reply.contains('\n'), "a reply is one line");
    network.advance(now += std::chrono::milliseconds(10));
  }
}

}  // namespace axisd::fuzz
