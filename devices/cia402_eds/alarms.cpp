#include "devices/cia402_eds/alarms.hpp"

#include <array>

namespace axisd::cia402_eds {

namespace {

constexpr auto reset = AlarmReset::by_command;
constexpr std::string_view wiring = "check the motor's wiring and load, then reset the axis";
constexpr std::string_view supply = "check the supply under load and while braking, then reset the axis";
constexpr std::string_view heat = "let it cool, check load and ventilation, then reset the axis";
constexpr std::string_view feedback = "check the encoder's wiring, then reset the axis";
constexpr std::string_view inside = "reset the axis; if it comes back, ask the maker of the drive";

// CiA 402-2 (IEC 61800-7-201), error codes.
constexpr auto table = std::to_array<AlarmSpec>({
    {0x1000, "generic_error", reset, inside},
    {0x2110, "short_circuit_input", reset, wiring},
    {0x2120, "earth_fault_input", reset, wiring},
    {0x2220, "continuous_overcurrent_internal", reset, wiring},
    {0x2230, "short_circuit_internal", reset, wiring},
    {0x2310, "continuous_overcurrent", reset, wiring},
    {0x2320, "short_circuit_output", reset, wiring},
    {0x2330, "earth_fault_output", reset, wiring},
    {0x2340, "short_circuit", reset, wiring},
    {0x2350, "i2t_overload", reset, heat},
    {0x3110, "mains_overvoltage", reset, supply},
    {0x3120, "mains_undervoltage", reset, supply},
    {0x3130, "phase_failure", reset, supply},
    {0x3210, "dc_link_overvoltage", reset, supply},
    {0x3220, "dc_link_undervoltage", reset, supply},
    {0x4110, "excess_ambient_temperature", reset, heat},
    {0x4210, "excess_device_temperature", reset, heat},
    {0x4310, "excess_drive_temperature", reset, heat},
    {0x5113, "undervoltage_5v", reset, inside},
    {0x5441, "contactor", reset, inside},
    {0x5530, "eeprom", reset, inside},
    {0x6100, "internal_software", reset, inside},
    {0x6320, "parameter_error", reset, inside},
    {0x7110, "brake_chopper", reset, supply},
    {0x7121, "motor_blocked", reset, "free the load, then reset the axis"},
    {0x7300, "sensor", reset, feedback},
    {0x7305, "incremental_encoder_1", reset, feedback},
    {0x7310, "speed_sensor", reset, feedback},
    {0x7500, "communication", reset, "check the network, then reset the axis"},
    {0x8130, "heartbeat_lost", reset, "check the network, then reset the axis"},
    {0x8400, "velocity_controller", reset, "check load and tuning, then reset the axis"},
    {0x8500, "position_controller", reset, "check load and tuning, then reset the axis"},
    {0x8611, "following_error", reset, "check load, acceleration and tuning, then reset the axis"},
    {0x8612, "reference_limit", reset, "reset the axis and move away from the limit"},
});

}  // namespace

constinit const AlarmSpec other_alarm{0, "specific_to_the_drive", reset,
                                      "look the code up in the drive's manual, then reset the axis"};

std::span<const AlarmSpec> alarms() { return table; }

}  // namespace axisd::cia402_eds
