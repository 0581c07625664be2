#include "devices/simulation/simulator.hpp"

namespace axisd::simulation {

const Simulator* find_simulator(std::string_view model) {
  for (const auto* simulator : simulators())
    if (simulator->model == model) return simulator;
  return nullptr;
}

}  // namespace axisd::simulation
