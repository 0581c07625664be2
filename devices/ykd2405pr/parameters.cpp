// The register table of the YKD2405PR, manual 6.1, with the corrections of parameters_common.hpp; 0x0001
// prints "V1.0", which its sister models give as 0x0100.
#include "devices/ykd2405pr/parameters.hpp"

#include <array>
#include <string_view>

#include "devices/yako_rtu/parameters_common.hpp"

namespace axisd::ykd2405pr {

using namespace yako_rtu;

namespace {

using enum Access;

constexpr StatusGroup status{
    .model_code = 0x0301,
    .model_text = "Drive model code; the manual gives 0x0301 / 0x0302 and not which is which",
    .alarm_text = "0 none, 1 overcurrent, 2 overvoltage, 3 undervoltage, 4 EEPROM, 5 position deviation",
    .inputs_text = "Active inputs: bit 0 PU, 1 DR, 2 X0 ... 9 X7",
    .outputs_text = "Active outputs: bit 0 Y0 ... 3 Y3",
};

constexpr std::string_view output_function_text =
    "Function of the output: 0 none, 1 alarm, 2 brake, 3 running, 4 homed, 5 in position, 6 in PT mode; "
    "7 and 8 unused";

// Printed so: 30..2000 with a default of 0. The other models print 0..2000.
constexpr SegmentBlock segment_time_from_30{
    .address = 0x00C0,
    .name = "time",
    .minimum = 30,
    .maximum = 2000,
    .unit = "ms",
    .mode = "PT and PV",
    .meaning = "acceleration and deceleration time; its default 0 cannot be written back"};

// clang-format off
constexpr auto current_rows = std::to_array<ParameterSpec>({
    {0x0010, "current", rw_saved, 0, 11, 6, "",
     "RMS current: 0 0.5 A, 1 0.8, 2 1.0, 3 1.2, 4 1.5, 5 1.9, 6 2.3, 7 2.7, 8 3.1, 9 3.5, 10 4.0, 11 4.2 A"},
    {0x0011, "microstep", rw_saved, 0, 15, 8, "",
     "Pulses per revolution: 0..7 200 x 2^n, 8 1000, 9 2000, 10 4000, 11 5000, 12 8000, 13 10000, 14 "
     "20000, 15 40000"},
    {0x0012, "lock_current", rw_saved, 0, 1, 0, "", "Current at standstill: 0 half, 1 full"},
});

constexpr auto control_rows = std::to_array<ParameterSpec>({
    {0x0017, "overtravel_stop", rw_saved, 0, 2, 0, "",
     "At a limit terminal: 0 free stop, 1 quick stop, 2 ignore the limit"},
    {0x0018, "control_mode", rw_saved, 0, 2, 0, "",
     "0 bus, 1 pulse and direction, 2 double pulse; the external modes from the next power-up, and with the "
     "functions of PU and DR at 0"},
});

constexpr auto terminal_rows = std::to_array<ParameterSpec>({
    {0x0040, "input_levels", rw_saved, 0, 65535, 0, "",
     "1 inverts an input: bit 0 PU, 1 DR, 2 X0 ... 9 X7; 0: high level or rising edge is active"},
    {0x0041, "input_function_pu", rw_saved, 0, 20, 0, "", input_function_text},
    {0x0042, "input_function_dr", rw_saved, 0, 20, 0, "", input_function_text},
    {0x0043, "input_function_x0", rw_saved, 0, 20, 0, "", input_function_text},
    {0x0044, "input_function_x1", rw_saved, 0, 20, 0, "", input_function_text},
    {0x0045, "input_function_x2", rw_saved, 0, 20, 0, "", input_function_text},
    {0x0046, "input_function_x3", rw_saved, 0, 20, 0, "", input_function_text},
    {0x0047, "input_function_x4", rw_saved, 0, 20, 0, "", input_function_text},
    {0x0048, "input_function_x5", rw_saved, 0, 20, 0, "", input_function_text},
    {0x0049, "input_function_x6", rw_saved, 0, 20, 0, "", input_function_text},
    {0x004A, "input_function_x7", rw_saved, 0, 20, 0, "", input_function_text},
    {0x004B, "output_levels", rw_saved, 0, 65535, 0, "", "1 inverts an output: bit 0 Y0 ... 3 Y3"},
    {0x004C, "output_function_y0", rw_saved, 0, 8, 0, "", output_function_text},
    {0x004D, "output_function_y1", rw_saved, 0, 8, 0, "", output_function_text},
    {0x004E, "output_function_y2", rw_saved, 0, 8, 0, "", output_function_text},
    {0x004F, "output_function_y3", rw_saved, 0, 8, 0, "", output_function_text},
});

constexpr auto performance_rows = std::to_array<ParameterSpec>({
    {0x0110, "current_loop_proportional", rw_saved, 0, 65535, {}, "",
     "Current loop, proportional coefficient; factory setting"},
    {0x0111, "current_loop_integral", rw_saved, 0, 65535, {}, "",
     "Current loop, integral coefficient; factory setting"},
    {0x0112, "high_speed_proportional", rw_saved, 0, 65535, {}, "",
     "High speed, proportional coefficient; factory setting"},
    {0x0113, "high_speed_integral", rw_saved, 0, 65535, {}, "",
     "High speed, integral coefficient; factory setting"},
    {0x0114, "holding_proportional", rw_saved, 0, 65535, {}, "",
     "Holding at standstill, proportional coefficient; factory setting"},
    {0x0115, "holding_integral", rw_saved, 0, 65535, {}, "",
     "Holding at standstill, integral coefficient; factory setting"},
    {0x0116, "input_filter_x0_x1", rw_saved, 0, 65535, 10, "",
     "Filter of inputs X0 and X1; the manual gives no unit"},
    {0x0117, "input_filter_x2_x3", rw_saved, 0, 65535, 10, "",
     "Filter of inputs X2 and X3; the manual gives no unit"},
    {0x0118, "input_filter_x4_x5", rw_saved, 0, 65535, 10, "",
     "Filter of inputs X4 and X5; the manual gives no unit"},
    {0x0119, "input_filter_x6_x7", rw_saved, 0, 65535, 10, "",
     "Filter of inputs X6 and X7; the manual gives no unit"},
});

constexpr auto table = join(
    status_rows(status),
    current_rows, custom_serial_rows, format_and_eeprom_rows, control_rows,
    motion_rows(2),
    homing_rows,
    terminal_rows,
    segment_rows<segment_pulses_high>(), segment_rows<segment_pulses_low>(), segment_rows<segment_speed>(),
    segment_rows<segment_time_from_30>(), segment_rows<segment_pv_speed>(),
    performance_rows);
// clang-format on

}  // namespace

std::span<const ParameterSpec> parameters() { return table; }

}  // namespace axisd::ykd2405pr
