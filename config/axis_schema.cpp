#include <algorithm>
#include <iterator>

#include "config/field.hpp"
#include "devices/simulation/drive_option.hpp"

// The keys of an axis. Ranges that depend on the model or on other keys are in axis_checks.cpp.
namespace axisd::config {

namespace {

constexpr KeySpec scale_keys[] = {
    {.key = "microstep",
     .kind = Kind::microstep,
     .required = true,
     .description =
         "Pulses per motor revolution; one of the model's settings. It also limits the speed to 200 kHz.",
     .example = "5000 pulses/rev",
     .field = field([](auto& t) -> auto& { return t.axis->axis.scale.pulses_per_revolution; })},
    {.key = "gear",
     .kind = Kind::ratio,
     .description = "Motor revolutions / output revolutions.",
     .example = "10/1",
     .default_value = "1/1",
     .field = pair_field([](auto& t) -> auto& { return t.axis->axis.scale.gear_motor; },
                         [](auto& t) -> auto& { return t.axis->axis.scale.gear_output; })},
    {.key = "travel",
     .kind = Kind::travel,
     .description =
         "Travel per output revolution in the axis's unit. Default: 360 deg/rev for unit deg, 1 rev/rev for "
         "unit rev; else required.",
     .example = "5 mm/rev",
     .field = pair_field([](auto& t) -> auto& { return t.axis->axis.scale.travel_numerator; },
                         [](auto& t) -> auto& { return t.axis->axis.scale.travel_denominator; })},
    {.key = "invert",
     .kind = Kind::boolean,
     .description = "Turns the axis: its positive direction is the drive's negative one.",
     .example = "true",
     .default_value = "false",
     .field = field([](auto& t) -> auto& { return t.axis->axis.scale.invert; })},
    {.key = "modulo",
     .kind = Kind::position,
     .above_minimum = true,
     .description = "Rotary axes: the position wraps at this value. Not together with limits.position.",
     .example = "180",
     .minimum = 0,
     .field = field([](auto& t) -> auto& { return t.axis->axis.scale.modulo; })},
};

constexpr KeySpec limit_keys[] = {
    {.key = "position",
     .kind = Kind::position_range,
     .description = "Software limits [minimum, maximum]; checked before anything is sent.",
     .example = "[0, 400]",
     .field = pair_field([](auto& t) -> auto& { return t.axis->axis.limits.position_minimum; },
                         [](auto& t) -> auto& { return t.axis->axis.limits.position_maximum; })},
    {.key = "velocity",
     .kind = Kind::velocity,
     .required = true,
     .description = "Highest velocity; also what a command without one uses.",
     .example = "50 mm/s",
     .field = field([](auto& t) -> auto& { return t.axis->axis.limits.velocity; })},
    {.key = "acceleration_time",
     .kind = Kind::duration,
     .description = "From start speed to the commanded velocity; the drives take a time.",
     .example = "150 ms",
     .default_value = "100 ms",
     .field = field([](auto& t) -> auto& { return t.axis->axis.limits.acceleration_time; })},
    {.key = "deceleration_time",
     .kind = Kind::duration,
     .description = "Also of stops. Default: acceleration_time.",
     .example = "120 ms",
     .field = field([](auto& t) -> auto& { return t.axis->axis.limits.deceleration_time; })},
    {.key = "start_speed",
     .kind = Kind::motor_speed,
     .description = "Motor speed from which a ramp starts.",
     .example = "10 r/min",
     .default_value = "5 r/min",
     .field = field([](auto& t) -> auto& { return t.axis->axis.limits.start_speed_rpm; })},
    {.key = "eeprom_saves_per_day",
     .kind = Kind::integer,
     .description =
         "How often the drive may be made to save to its EEPROM within a day: by SaveParameters, "
         "RestoreFactory and whatever persist saves as it is written. Its cells bear about 100,000 "
         "saves; what goes beyond is refused.",
     .example = "20",
     .default_value = "100",
     .minimum = 1,
     .maximum = 10'000,
     .field = field([](auto& t) -> auto& { return t.axis->axis.limits.eeprom_saves_per_day; })},
};

constexpr KeySpec poll_keys[] = {
    {.key = "moving",
     .kind = Kind::duration,
     .description = "Refresh period while the axis moves.",
     .example = "10 ms",
     .default_value = "20 ms",
     .minimum = 1,
     .maximum = 10'000,
     .field = field([](auto& t) -> auto& { return t.axis->axis.poll_moving; })},
    {.key = "idle",
     .kind = Kind::duration,
     .description = "Refresh period at standstill.",
     .example = "250 ms",
     .default_value = "200 ms",
     .minimum = 1,
     .maximum = 10'000,
     .field = field([](auto& t) -> auto& { return t.axis->axis.poll_idle; })},
};

constexpr KeySpec simulate_keys[] = {
    {.key = "home_switch",
     .kind = Kind::position,
     .description =
         "Where the home switch becomes active, on an axis with modulo once per turn. Positions of simulate: "
         "count from the load's zero.",
     .example = "-20",
     .field = field([](auto& t) -> auto& { return t.axis->simulation.home_switch; })},
    {.key = "home_width",
     .kind = Kind::position,
     .above_minimum = true,
     .description = "Way over which the home switch is active.",
     .example = "2",
     .default_value = "1",
     .minimum = 0,
     .field = field([](auto& t) -> auto& { return t.axis->simulation.home_width; })},
    {.key = "positive_limit",
     .kind = Kind::position,
     .description = "The positive limit is active from here on.",
     .example = "410",
     .field = field([](auto& t) -> auto& { return t.axis->simulation.positive_limit; })},
    {.key = "negative_limit",
     .kind = Kind::position,
     .description = "The negative limit is active from here down.",
     .example = "-30",
     .field = field([](auto& t) -> auto& { return t.axis->simulation.negative_limit; })},
    {.key = "start_position",
     .kind = Kind::position,
     .description = "Where the load stands at power-up.",
     .example = "50",
     .default_value = "0",
     .field = field([](auto& t) -> auto& { return t.axis->simulation.start_position; })},
    {.key = "velocity_unit",
     .kind = Kind::choice,
     .description =
         "What velocities of a drive that its data sheet makes count, where the sheet does not tell "
         "it: the drive that is simulated, whatever drive: says. Left out, as drive: says.",
     .example = "rpm",
     .choices = simulation::velocity_unit_names,
     .field = field([](auto& t) -> auto& { return t.axis->simulation.velocity_unit; })},
    {.key = "acceleration_unit",
     .kind = Kind::choice,
     .description = "Likewise of its ramps.",
     .example = "rpm_per_second",
     .choices = simulation::acceleration_unit_names,
     .field = field([](auto& t) -> auto& { return t.axis->simulation.acceleration_unit; })},
    {.key = "enabled_at_power_up",
     .kind = Kind::boolean,
     .description = "The drive's power stage is on when it powers up, where the model has it so.",
     .example = "false",
     .default_value = "true",
     .field = field([](auto& t) -> auto& { return t.axis->simulation.enabled_at_power_up; })},
};

constexpr KeySpec brake_keys[] = {
    {.key = "release_time",
     .kind = Kind::duration,
     .description = "The axis does not move before this time after its power stage is on.",
     .example = "80 ms",
     .default_value = "0 ms",
     .minimum = 0,
     .maximum = 10'000,
     .field = field([](auto& t) -> auto& { return t.axis->axis.brake.release_time; })},
    {.key = "engage_time",
     .kind = Kind::duration,
     .description = "Disable is not done before this time after the power stage is off.",
     .example = "50 ms",
     .default_value = "0 ms",
     .minimum = 0,
     .maximum = 10'000,
     .field = field([](auto& t) -> auto& { return t.axis->axis.brake.engage_time; })},
};

constexpr std::string_view loads[] = {"normal", "vertical"};
constexpr std::string_view escalations[] = {"none", "release"};
constexpr std::string_view lease_losses[] = {"halt", "stop", "disable", "finish"};

/// In the order of persist_parts.
constexpr bool PersistSettings::* persist_members[] = {&PersistSettings::terminals,
                                                       &PersistSettings::segments, &PersistSettings::homing,
                                                       &PersistSettings::drive};

void set_persist(Target& t, const Value& v) {
  for (std::size_t i = 0; i < std::size(persist_parts); ++i)
    t.axis->axis.persist.*persist_members[i] = std::ranges::find(v.items, persist_parts[i]) != v.items.end();
}

std::string show_persist(const Target& t) {
  std::string text;
  for (const auto member : persist_members) text += t.axis->axis.persist.*member ? "1" : "0";
  return text;
}

const KeySpec axis_keys[] = {
    {.key = "bus",
     .kind = Kind::text,
     .required = true,
     .description = "Name of the bus that the drive is on.",
     .example = "line-b",
     .pattern = name_pattern,
     .pattern_hint = "write the name of one of the buses",
     .field = field([](auto& t) -> auto& { return t.axis->axis.bus; })},
    {.key = "node",
     .kind = Kind::integer,
     .required = true,
     .description = "Address of the drive on its bus.",
     .example = "7",
     .minimum = 1,
     .maximum = 127,
     .field = field([](auto& t) -> auto& { return t.axis->axis.node; })},
    {.key = "model",
     .kind = Kind::model,
     .required = true,
     .description = "Drive model.",
     .example = "ykd2405pr",
     .field = field([](auto& t) -> auto& { return t.axis->axis.model; })},
    {.key = "unit",
     .kind = Kind::text,
     .required = true,
     .description = "The axis's unit: mm, deg, rev ... All positions and velocities of the axis are in it.",
     .example = "mm",
     .pattern = "[A-Za-z]{1,16}",
     .pattern_hint = "use up to 16 letters, such as mm, deg or rev",
     .field = field([](auto& t) -> auto& { return t.axis->axis.scale.unit; })},
    {.key = "scale",
     .kind = Kind::section,
     .required = true,
     .description = "From motor pulses to the axis's unit: microstep x gear / travel, exactly.",
     .children = scale_keys},
    {.key = "limits",
     .kind = Kind::section,
     .required = true,
     .description = "What no command may exceed.",
     .children = limit_keys},
    {.key = "homing",
     .kind = Kind::section,
     .description = "How the axis finds its zero; without it Home is refused.",
     .children = homing_schema(),
     .field = optional_section([](auto& t) -> auto& { return t.axis->axis.homing; })},
    {.key = "inputs",
     .kind = Kind::terminals,
     .description = "Functions of input terminals, in axis direction."},
    {.key = "outputs", .kind = Kind::terminals, .description = "Functions of output terminals."},
    {.key = "brake",
     .kind = Kind::section,
     .description = "Delays of the brake that an output with function brake works.",
     .children = brake_keys},
    {.key = "segments",
     .kind = Kind::section,
     .description =
         "The drive's own table of motions, selected and started by terminals. Rows that are not given are "
         "cleared; without the section the drive's table is left alone.",
     .children = segment_schema(),
     .field = optional_section([](auto& t) -> auto& { return t.axis->axis.segments; })},
    {.key = "load",
     .kind = Kind::choice,
     .description = "vertical: the power stage is never released by a policy.",
     .example = "vertical",
     .default_value = "normal",
     .choices = loads,
     .field = choice_field([](auto& t) -> auto& { return t.axis->axis.vertical; })},
    {.key = "on_lease_loss",
     .kind = Kind::choice,
     .description = "What the axis does when the lease that it is commanded under ends. finish: a move or "
                    "homing that has started may end, all else halts; disable: stops, then releases the "
                    "power stage.",
     .example = "stop",
     .default_value = "halt",
     .choices = lease_losses,
     .field = choice_field([](auto& t) -> auto& { return t.axis->axis.on_lease_loss; })},
    {.key = "stop_escalation",
     .kind = Kind::choice,
     .description = "release: a quick stop that is not confirmed is followed by releasing the power stage.",
     .example = "release",
     .default_value = "none",
     .choices = escalations,
     .field = choice_field([](auto& t) -> auto& { return t.axis->axis.stop_escalation_release; })},
    {.key = "require_trust",
     .kind = Kind::boolean,
     .description = "Absolute moves need a homed, set or restored position.",
     .example = "false",
     .default_value = "true",
     .field = field([](auto& t) -> auto& { return t.axis->axis.require_trust; })},
    {.key = "jog_travel",
     .kind = Kind::position,
     .description = "Longest jog while the position is unknown.",
     .example = "20 mm",
     .default_value = "0",
     .minimum = 0,
     .field = field([](auto& t) -> auto& { return t.axis->axis.jog_travel; })},
    {.key = "position_tolerance",
     .kind = Kind::position,
     .description =
         "How far from its target a motion may end as done. At least what the drive itself takes for in "
         "position: the in-position window of an encoder (0x011F, 204Fh), or exactly the counted pulse.",
     .example = "0.01 mm",
     .default_value = "0",
     .minimum = 0,
     .field = field([](auto& t) -> auto& { return t.axis->axis.position_tolerance; })},
    {.key = "turnaround_max",
     .kind = Kind::duration,
     .description = "RS-485: longest time that this drive takes before the first byte of its reply. Default: "
                    "its line's.",
     .example = "8 ms",
     .minimum = 1,
     .maximum = 1000,
     .field = field([](auto& t) -> auto& { return t.axis->axis.turnaround_max; })},
    {.key = "poll",
     .kind = Kind::section,
     .description = "How often the drive's state is read.",
     .children = poll_keys},
    {.key = "reboot_guard",
     .kind = Kind::duration,
     .description =
         "How fresh the proof must be that the drive did not restart, when a motion starts. Below the "
         "drive's shortest boot time: one that is back sooner may be started with factory values.",
     .example = "80 ms",
     .default_value = "100 ms",
     .minimum = 10,
     .maximum = 1000,
     .field = field([](auto& t) -> auto& { return t.axis->axis.reboot_guard; })},
    {.key = "start_within",
     .kind = Kind::duration,
     .description = "From the acceptance of a command to its first start frame, at most: what waits longer "
                    "for disk, line "
                    "or processor ends as expired, and nothing is sent. A command that waits in the buffer: "
                    "from its turn.",
     .example = "1 s",
     .default_value = "2 s",
     .minimum = 50,
     .maximum = 60000,
     .field = field([](auto& t) -> auto& { return t.axis->axis.start_within; })},
    {.key = "stop_margin",
     .kind = Kind::duration,
     .description = "How much longer than its deceleration time a stop may take before it is escalated.",
     .example = "400 ms",
     .default_value = "300 ms",
     .minimum = 10,
     .maximum = 10'000,
     .field = field([](auto& t) -> auto& { return t.axis->axis.stop_margin; })},
    {.key = "drift_check",
     .kind = Kind::duration,
     .description = "How often it is checked that the terminals still have their functions.",
     .example = "30 s",
     .default_value = "10 s",
     .minimum = 1000,
     .maximum = 3'600'000,
     .field = field([](auto& t) -> auto& { return t.axis->axis.drift_check; })},
    {.key = "persist",
     .kind = Kind::parts,
     .description =
         "What is saved in the drive's EEPROM as it is written: true (all that the model saves so), false "
         "(nothing), or a list of parts. drive: microstep and the keys under drive.",
     .example = "[terminals, segments]",
     .default_value = "false",
     .choices = persist_parts,
     .field = {.apply = &set_persist, .show = &show_persist}},
    {.key = "drive", .kind = Kind::model_settings, .description = "Settings that only this model has."},
    {.key = "simulate",
     .kind = Kind::section,
     .description = "The mechanics around a simulated drive; only on a bus with port: sim.",
     .children = simulate_keys},
};

}  // namespace

std::span<const KeySpec> axis_schema() { return axis_keys; }

}  // namespace axisd::config
