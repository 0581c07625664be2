// The ESS42-R to simulate: manual V1.0, sections as noted.
#include "devices/ess42_r/parameters.hpp"
#include "devices/yako_rtu/simulator_model.hpp"

namespace axisd::ess42_r {

namespace {

using yako_rtu::Output;

constexpr TerminalSpec inputs[] = {{"X0"}, {"X1"}, {"X2"}, {"X3"}};  // 6.1, bits of 0x0008
// 6.1, 0x004C: neither brake nor PT mode.
constexpr Output outputs[] = {Output::none, Output::alarm, Output::moving, Output::homed,
                              Output::in_position};
constexpr int alarms[] = {1, 2, 3, 5};  // 8

constexpr yako_rtu::SimulatedModel model{
    .name = "ess42-r",
    .parameters = &parameters,
    .last = 0x0139,
    .pulses_per_revolution = {400, 800, 1600, 3200, 6400, 12800, 25600, 51200, 1000, 2000, 4000, 5000, 8000,
                              10000, 20000, 40000},
    .inputs = inputs,
    .first_input_function = 0x0043,
    .first_filter = 0x0137,
    .outputs = 2,
    .output_functions = outputs,
    .alarms = alarms,
    .homing_mode_1_ends_forwards = true,
    .closed_loop = true,
    .overtravel_saved = false,
    .segments = 7,  // note of 7.3.2
    .custom_bauds = {115200, 38400, 19200, 9600},
    .dip_bauds = {},  // 4.4: its switches have only the address; 0x0014 counts
    .maximum_dip_address = 15,
    .first_custom_address = 1,
    .last_custom_address = 32,
    .undefined_custom_address = 1,  // 0x0013: any other value
};

}  // namespace

/// Called by the list of all models, which is made from their folders.
std::span<const simulation::Simulator> simulators();
std::span<const simulation::Simulator> simulators() { return yako_rtu::simulators_of<model>(); }

}  // namespace axisd::ess42_r
