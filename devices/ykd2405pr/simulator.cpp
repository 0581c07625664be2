// The YKD2405PR to simulate: manual V1.3, sections as noted.
#include "devices/yako_rtu/simulator_model.hpp"
#include "devices/ykd2405pr/parameters.hpp"

namespace axisd::ykd2405pr {

namespace {

using yako_rtu::Output;

// 6.1, bits of 0x0008.
constexpr TerminalSpec inputs[] = {{"PU"}, {"DR"}, {"X0"}, {"X1"}, {"X2"},
                                   {"X3"}, {"X4"}, {"X5"}, {"X6"}, {"X7"}};
// 6.1, 0x004C; 4.2.2 swaps 3 and 4.
constexpr Output outputs[] = {Output::none,  Output::alarm,       Output::brake,  Output::moving,
                              Output::homed, Output::in_position, Output::pt_mode};
constexpr int alarms[] = {1, 2, 3, 4, 5};            // 8
constexpr int dip_bauds[] = {19200, 38400, 115200};  // 4.4, SW6 and SW7; both on is 0x0014

constexpr yako_rtu::SimulatedModel model{
    .name = "ykd2405pr",
    .parameters = &parameters,
    .last = 0x0119,
    .other_model_code = 0x0302,
    .pulses_per_revolution = {200, 400, 800, 1600, 3200, 6400, 12800, 25600, 1000, 2000, 4000, 5000, 8000,
                              10000, 20000, 40000},
    .inputs = inputs,
    .first_input_function = 0x0041,
    .first_filter = 0x0116,
    .unfiltered_inputs = 2,
    .outputs = 4,
    .output_functions = outputs,
    .alarms = alarms,
    .pulse_input = true,
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

}  // namespace axisd::ykd2405pr
