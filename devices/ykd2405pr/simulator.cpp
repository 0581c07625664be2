#include "devices/yako_rtu/simulator.hpp"

namespace axisd::ykd2405pr {

namespace {

std::unique_ptr<simulation::SimulatedRtuNode> make(simulation::SimulatedNodeSettings settings) {
  return std::make_unique<yako_rtu::SimulatedDrive>(std::move(settings));
}

}  // namespace

std::span<const simulation::Simulator> simulators() {
  static const simulation::Simulator all[] = {{.model = "ykd2405pr",
                                               .make = &make,
                                               .switches = yako_rtu::switch_specs(),
                                               .inputs = yako_rtu::Terminals::names()}};
  return all;
}

}  // namespace axisd::ykd2405pr
