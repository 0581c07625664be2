// The register table of the SSD2608PR, manual 6.1, with the corrections of parameters_common.hpp. Inputs
// X0..X4 are at 0x0041..0x0045 as this table prints them; the wiring example of 4.3 writes X0..X2 at
// 0x0043..0x0045, which it has from a model with PU and DR in front.
#include "devices/ssd2608pr/parameters.hpp"

#include <array>
#include <string_view>

#include "devices/yako_rtu/parameters_closed_loop.hpp"
#include "devices/yako_rtu/parameters_common.hpp"

namespace axisd::ssd2608pr {

using namespace yako_rtu;

namespace {

using enum Access;

constexpr StatusGroup status{
    .model_code = 0x0305,
    .model_text = "Drive model code; the ESS42-R has the same",
    .alarm_text = "0 none, 1 overcurrent, 2 overvoltage, 3 undervoltage, 4 EEPROM, 5 position deviation",
    .inputs_text = "Active inputs: bit 0 X0 ... 4 X4",
    .outputs_text = "Active outputs: bit 0 Y0 ... 2 Y2",
};

constexpr std::string_view output_function_text =
    "Function of the output: 0 none, 1 alarm, 2 running, 3 homed, 4 in position, 5 in PT mode; 6..8 "
    "unused";

// clang-format off
constexpr auto terminal_rows = std::to_array<ParameterSpec>({
    {0x0040, "input_levels", rw_saved, 0, 65535, 0, "",
     "1 inverts an input: bit 0 X0 ... 4 X4; 0: high level or rising edge is active"},
    {0x0041, "input_function_x0", rw_saved, 0, 20, 0, "", input_function_text},
    {0x0042, "input_function_x1", rw_saved, 0, 20, 0, "", input_function_text},
    {0x0043, "input_function_x2", rw_saved, 0, 20, 0, "", input_function_text},
    {0x0044, "input_function_x3", rw_saved, 0, 20, 0, "", input_function_text},
    {0x0045, "input_function_x4", rw_saved, 0, 20, 0, "", input_function_text},
    {0x004B, "output_levels", rw_saved, 0, 65535, 0, "", "1 inverts an output: bit 0 Y0 ... 2 Y2"},
    {0x004C, "output_function_y0", rw_saved, 0, 8, 0, "", output_function_text},
    {0x004D, "output_function_y1", rw_saved, 0, 8, 0, "", output_function_text},
    {0x004E, "output_function_y2", rw_saved, 0, 8, 0, "", output_function_text},
});

constexpr auto table = join(
    status_rows(status),
    closed_loop_control_rows, custom_serial_rows, format_and_eeprom_rows, closed_loop_overtravel_rows,
    motion_rows(1),
    homing_rows,
    terminal_rows,
    segment_rows<segment_pulses_high>(), segment_rows<segment_pulses_low>(), segment_rows<segment_speed>(),
    segment_rows<segment_time>(), segment_rows<segment_pv_speed>(),
    closed_loop_performance_rows);
// clang-format on

}  // namespace

std::span<const ParameterSpec> parameters() { return table; }

}  // namespace axisd::ssd2608pr
