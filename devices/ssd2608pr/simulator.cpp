// The SSD2608PR to simulate: manual V1.1, sections as noted.
#include "devices/ssd2608pr/parameters.hpp"
#include "devices/yako_rtu/simulator_model.hpp"

namespace axisd::ssd2608pr {

namespace {

using yako_rtu::Output;

constexpr TerminalSpec inputs[] = {{"X0"}, {"X1"}, {"X2"}, {"X3"}, {"X4"}};  // 6.1, bits of 0x0008
// 6.1, 0x004C: no brake.
constexpr Output outputs[] = {Output::none,  Output::alarm,       Output::moving,
                              Output::homed, Output::in_position, Output::pt_mode};
constexpr int alarms[] = {1, 2, 3, 4, 5};            // 8
constexpr int dip_bauds[] = {19200, 38400, 115200};  // 4.4, SW6 and SW7; both on is 0x0014

constexpr yako_rtu::SimulatedModel model{
    .name = "ssd2608pr",
    .parameters = &parameters,
    .last = 0x0139,
    .pulses_per_revolution = {400, 800, 1600, 3200, 6400, 12800, 25600, 51200, 1000, 2000, 4000, 5000, 8000,
                              10000, 20000, 40000},
    .inputs = inputs,
    .first_input_function = 0x0041,
    .other_first_input_function = 0x0043,
    .first_filter = 0x0137,
    .outputs = 3,
    .output_functions = outputs,
    .alarms = alarms,
    .homing_mode_1_ends_forwards = true,
    .closed_loop = true,
    .overtravel_saved = false,
    .custom_bauds = {9600, 14400, 128000, 256000},
    .dip_bauds = dip_bauds,
    .maximum_dip_address = 31,
    .first_custom_address = 32,
    .last_custom_address = 127,
};

}  // namespace

/// Called by the list of all models, which is made from their folders.
std::span<const simulation::Simulator> simulators();
std::span<const simulation::Simulator> simulators() { return yako_rtu::simulators_of<model>(); }

}  // namespace axisd::ssd2608pr
