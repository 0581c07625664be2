// What the YKD2405PR is, as data (manual V1.3; sections as noted).
#include "devices/descriptor.hpp"

#include "devices/yako_rtu/drive.hpp"
#include "devices/yako_rtu/tables.hpp"
#include "devices/yako_rtu/transactions.hpp"
#include "devices/ykd2405pr/parameters.hpp"

namespace axisd::ykd2405pr {

std::span<const DriveDescriptor> descriptors();

namespace {

namespace reg = yako_rtu::reg;

// 4.4: DIP switches SW6, SW7; 6.1 register 0x0014 for the custom ones.
constexpr std::int32_t bauds[] = {9600, 14400, 19200, 38400, 115200, 128000, 256000};
constexpr std::int32_t custom_bauds[] = {9600, 14400, 128000, 256000};

// 6.1, bits of 0x0008: PU and DR come first.
constexpr TerminalSpec inputs[] = {{"PU"}, {"DR"}, {"X0"}, {"X1"}, {"X2"},
                                   {"X3"}, {"X4"}, {"X5"}, {"X6"}, {"X7"}};
constexpr TerminalSpec outputs[] = {{"Y0"}, {"Y1"}, {"Y2"}, {"Y3"}};

// 6.1, registers 0x004C..0x004F.
constexpr TerminalFunctionSpec output_functions[] = {
    {"none", 0, {}},  {"alarm", 1, {}},       {"brake", 2, {}},   {"running", 3, {}},
    {"homed", 4, {}}, {"in_position", 5, {}}, {"pt_mode", 6, {}},
};

constexpr AlarmSpec alarms[] = {yako_rtu::overcurrent, yako_rtu::overvoltage, yako_rtu::undervoltage,
                                yako_rtu::eeprom_alarm, yako_rtu::position_deviation};

// 6.1, register 0x0000: the manual prints both, and not which is which.
constexpr std::uint16_t model_codes[] = {0x0301, 0x0302};
// 6.1, register 0x0011, by code; then sorted.
constexpr std::int32_t microsteps[] = {200,  400,  800,  1600, 3200, 6400,  12800, 25600,
                                       1000, 2000, 4000, 5000, 8000, 10000, 20000, 40000};
constexpr std::int32_t pulses_per_revolution[] = {200,  400,  800,  1000,  1600,  2000,  3200,  4000,
                                                  5000, 6400, 8000, 10000, 12800, 20000, 25600, 40000};

// 6.1, register 0x0010, RMS values in the order of the codes.
constexpr std::string_view currents[] = {"0.5A", "0.8A", "1.0A", "1.2A", "1.5A", "1.9A",
                                         "2.3A", "2.7A", "3.1A", "3.5A", "4.0A", "4.2A"};
constexpr std::string_view lock_currents[] = {"half", "full"};
constexpr std::string_view control_modes[] = {"bus", "pulse_direction", "double_pulse"};

constexpr SettingSpec settings[] = {
    {.key = "control_mode",
     .kind = "enum",
     .choices = control_modes,
     .default_value = "bus",
     .description = "Where motion comes from (0x0018); others than bus count from the drive's next power-up, "
                    "and axisd then only watches the drive.",
     .object = reg::control_mode},
    yako_rtu::overtravel_setting,
    yako_rtu::one_frame_setting,
    {.key = "current",
     .kind = "enum",
     .choices = currents,
     .default_value = {},
     .description = "Motor current, RMS (0x0010); left as the drive has it when not given.",
     .object = reg::current},
    {.key = "lock_current",
     .kind = "enum",
     .choices = lock_currents,
     .default_value = {},
     .description = "Current at standstill, of the motor current (0x0012); left alone when not given.",
     .object = reg::lock_current},
    {.key = "model_code",
     .kind = "integer",
     .choices = {},
     .minimum = 0,
     .maximum = 65535,
     .default_value = "0",
     .description = "Code expected in 0x0000; 0 accepts both that the manual prints (0x0301, 0x0302)."},
    yako_rtu::tuning("input_filter_x0_x1", 0x0116, 0, 65535, "Filter of X0 and X1 (0x0116); 10 is 10 ms."),
    yako_rtu::tuning("input_filter_x2_x3", 0x0117, 0, 65535, "Filter of X2 and X3 (0x0117)."),
    yako_rtu::tuning("input_filter_x4_x5", 0x0118, 0, 65535, "Filter of X4 and X5 (0x0118)."),
    yako_rtu::tuning("input_filter_x6_x7", 0x0119, 0, 65535, "Filter of X6 and X7 (0x0119)."),
};

std::unique_ptr<Drive> make(DriveContext context) {
  static const yako_rtu::Model model{
      .descriptor = descriptors().data(),
      .first_input_function = 0x0041,
      .custom_bauds = custom_bauds,
      .custom_node_switches = "all address switches off",
      .custom_baud_switches = "SW6 and SW7 on",
  };
  return yako_rtu::make_drive(model, std::move(context));
}

}  // namespace

std::span<const DriveDescriptor> descriptors() {
  static const DriveDescriptor models[] = {{
      .model = "ykd2405pr",
      .title = "YAKO YKD2405PR, open-loop stepper drive",
      .bus = BusKind::modbus_rtu,
      .bauds = bauds,
      .minimum_node = 1,
      .maximum_node = 127,
      .inputs = inputs,
      .outputs = outputs,
      .input_functions = yako_rtu::input_functions,
      .output_functions = output_functions,
      .parameters = parameters(),
      .alarms = alarms,
      .settings = settings,
      .capabilities = {.pulses_per_revolution = pulses_per_revolution,
                       .position_source = PositionSource::commanded,
                       .closed_loop = false,
                       .communication_watchdog = false},
      .identification = yako_rtu::identified({.model_codes = model_codes, .microstep_codes = microsteps}),
      .rtu_transactions = yako_rtu::transactions,
      .make = &make,
  }};
  return models;
}

}  // namespace axisd::ykd2405pr
