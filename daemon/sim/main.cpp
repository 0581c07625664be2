// axisd-sim: simulated drives on a pseudo terminal or a CAN interface, as a program of its own.
#include <fmt/format.h>

#include "daemon/sim/options.hpp"
#include "daemon/sim/serve.hpp"
#include "devices/simulation/simulator.hpp"

namespace {

void print_switches() {
  for (const auto* simulator : axisd::simulation::simulators())
    for (const auto& one : simulator->switches)
      fmt::print("{} {}={} {}\n", simulator->model, one.name, one.default_value ? "on" : "off", one.meaning);
}

}  // namespace

int main(int argc, char** argv) {
  const auto options = axisd::sim::parse_options(argc, argv);
  if (options.list_switches) {
    print_switches();
    return 0;
  }
  return options.can.empty() ? serve_rtu(options) : serve_can(options);
}
