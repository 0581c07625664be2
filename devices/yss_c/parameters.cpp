// The object dictionary of the YSS-C, manual V1.1 chapter 7, with these corrections (the manual contradicts
// itself): 607Ah and 60FFh are printed U32, but their ranges are negative too, and 6.2.4 and 6.2.5 print I32;
// 6098h is printed with 0..3, but 6.2.6 has 17, 18, 24, 29: the range spans both lists. Entries that
// sub-index 0 counts but the table leaves out are taken as present (1018h:03, 1401h..1403h:05).
#include "devices/yss_c/parameters.hpp"

#include <array>
#include <limits>
#include <string_view>

#include "devices/parameter_rows.hpp"

namespace axisd::yss_c {

namespace {

using enum Access;
using enum ParameterType;

constexpr std::int64_t most_u8 = 255, most_u16 = 65535, most_u32 = 4294967295;

/// A row of the table as the manual prints it.
struct Row {
  std::uint16_t index;
  std::uint8_t sub;
  ParameterType type;
  Access access;
  std::int64_t minimum, maximum;
  std::optional<std::int64_t> default_value;
  std::string_view unit;
  std::string_view name;
  std::string_view description;
  std::string_view instead = {};
};

consteval ParameterSpec spec(const Row& row) {
  return {.address = std::uint32_t{row.index} << 8U | row.sub,
          .name = row.name,
          .access = row.access,
          .minimum = row.minimum,
          .maximum = row.maximum,
          .default_value = row.default_value,
          .unit = row.unit,
          .description = row.description,
          .instead = row.instead,
          .type = row.type};
}

template <std::size_t size>
consteval std::array<ParameterSpec, size> specs(const Row (&rows)[size]) {
  std::array<ParameterSpec, size> all{};
  for (std::size_t i = 0; i < size; ++i) all[i] = spec(rows[i]);
  return all;
}

// --- 1000h..1200h ---

constexpr std::string_view error_text = "Error that caused an EMCY, newest first; low 16 bits as in 603Fh";

// clang-format off
constexpr auto communication_rows = specs({
    {0x1000, 0, u32, ro, 0, most_u32, 0x00040192, "", "device_type",
     "Profiles of the device: low 16 bits 402 (CiA 402)"},
    {0x1001, 0, u8, ro, 0, most_u8, 0, "", "error_register", "Present errors, a bit for each kind (CiA 301)"},
    {0x1003, 0, u8, ro, 0, most_u8, 4, "", "error_history_count",
     "Entries of the error history; the manual prints a constant, CiA 301 has the number of errors"},
    {0x1003, 1, u32, ro, 0, most_u32, 0, "", "error_history_1", error_text},
    {0x1003, 2, u32, ro, 0, most_u32, 0, "", "error_history_2", error_text},
    {0x1003, 3, u32, ro, 0, most_u32, 0, "", "error_history_3", error_text},
    {0x1003, 4, u32, ro, 0, most_u32, 0, "", "error_history_4", error_text},
    {0x1005, 0, u32, rw, 0, most_u32, 0x80, "", "sync_cob_id", "Identifier of SYNC"},
    {0x1009, 0, u16, ro, 0, most_u16, {}, "", "hardware_version",
     "Version of the hardware; a number here, where CiA 301 has text"},
    {0x100A, 0, u16, ro, 0, most_u16, {}, "", "software_version",
     "Version of the firmware; a number here, where CiA 301 has text"},
    {0x1014, 0, u32, rw, 0, most_u32, 0x80, "", "emergency_cob_id",
     "Identifier of EMCY, 80h plus node-ID; the manual prints 80h alone, which is that of SYNC"},
    {0x1017, 0, u16, rw_saved, 0, most_u16, 0, "ms", "heartbeat_time", "Period of the heartbeat; 0 sends none"},
    {0x1018, 0, u8, ro, 0, most_u8, 3, "", "identity_count", "Entries of the identity"},
    {0x1018, 1, u32, ro, 0, most_u32, 0x0100, "", "vendor_id", "Vendor"},
    {0x1018, 2, u32, ro, 0, most_u32, 0x0003, "", "product_code", "Product; all motors of the series have the same"},
    {0x1018, 3, u32, ro, 0, most_u32, {}, "", "revision",
     "Revision; counted by sub-index 0, but not in the manual's table"},
    {0x1200, 0, u8, ro, 0, most_u8, 2, "", "sdo_server_count", "Entries of the SDO server"},
    {0x1200, 1, u32, ro, 0, most_u32, 0x600, "", "sdo_server_receive_cob_id",
     "Identifier of SDO requests; the node-ID is added to the default"},
    {0x1200, 2, u32, ro, 0, most_u32, 0x580, "", "sdo_server_send_cob_id",
     "Identifier of SDO replies; the node-ID is added to the default"},
});
// clang-format on

// --- 1400h..1A03h: four PDOs each way, numbered from 0 ---

template <std::size_t size>
consteval std::array<RowText, size> pdo_texts(bool sent, std::size_t number,
                                              const std::array<std::string_view, size>& ends) {
  std::array<RowText, size> texts{};
  for (std::size_t i = 0; i < size; ++i) {
    texts[i].append(sent ? "tpdo" : "rpdo");
    texts[i].append_number(number);
    texts[i].append(ends[i]);
  }
  return texts;
}

constexpr auto setting_ends = std::to_array<std::string_view>(
    {"_count", "_cob_id", "_transmission_type", "_inhibit_time", "_reserved", "_event_timer"});
constexpr auto mapping_ends = std::to_array<std::string_view>(
    {"_mapping_count", "_mapping_1", "_mapping_2", "_mapping_3", "_mapping_4"});
template <bool sent, std::uint16_t number>
inline constexpr auto setting_names = pdo_texts(sent, number, setting_ends);
template <bool sent, std::uint16_t number>
inline constexpr auto mapping_names = pdo_texts(sent, number, mapping_ends);

constexpr std::int64_t base_cob_id(bool sent, std::uint16_t number) {
  return (sent ? 0x180 : 0x200) + 0x100 * std::int64_t{number};
}

/// What a PDO is sent or received by. 1401h..1403h print no event timer, although they count it.
template <bool sent, std::uint16_t number>
consteval std::array<ParameterSpec, 6> pdo_setting_rows() {
  constexpr std::uint16_t index = (sent ? 0x1800 : 0x1400) + number;
  constexpr auto& names = setting_names<sent, number>;
  return specs({
      {index, 0, u8, ro, 0, most_u8, 5, "", names[0].view(), "Entries of this PDO's settings"},
      {index, 1, u32, ro, 0, most_u32, base_cob_id(sent, number), "", names[1].view(),
       "Identifier of the PDO, bit 31 switches it off; the node-ID is added to the default"},
      {index, 2, u8, rw_saved, 0, most_u8, 0xFF, "", names[2].view(),
       "1..240: with every n-th SYNC, 254 and 255: by event"},
      {index, 3, u16, rw_saved, 0, most_u16, 0, "", names[3].view(),
       "Shortest time between two of them; by CiA 301 in 0.1 ms, the manual gives no unit"},
      {index, 4, u8, rw, 0, most_u8, 0, "", names[4].view(), "Reserved"},
      {index, 5, u16, rw_saved, 0, most_u16, 0, "", names[5].view(),
       "Longest time between two of them; by CiA 301 in ms, the manual gives no unit"},
  });
}

/// What a PDO carries. Only RPDO0 carries something from the factory: the control word.
template <bool sent, std::uint16_t number>
consteval std::array<ParameterSpec, 5> pdo_mapping_rows() {
  constexpr std::uint16_t index = (sent ? 0x1A00 : 0x1600) + number;
  constexpr bool mapped = !sent && number == 0;
  constexpr auto& names = mapping_names<sent, number>;
  constexpr std::string_view text = "Object in the PDO: index << 16 | sub-index << 8 | bits";
  return specs({
      {index, 0, u8, ro, 0, most_u8, mapped ? 1 : 0, "", names[0].view(), "Objects in the PDO"},
      {index, 1, u32, rw_saved, 0, most_u32, mapped ? std::optional<std::int64_t>(0x60400010) : std::nullopt,
       "", names[1].view(), text},
      {index, 2, u32, rw_saved, 0, most_u32, {}, "", names[2].view(), text},
      {index, 3, u32, rw_saved, 0, most_u32, {}, "", names[3].view(), text},
      {index, 4, u32, rw_saved, 0, most_u32, {}, "", names[4].view(), text},
  });
}

// --- 2000h..206Ah: the vendor's own ---

constexpr std::string_view input_function_text =
    "Function of the input: 0 none, 1 home, 2 positive limit, 3 negative limit, 4 motor enable, 5 motor "
    "free, "
    "6 alarm clear, 7 restore factory settings, 8 stop, 9 quick stop, 10 position start, 11 speed start, "
    "12 JOG+, 13 JOG-, 14 homing start";
constexpr std::string_view output_function_text =
    "Function of the output: 0 none, 1 alarm, 2 running, 3 homed, 4 in position";

// clang-format off
constexpr auto drive_rows = specs({
    {0x2000, 0, u16, ro, 1, 127, {}, "", "node", "Node-ID in use, by the switches or custom_node"},
    {0x2001, 0, u16, ro, 0, 1, 0, "", "moving", "0 at standstill, 1 moving"},
    {0x2002, 0, i16, ro, -32768, 32767, 0, "r/min", "speed",
     "Present speed; the manual gives no unit here, all its other speeds are in r/min"},
    {0x2003, 0, u16, ro, 0, 127, 0, "", "inputs", "Active inputs: bit 0 X0 ... 6 X6"},
    {0x2004, 0, u16, ro, 0, 7, 0, "", "outputs", "Active outputs: bit 0 Y0 ... 2 Y2"},
    {0x2005, 0, u16, rw_saved, 0, 1, 0, "", "pulse_polarity",
     "Level of the pulse and direction signals: 0 Pulse Sign, 1 Pulse /Sign (direction inverted); the drive has "
     "no pulse input"},
    {0x2006, 0, u16, rw_saved, 0, 15, 8, "", "microstep",
     "Pulses per revolution: 0..7 400 x 2^n, 8 1000, 9 2000, 10 4000, 11 5000, 12 8000, 13 10000, 14 20000, "
     "15 40000"},
    {0x2007, 0, u16, rw_saved, 0, 1, 0, "", "loop_mode", "0 closed loop, 1 open loop"},
    {0x2008, 0, u16, rw_saved, 0, 127, 0, "", "custom_node",
     "Node-ID 16..127, used with all address switches off; 0..15 undefined"},
    {0x2009, 0, u16, rw_saved, 0, 5, 0, "", "custom_baud",
     "0 500, 1 250, 2 125, 3 100, 4 50, 5 25 kbit/s, used with SW2 on"},
    {0x200A, 0, u16, rw_saved, 0, 1, 0, "", "overtravel_stop", "At a limit terminal: 0 free stop, 1 quick stop"},
    {0x200C, 0, u16, rw_saved, 0, 1, 0, "", "eeprom_update",
     "0: every write to a saved object goes to EEPROM as well, 1: it does not"},
    {0x200E, 0, u16, rw, 2, 300, 5, "r/min", "start_speed", "Speed at which a motion begins"},
    {0x200F, 0, u16, wo, 0, 1, 0, "", "enable", "0 releases the motor, 1 enables it", "AxisService.Enable"},
    {0x2010, 0, u16, wo, 0, 2, 0, "", "parameter_setting",
     "1 restores the factory settings, 2 saves all RW objects to EEPROM",
     "DriveService.SaveParameters or DriveService.RestoreFactory"},
    {0x2011, 0, u16, wo, 0, 1, 0, "", "alarm_clear", "1 clears an alarm that can be cleared", "AxisService.Reset"},
    {0x2012, 0, u16, wo, 0, 1, 0, "", "position_clear", "1 sets the position to 0", "AxisService.SetPosition"},
});

// The same names as on the Modbus models, whose catalogues have these as well.
constexpr auto terminal_rows = specs({
    {0x2030, 0x00, u16, ro, 0, most_u16, 16, "", "terminal_count",
     "Entries of the terminals, as printed; the last is 0Fh, and 09h..0Bh do not exist"},
    {0x2030, 0x01, u16, rw_saved, 0, most_u16, 0, "", "input_levels",
     "1 inverts an input: bit 0 X0 ... 6 X6; 0: high level or rising edge is active"},
    {0x2030, 0x02, u16, rw_saved, 0, 14, 0, "", "input_function_x0", input_function_text},
    {0x2030, 0x03, u16, rw_saved, 0, 14, 0, "", "input_function_x1", input_function_text},
    {0x2030, 0x04, u16, rw_saved, 0, 14, 0, "", "input_function_x2", input_function_text},
    {0x2030, 0x05, u16, rw_saved, 0, 14, 0, "", "input_function_x3", input_function_text},
    {0x2030, 0x06, u16, rw_saved, 0, 14, 0, "", "input_function_x4", input_function_text},
    {0x2030, 0x07, u16, rw_saved, 0, 14, 0, "", "input_function_x5", input_function_text},
    {0x2030, 0x08, u16, rw_saved, 0, 14, 0, "", "input_function_x6", input_function_text},
    {0x2030, 0x0C, u16, rw_saved, 0, most_u16, 0, "", "output_levels", "1 inverts an output: bit 0 Y0 ... 2 Y2"},
    {0x2030, 0x0D, u16, rw_saved, 0, 4, 0, "", "output_function_y0", output_function_text},
    {0x2030, 0x0E, u16, rw_saved, 0, 4, 0, "", "output_function_y1", output_function_text},
    {0x2030, 0x0F, u16, rw_saved, 0, 4, 0, "", "output_function_y2", output_function_text},
});

constexpr auto performance_rows = specs({
    {0x2042, 0, u16, rw_saved, 0, 150, 100, "%", "closed_loop_current_percent", "Current in closed loop"},
    {0x2043, 0, u16, rw_saved, 0, 100, 50, "%", "open_loop_current_percent", "Current in open loop"},
    {0x2044, 0, u16, rw_saved, 0, 100, 40, "%", "lock_current_percent", "Current at standstill"},
    {0x2045, 0, u16, rw_saved, 100, 500, 100, "ms", "lock_current_time",
     "Time until the current at standstill applies"},
    {0x2046, 0, u16, rw_saved, 0, 20000, 4000, "", "deviation_alarm_threshold",
     "Position deviation that raises alarm 5; the manual gives no unit"},
    {0x2047, 0, u16, rw_saved, 1, 4000, 10, "", "in_position_threshold",
     "Control mode and threshold of the in-position signal; the manual gives no unit"},
    {0x2048, 0, u16, rw_saved, 0, 1024, 5, "", "speed_smoothing", "Strength of speed smoothing"},
    {0x2049, 0, u16, rw_saved, 1, 256, 16, "", "position_proportional", "Position, proportional coefficient"},
    {0x204A, 0, u16, rw_saved, 1, 256, 16, "", "speed_proportional", "Speed, proportional coefficient"},
    {0x204B, 0, u16, rw_saved, 1, 200, 162, "", "speed_feedforward", "Speed feed-forward coefficient"},
    {0x204C, 0, u16, rw_saved, 0, 30000, 8000, "", "current_loop_proportional",
     "Current loop, proportional coefficient"},
    {0x204D, 0, u16, rw_saved, 0, 1000, 48, "", "current_loop_integral", "Current loop, integral coefficient"},
    {0x204E, 0, u16, rw_saved, 0, 1024, 358, "", "encoder_filter", "Filter coefficient of the encoder feedback"},
    {0x204F, 0, u16, rw_saved, 1, 200, 10, "", "positioning_accuracy",
     "Accuracy at which positioning is complete; the manual gives no unit"},
    {0x2050, 0, u16, rw_saved, 0, 1, 0, "", "closed_loop_algorithm",
     "Closed-loop control algorithm 0 or 1; the manual does not name them"},
    {0x2051, 0, u16, rw_saved, 0, most_u16, 15360, "", "high_speed_coefficient",
     "High-speed adjustment coefficient (ea limit)"},
    {0x2052, 0, u16, rw_saved, 1, 50, 16, "", "torque_coefficient", "Torque adjustment coefficient (ea)"},
    {0x2053, 0, u16, rw_saved, 1, 50, 10, "", "speed_node_1", "Speed node 1"},
    {0x2054, 0, u16, rw_saved, 0, most_u16, 32, "", "position_proportional_1",
     "Position, proportional coefficient 1"},
    {0x2055, 0, u16, rw_saved, 0, most_u16, 320, "", "speed_proportional_1", "Speed, proportional coefficient 1"},
    {0x2056, 0, u16, rw_saved, 1, 50, 15, "", "speed_node_2", "Speed node 2"},
    {0x2057, 0, u16, rw_saved, 0, most_u16, 33, "", "position_proportional_2",
     "Position, proportional coefficient 2"},
    {0x2058, 0, u16, rw_saved, 0, most_u16, 320, "", "speed_proportional_2", "Speed, proportional coefficient 2"},
    {0x2059, 0, u16, rw_saved, 1, 50, 20, "", "speed_node_3", "Speed node 3"},
    {0x205A, 0, u16, rw_saved, 0, most_u16, 35, "", "position_proportional_3",
     "Position, proportional coefficient 3"},
    {0x205B, 0, u16, rw_saved, 0, most_u16, 320, "", "speed_proportional_3", "Speed, proportional coefficient 3"},
    {0x205C, 0, u16, rw_saved, 1, 50, 30, "", "speed_node_4", "Speed node 4"},
    {0x205D, 0, u16, rw_saved, 0, most_u16, 38, "", "position_proportional_4",
     "Position, proportional coefficient 4"},
    {0x205E, 0, u16, rw_saved, 0, most_u16, 384, "", "speed_proportional_4", "Speed, proportional coefficient 4"},
    {0x205F, 0, u16, rw_saved, 1, 50, 40, "", "speed_node_5", "Speed node 5"},
    {0x2060, 0, u16, rw_saved, 0, most_u16, 39, "", "position_proportional_5",
     "Position, proportional coefficient 5"},
    {0x2061, 0, u16, rw_saved, 0, most_u16, 512, "", "speed_proportional_5", "Speed, proportional coefficient 5"},
    {0x2062, 0, u16, rw_saved, 1, 50, 46, "", "speed_node_6", "Speed node 6"},
    {0x2063, 0, u16, rw_saved, 0, most_u16, 40, "", "position_proportional_6",
     "Position, proportional coefficient 6"},
    {0x2064, 0, u16, rw_saved, 0, most_u16, 640, "", "speed_proportional_6", "Speed, proportional coefficient 6"},
    {0x2065, 0, u16, rw_saved, 0, most_u16, 32, "", "holding_position_proportional",
     "Position at standstill, proportional coefficient"},
    {0x2066, 0, u16, rw_saved, 0, most_u16, 320, "", "holding_speed_proportional",
     "Speed at standstill, proportional coefficient"},
    {0x2067, 0, u16, rw_saved, 0, most_u16, 10, "ms", "input_filter_x0_x1", "Filter of inputs X0 and X1"},
    {0x2068, 0, u16, rw_saved, 0, most_u16, 10, "ms", "input_filter_x2_x3", "Filter of inputs X2 and X3"},
    {0x2069, 0, u16, rw_saved, 0, most_u16, 10, "ms", "input_filter_x4_x5", "Filter of inputs X4 and X5"},
    {0x206A, 0, u16, rw_saved, 0, most_u16, 10, "ms", "input_filter_x6", "Filter of input X6"},
});

// --- 603Fh..60FFh ---

constexpr std::string_view mode_text = "0 undefined, 1 position, 3 velocity, 6 homing";

constexpr auto motion_rows = specs({
    {0x603F, 0, u16, ro, 0, 0xFF05, 0, "", "error_code",
     "0 none, FF01h overcurrent, FF02h overvoltage, FF03h undervoltage, FF04h EEPROM, FF05h position deviation"},
    {0x6040, 0, u16, rw, 0, most_u16, 0, "", "control_word", "Commands of the CiA 402 state machine"},
    {0x6041, 0, u16, ro, 0, most_u16, 0, "", "status_word", "States of the CiA 402 state machine"},
    {0x605D, 0, i16, rw, 0, 1, 0, "", "halt_option",
     "At control bit 8 (halt): 0 stops with deceleration, 1 at once; either stays enabled"},
    {0x6060, 0, i8, rw, 0, 6, 0, "", "mode", mode_text},
    {0x6061, 0, i8, ro, 0, 6, 0, "", "mode_display", mode_text},
    {0x6064, 0, i32, rw, std::numeric_limits<std::int32_t>::min(), std::numeric_limits<std::int32_t>::max(), 0,
     "pulse", "position", "Actual position"},
    {0x607A, 0, i32, rw, -1'000'000, 1'000'000, 5000, "pulse", "target_pulses", "Distance or target of a move"},
    {0x607C, 0, i32, rw, -1'000'000, 1'000'000, 0, "pulse", "homing_offset",
     "Distance moved after the switch, signed"},
    {0x6081, 0, u32, rw, 5, 3000, 120, "r/min", "maximum_speed",
     "Speed of a move; at most 200 kHz of pulses"},
    {0x6083, 0, u32, rw, 0, 2000, 100, "ms", "acceleration_time", "Time from start speed to maximum speed"},
    {0x6084, 0, u32, rw, 0, 2000, 100, "ms", "deceleration_time", "Time from maximum speed to standstill"},
    {0x6098, 0, u8, rw, 0, 29, 0, "", "homing_method",
     "17 negative limit, 18 positive limit, 24 home switch forwards, 29 home switch backwards (6.2.6); or 0 home "
     "switch forwards, 1 home switch backwards, 2 positive limit, 3 negative limit (chapter 7)"},
    {0x6099, 0, u8, ro, 0, most_u8, 2, "", "homing_speed_count", "Entries of the homing speeds"},
    {0x6099, 1, u32, rw, 5, 3000, 120, "r/min", "homing_speed", "Speed until the switch is found"},
    {0x6099, 2, u32, rw, 5, 3000, 60, "r/min", "homing_search_speed", "Speed after the switch was found"},
    {0x609A, 0, u32, rw, 30, 2000, 100, "ms", "homing_time", "Acceleration and deceleration time of homing"},
    {0x60FF, 0, i32, rw, -3000, 3000, 0, "r/min", "target_speed",
     "Speed in velocity mode, its sign is the direction; at most 200 kHz of pulses"},
});
// clang-format on

template <bool sent>
consteval auto pdo_rows() {
  return join(pdo_setting_rows<sent, 0>(), pdo_setting_rows<sent, 1>(), pdo_setting_rows<sent, 2>(),
              pdo_setting_rows<sent, 3>(), pdo_mapping_rows<sent, 0>(), pdo_mapping_rows<sent, 1>(),
              pdo_mapping_rows<sent, 2>(), pdo_mapping_rows<sent, 3>());
}

constexpr auto table = join(communication_rows, pdo_rows<false>(), pdo_rows<true>(), drive_rows,
                            terminal_rows, performance_rows, motion_rows);
static_assert(table.size() == 196);

}  // namespace

std::span<const ParameterSpec> parameters() { return table; }

}  // namespace axisd::yss_c
