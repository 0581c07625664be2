// Any CiA 402 drive: what holds for all of them, as data. The rest comes from the drive's EDS
// (eds_drive.hpp).
#include "devices/descriptor.hpp"

#include <stdexcept>

#include "devices/cia402/drive.hpp"
#include "devices/cia402_eds/alarms.hpp"
#include "devices/cia402_eds/eds_drive.hpp"

namespace axisd::cia402_eds {

std::span<const DriveDescriptor> descriptors();

namespace {

// CiA 301, table 1.
constexpr std::int32_t bitrates[] = {1'000'000, 800'000, 500'000, 250'000, 125'000, 50'000, 20'000, 10'000};

// 60FDh: bits 0 to 2 have one meaning each.
constexpr TerminalSpec inputs[] = {{.name = "NEG", .function = "negative_limit"},
                                   {.name = "POS", .function = "positive_limit"},
                                   {.name = "HOME", .function = "home"}};
constexpr TerminalFunctionSpec input_functions[] = {
    {"home", 1, {}},
    {"positive_limit", 2, "negative_limit"},
    {"negative_limit", 3, "positive_limit"},
};

constexpr std::string_view ramp_kinds[] = {"rate", "time"};
constexpr std::string_view loop_modes[] = {"closed", "open"};
constexpr SettingSpec settings[] = {
    {.key = "eds",
     .kind = "path",
     .description = "The drive's data sheet (EDS, or DCF); a relative path counts from this file's folder.",
     .required = true},
    {.key = "velocity_unit",
     .kind = "enum",
     .choices = cia402::unit_names,
     .description =
         "What 6081h, 6099h, 606Ch and 60FFh count, where the data sheet does not tell it (60A9h): "
         "position increments per second, or a power of ten of r/min, r/s, degrees/s or rad/s."},
    {.key = "ramps",
     .kind = "enum",
     .choices = ramp_kinds,
     .default_value = "rate",
     .description = "What 6083h, 6084h and 609Ah hold: velocity units per second (or what 60AAh says), or a "
                    "time in ms."},
    {.key = "acceleration_unit",
     .kind = "enum",
     .choices = cia402::unit_names,
     .description =
         "What 6083h, 6084h and 609Ah count in a second, where they are rates and neither 60AAh tells it "
         "nor it is the unit of velocities: rpm is r/min per second."},
    {.key = "loop_mode",
     .kind = "enum",
     .choices = loop_modes,
     .default_value = "closed",
     .description =
         "Whether 6064h is measured. Open: a release, a quick stop or a limit loses the position."},
    {.key = "objects",
     .kind = "objects",
     .description = "What the drive's manual says of objects and its data sheet does not, or says wrongly."},
};

std::unique_ptr<Drive> make(DriveContext context) {
  const auto& own = context.setup.own_descriptor;
  if (own == nullptr || own->make != &make) throw std::invalid_argument("model cia402 without its EDS");
  // Only specialise() makes such a descriptor. The drive keeps it with its setup.
  const auto& model = static_cast<const EdsDrive&>(*own).model();
  return cia402::make_drive(model, std::move(context));
}

}  // namespace

std::span<const DriveDescriptor> descriptors() {
  static const DriveDescriptor models[] = {{
      .model = "cia402",
      .title = "CiA 402 drive, as its EDS describes it",
      .bus = BusKind::canopen,
      .bauds = bitrates,
      .inputs = inputs,
      .input_functions = input_functions,
      .alarms = alarms(),
      .other_alarms = other_alarms(),
      .settings = settings,
      .capabilities = {.maximum_rpm = 100'000,
                       .maximum_pulse_rate_hz = 4'000'000'000,
                       .minimum_start_rpm = 0,
                       .maximum_start_rpm = 0,
                       .minimum_time_ms = 1,
                       .maximum_time_ms = 60'000,
                       .minimum_homing_rpm = 1,
                       .maximum_homing_rpm = 100'000,
                       .minimum_search_rpm = 1,
                       .maximum_search_rpm = 100'000,
                       .minimum_homing_time_ms = 1,
                       .maximum_homing_offset_pulses = 0,
                       .maximum_segments = 0,
                       .minimum_segment_time_ms = 0,
                       .position_source = PositionSource::encoder,
                       .closed_loop = true},
      .saves = {},  // 1010h saves all, on command
      .make = &make,
      .specialise = &specialise,
  }};
  return models;
}

}  // namespace axisd::cia402_eds
