// The register table of the ESS42-R, manual 6.1, with the corrections of parameters_common.hpp. Inputs begin
// at 0x0043: 0x0041 and 0x0042 do not exist.
#include "devices/ess42_r/parameters.hpp"

#include <array>
#include <string_view>

#include "devices/yako_rtu/parameters_closed_loop.hpp"
#include "devices/yako_rtu/parameters_common.hpp"

namespace axisd::ess42_r {

using namespace yako_rtu;

namespace {

using enum Access;

// 6.1 prints "1~5: errors" like its sisters; chapter 8 has no 4.
constexpr StatusGroup status{
    .model_code = 0x0305,
    .model_text = "Drive model code; the SSD2608PR has the same",
    .alarm_text = "0 none, 1 overcurrent, 2 overvoltage, 3 undervoltage, 5 position deviation",
    .inputs_text = "Active inputs: bit 0 X0 ... 3 X3",
    .outputs_text = "Active outputs: bit 0 Y0, 1 Y1",
};

constexpr std::string_view output_function_text =
    "Function of the output: 0 none, 1 alarm, 2 running, 3 homed, 4 in position; 5..8 unused";

// clang-format off
constexpr auto serial_rows = std::to_array<ParameterSpec>({
    {0x0013, "custom_node", rw_saved, 0, 127, 0, "",
     "Modbus address 1..32, used with all address switches off; any other value means address 1"},
    {0x0014, "custom_baud", rw_saved, 0, 3, 0, "",
     "0 115200, 1 38400, 2 19200, 3 9600 bit/s; from the next power-up"},
});

constexpr auto terminal_rows = std::to_array<ParameterSpec>({
    {0x0040, "input_levels", rw_saved, 0, 65535, 0, "",
     "1 inverts an input: bit 0 X0 ... 3 X3; 0: high level or rising edge is active"},
    {0x0043, "input_function_x0", rw_saved, 0, 20, 0, "", input_function_text},
    {0x0044, "input_function_x1", rw_saved, 0, 20, 0, "", input_function_text},
    {0x0045, "input_function_x2", rw_saved, 0, 20, 0, "", input_function_text},
    {0x0046, "input_function_x3", rw_saved, 0, 20, 0, "", input_function_text},
    {0x004B, "output_levels", rw_saved, 0, 65535, 0, "", "1 inverts an output: bit 0 Y0, 1 Y1"},
    {0x004C, "output_function_y0", rw_saved, 0, 8, 0, "", output_function_text},
    {0x004D, "output_function_y1", rw_saved, 0, 8, 0, "", output_function_text},
});

constexpr auto table = join(
    status_rows(status),
    closed_loop_control_rows, serial_rows, format_and_eeprom_rows, closed_loop_overtravel_rows,
    motion_rows(1),
    homing_rows,
    terminal_rows,
    segment_rows<segment_pulses_high>(), segment_rows<segment_pulses_low>(), segment_rows<segment_speed>(),
    segment_rows<segment_time>(), segment_rows<segment_pv_speed>(),
    closed_loop_performance_rows);
// clang-format on

}  // namespace

std::span<const ParameterSpec> parameters() { return table; }

}  // namespace axisd::ess42_r
