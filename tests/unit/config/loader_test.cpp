#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <string>
#include <vector>

#include "config/configuration.hpp"
#include "tests/unit/config/dump.hpp"
#include "tests/unit/config/support.hpp"

namespace axisd::config {
namespace {

using namespace std::chrono_literals;

std::vector<std::filesystem::path> broken_files() {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(source_path("tests/broken"))) {
    if (entry.path().extension() == ".yaml") files.push_back(entry.path());
  }
  std::ranges::sort(files);
  return files;
}

TEST(Loader, SaysExactlyWhatIsBroken) {
  const auto files = broken_files();
  EXPECT_GE(files.size(), 50U);
  for (const auto& file : files) {
    const auto result = load_text(read_text(file), file.filename().string());
    EXPECT_FALSE(result.configuration) << file;
    EXPECT_EQ(findings(result), read_text(std::filesystem::path(file).replace_extension(".expected")));
  }
}

TEST(Loader, WhatIsWrongWithAFileStandsAtItsKey) {
  const std::string name = source_path("config/examples/reference.yaml"), text = read_text(name);
  std::vector<std::string> asked;
  const auto check = [&](const TlsSettings& tls) -> std::vector<std::pair<std::string_view, Error>> {
    asked.push_back(tls.key);
    return {
        {"key", {.reason = Reason::invalid_argument, .message = tls.key + ": is bad", .remedy = "mend it"}}};
  };
  const auto refused = load_text(text, name, check);
  EXPECT_FALSE(refused.configuration);
  EXPECT_EQ(findings(refused), name + ":10:10: /etc/axisd/tls/server.key: is bad; mend it\n");
  // Of paths that are none, nothing more is said.
  auto relative = text;
  relative.replace(relative.find("/etc/axisd/tls/server.key"), 1, "");
  EXPECT_FALSE(findings(load_text(relative, name, check)).contains("is bad"));
  EXPECT_EQ(asked.size(), 1U);
  EXPECT_TRUE(load_text(text, name).configuration);
}

TEST(Loader, WhatOnlyItsBudgetForbidsHasFiguresAllTheSame) {
  const auto text = read_text(source_path("tests/broken/budget.yaml"));
  const auto refused = load_text(text, "budget.yaml");
  EXPECT_FALSE(refused.configuration);
  ASSERT_TRUE(refused.over_budget);
  EXPECT_EQ(refused.over_budget->axes.size(), 3U);
  EXPECT_FALSE(load_text(text + "nonsense: 1\n", "budget.yaml").over_budget);
}

TEST(Loader, DemoIsSixSimulatedAxesOfFourModels) {
  const auto result = load_file(source_path("config/examples/demo.yaml"));
  ASSERT_TRUE(result.configuration) << findings(result);
  const auto& configuration = *result.configuration;
  EXPECT_EQ(configuration.machine, "demo");
  EXPECT_EQ(configuration.server.listen, "localhost:7443");
  ASSERT_EQ(configuration.lines.size(), 2U);
  EXPECT_TRUE(configuration.lines[0].simulated());
  EXPECT_TRUE(configuration.lines[1].simulated());
  ASSERT_EQ(configuration.networks.size(), 1U);
  EXPECT_TRUE(configuration.networks[0].simulated());
  ASSERT_EQ(configuration.axes.size(), 6U);

  const auto& [feeder, mechanics] = configuration.axes[0];
  EXPECT_EQ(feeder.name, "feeder");
  EXPECT_EQ(feeder.bus, "line-a");
  EXPECT_EQ(feeder.model, "ykd2405pr");
  EXPECT_EQ(Scale(feeder.scale).pulses_per_unit(), 2000);
  EXPECT_EQ(feeder.limits.position_maximum, 400);
  EXPECT_EQ(feeder.limits.velocity, 100);
  EXPECT_EQ(feeder.limits.acceleration_time, 150ms);
  EXPECT_EQ(feeder.limits.deceleration_time, std::nullopt);
  ASSERT_TRUE(feeder.homing);
  EXPECT_EQ(feeder.homing->method, HomingMethod::home_negative);
  EXPECT_EQ(feeder.homing->backoff, 5);
  EXPECT_EQ(feeder.homing->timeout, 30s);
  ASSERT_EQ(feeder.inputs.size(), 3U);
  EXPECT_EQ(feeder.inputs[2].terminal, "X2");
  EXPECT_EQ(feeder.inputs[2].function, "negative_limit");
  EXPECT_TRUE(feeder.inputs[2].active_low);
  EXPECT_FALSE(feeder.inputs[0].active_low);
  EXPECT_EQ(mechanics.home_switch, -4);
  EXPECT_EQ(mechanics.start_position, 50);

  const auto& lifter = configuration.axes[1].axis;
  EXPECT_TRUE(lifter.vertical);
  EXPECT_EQ(Scale(lifter.scale).pulses_per_unit(), -250);
  const auto& turntable = configuration.axes[2].axis;
  EXPECT_EQ(turntable.scale.modulo, 360);
  EXPECT_EQ(turntable.scale.travel_numerator, 360) << "the default of unit deg";
  EXPECT_EQ(turntable.limits.position_minimum, std::nullopt);

  const auto& pusher = configuration.axes[3].axis;
  EXPECT_EQ(pusher.model, "ssd2608pr");
  EXPECT_FALSE(configuration.axes[3].simulation.enabled_at_power_up);
  EXPECT_TRUE(mechanics.enabled_at_power_up);
  ASSERT_TRUE(pusher.segments);
  EXPECT_TRUE(pusher.segments->absolute);
  EXPECT_EQ(pusher.segments->positions[2],
            (PositionSegment{.number = 3, .target = 140, .velocity = 150, .acceleration_time = 200ms}));
  EXPECT_EQ(pusher.segments->velocities, std::vector<VelocitySegment>());
  EXPECT_FALSE(feeder.segments);
  EXPECT_EQ(configuration.axes[4].axis.model, "ess42-r");
}

/// A machine with one axis `x` on line `a`.
LoadResult load_axis(const std::string& more, const std::string& model = "ykd2405pr", bool invert = false) {
  return load_text(
      "machine: m\nbuses: { a: { modbus_rtu: { port: sim } } }\naxes:\n  x:\n    bus: a\n    node: 1\n    "
      "unit: "
      "mm\n    scale: { microstep: 4000 pulses/rev, travel: 10 mm/rev, invert: " +
          std::string(invert ? "true" : "false") +
          " }\n    limits: { velocity: 100 mm/s }\n    model: " + model + "\n" + more,
      "m.yaml");
}

TEST(Loader, AxesMayBeMissingBeforeTheFirstScan) {
  const std::string buses = "machine: m\nbuses: { a: { modbus_rtu: { port: /dev/ttyUSB0 } } }\n";
  for (const auto* axes : {"", "axes:\n", "axes: {}\n", "axes: # none yet\n"}) {
    const auto result = load_text(buses + axes, "m.yaml");
    ASSERT_TRUE(result.configuration) << axes << findings(result);
    EXPECT_EQ(result.configuration->lines.size(), 1U);
    EXPECT_TRUE(result.configuration->axes.empty());
  }
  EXPECT_FALSE(load_text("machine: m\n", "m.yaml").configuration) << "without a bus there is nothing to scan";
  EXPECT_FALSE(load_text(buses + "axes: []\n", "m.yaml").configuration);
}

TEST(Loader, PersistIsAllNothingOrParts) {
  const auto persist = [](const std::string& value) {
    const auto result = load_axis("    persist: " + value + "\n");
    EXPECT_TRUE(result.configuration) << findings(result);
    return result.configuration ? result.configuration->axes[0].axis.persist : PersistSettings{};
  };
  EXPECT_EQ(persist("true"), PersistSettings::all());
  EXPECT_EQ(persist("false"), PersistSettings());
  EXPECT_EQ(persist("[terminals]"), PersistSettings{.terminals = true});
  EXPECT_EQ(persist("[segments, drive]"), (PersistSettings{.segments = true, .drive = true}));
  EXPECT_EQ(persist("[drive, homing, segments, terminals]"), PersistSettings::all());
}

TEST(Loader, OneNumberHasOneAccelerationTime) {
  const auto result = load_axis(R"(
    inputs: { X0: pt_enable, X1: pv_enable, X2: pin0, X3: pin1 }
    segments:
      positions:
        1: { target: -1.5 mm, velocity: 20 mm/s, acceleration_time: 300 ms }
        2: { target: 2, velocity: 20 mm/s }
        3: { target: 2, velocity: 20 mm/s }
      velocities:
        1: { velocity: 30 mm/s }
        2: { velocity: 30 mm/s, acceleration_time: 400 ms }
        3: { velocity: 30 mm/s }
)");
  ASSERT_TRUE(result.configuration) << findings(result);
  const auto& segments = *result.configuration->axes[0].axis.segments;
  EXPECT_FALSE(segments.absolute);
  ASSERT_EQ(segments.positions.size(), 3U);
  ASSERT_EQ(segments.velocities.size(), 3U);
  const Duration expected[] = {300ms, 400ms, 100ms};
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(segments.positions[i].acceleration_time, expected[i]);
    EXPECT_EQ(segments.velocities[i].acceleration_time, expected[i]);
  }
  EXPECT_EQ(segments.positions[0].target, -1.5);
  EXPECT_EQ(segments.velocities[2].velocity, 30);
}

TEST(Loader, SegmentsThatTheInputsOfAModelCanSelect) {
  // pin0 is the lowest bit of the number (7.3.2).
  const auto loads = [](const std::string& model, int number, const std::string& pins) {
    return load_axis("    inputs: { X0: pt_enable, " + pins + " }\n    segments: { positions: { " +
                         std::to_string(number) + ": { target: 2, velocity: 20 mm/s } } }\n",
                     model)
        .configuration.has_value();
  };
  EXPECT_TRUE(loads("ess42-r", 7, "X1: pin0, X2: pin1, X3: pin2"));
  EXPECT_FALSE(loads("ess42-r", 8, "X1: pin3")) << "7 at most (7.3.2 of its manual)";
  EXPECT_TRUE(loads("ssd2608pr", 15, "X1: pin0, X2: pin1, X3: pin2, X4: pin3"));
  EXPECT_FALSE(loads("ssd2608pr", 16, "X1: pin4"));
  EXPECT_TRUE(loads("ykd2405pr", 16, "X1: pin4"));
  EXPECT_FALSE(loads("ykd2405pr", 16, "X1: pin3"));
  EXPECT_TRUE(loads("ykd2405pr", 8, "X1: pin3"));
  EXPECT_TRUE(loads("ykd2405pr", 4, "X1: { function: pin2, active: low }"));
  EXPECT_FALSE(loads("ykd2405pr", 5, "X1: { function: pin2, active: low }"));
}

TEST(Loader, SegmentTimesAreThoseOfTheModel) {
  const auto loads = [](const std::string& model, const std::string& time) {
    return load_axis(
               "    inputs: { X0: pv_enable, X1: pin0 }\n    segments: { velocities: { 1: { velocity: 20 "
               "mm/s, acceleration_time: " +
                   time + " } } }\n",
               model)
        .configuration.has_value();
  };
  EXPECT_TRUE(loads("ykd2405pr", "30 ms"));
  EXPECT_FALSE(loads("ykd2405pr", "29 ms"));
  for (const auto* model : {"ssd2608pr", "ess42-r"}) {
    EXPECT_TRUE(loads(model, "0 ms")) << model;
    EXPECT_TRUE(loads(model, "2000 ms")) << model;
    EXPECT_FALSE(loads(model, "2001 ms")) << model;
  }
}

TEST(Loader, MirrorsOnlyWhatTheDriveMirrors) {
  const auto homes = [](const std::string& method, const std::string& model, const std::string& drive) {
    return load_axis("    homing: { method: " + method +
                         ", velocity: 20 mm/s, search_velocity: 2 mm/s }\n    inputs: { X0: home, X1: "
                         "positive_limit, X2: negative_limit }\n    drive: " +
                         drive + "\n",
                     model, true)
        .configuration.has_value();
  };
  for (const auto* model : {"ssd2608pr", "ess42-r"}) {
    for (const auto* method : {"home_positive", "home_negative"}) {
      EXPECT_FALSE(homes(method, model, "{}")) << model;
      EXPECT_FALSE(homes(method, model, "{ home_approach: forward }")) << model;
      EXPECT_TRUE(homes(method, model, "{ home_approach: as_searched }")) << model;
      EXPECT_TRUE(homes(method, "ykd2405pr", "{}"));
    }
    EXPECT_TRUE(homes("positive_limit", model, "{}")) << model;
    EXPECT_TRUE(homes("negative_limit", model, "{}")) << model;
  }
}

TEST(Loader, DevicesHaveRegistersByName) {
  const auto result = load_text(R"(machine: m
buses: { a: { modbus_rtu: { port: sim, baud: 4800 } } }
devices:
  oven:
    bus: a
    node: 247
    model: modbus-generic
    registers:
      first: { address: 0xFFFe, type: f32, unit: "%" }
      second: { address: 16, type: i16, scale: -0.25, unit: degC, access: rw }
      third: { address: 17, type: u32 }
)",
                                "m.yaml");
  ASSERT_TRUE(result.configuration) << findings(result);
  ASSERT_EQ(result.configuration->devices.size(), 1U);
  const auto& oven = result.configuration->devices[0];
  EXPECT_EQ(oven.name, "oven");
  EXPECT_EQ(oven.bus, "a");
  EXPECT_EQ(oven.node, 247);
  EXPECT_EQ(oven.poll, 500ms);
  ASSERT_EQ(oven.values.size(), 3U);
  EXPECT_EQ(oven.values[0].address, 0xFFFE);
  EXPECT_EQ(oven.values[0].type, ValueType::f32);
  EXPECT_EQ(oven.values[0].unit, "%");
  EXPECT_FALSE(oven.values[0].writable);
  EXPECT_EQ(oven.values[1].address, 16);
  EXPECT_EQ(oven.values[1].type, ValueType::i16);
  EXPECT_EQ(oven.values[1].scale, -0.25);
  EXPECT_TRUE(oven.values[1].writable);
  EXPECT_EQ(oven.values[2].type, ValueType::u32);
  EXPECT_EQ(oven.values[2].scale, 1);
}

TEST(Loader, NetworksStandBesideLines) {
  const auto result = load_text(R"(machine: m
buses:
  can1: { canopen: { interface: sim } }
  line-a: { modbus_rtu: { port: sim } }
  can0: { canopen: { interface: can0.1, bitrate: 500000, sync_period: 10ms, sdo_timeout: 50 ms } }
)",
                                "m.yaml");
  ASSERT_TRUE(result.configuration) << findings(result);
  EXPECT_EQ(result.configuration->lines.size(), 1U);
  const auto& networks = result.configuration->networks;
  ASSERT_EQ(networks.size(), 2U);
  EXPECT_EQ(networks[0].name, "can1");
  EXPECT_TRUE(networks[0].simulated());
  EXPECT_EQ(networks[0].bitrate, 1'000'000U);
  EXPECT_EQ(networks[0].sync_period, Duration{}) << "none is sent";
  EXPECT_EQ(networks[0].sdo_timeout, 100ms);
  EXPECT_EQ(networks[1].name, "can0");
  EXPECT_EQ(networks[1].interface, "can0.1");
  EXPECT_FALSE(networks[1].simulated());
  EXPECT_EQ(networks[1].bitrate, 500'000U);
  EXPECT_EQ(networks[1].sync_period, 10ms);
  EXPECT_EQ(networks[1].sdo_timeout, 50ms);
}

TEST(Loader, DevicesHaveObjectsByName) {
  const auto result = load_text(R"(machine: m
buses: { can0: { canopen: { interface: sim } } }
devices:
  valves:
    bus: can0
    node: 127
    model: canopen-generic
    poll: 50 ms
    objects:
      open: { object: 62fFh:0A, type: u8, access: rw }
      pressure: { object: 6401h:02, type: i16, scale: 0.01, unit: bar }
)",
                                "m.yaml");
  ASSERT_TRUE(result.configuration) << findings(result);
  ASSERT_EQ(result.configuration->devices.size(), 1U);
  const auto& valves = result.configuration->devices[0];
  EXPECT_EQ(valves.kind, BusKind::canopen);
  EXPECT_EQ(valves.node, 127);
  EXPECT_EQ(valves.poll, 50ms);
  ASSERT_EQ(valves.values.size(), 2U);
  EXPECT_EQ(valves.values[0].address, 0x62FF0AU);
  EXPECT_EQ(valves.values[0].type, ValueType::u8);
  EXPECT_TRUE(valves.values[0].writable);
  EXPECT_EQ(valves.values[1].address, 0x640102U);
  EXPECT_EQ(valves.values[1].type, ValueType::i16);
  EXPECT_EQ(valves.values[1].scale, 0.01);
  EXPECT_EQ(valves.values[1].unit, "bar");
  EXPECT_FALSE(valves.values[1].writable);
}

TEST(Loader, ReferenceLoads) {
  const auto result = load_file(source_path("config/examples/reference.yaml"));
  ASSERT_TRUE(result.configuration) << findings(result);
  EXPECT_EQ(result.configuration->axes[0].axis.model_settings.at("current"),
            SettingValue(std::string("2.3A")));
  EXPECT_EQ(result.configuration->axes[0].axis.model_settings.at("model_code"),
            SettingValue(std::int64_t{0}));
  EXPECT_EQ(result.configuration->axes[1].axis.model_settings.at("overtravel_stop"),
            SettingValue(std::string("quick_stop")));
  EXPECT_FALSE(result.configuration->axes[1].axis.model_settings.contains("current"));
}

TEST(Loader, AliasesStandForTheirValue) {
  const std::string text = read_text(source_path("config/examples/demo.yaml"));
  auto aliased = text;
  const std::string inputs = "inputs: { X0: home }";
  const auto at = aliased.find(inputs);
  ASSERT_NE(at, std::string::npos);
  aliased.replace(at, inputs.size(),
                  "inputs: { X0: &function home, X1: { function: none, active: &level low }, X2: "
                  "{ function: stop, active: *level } }");
  auto written = text;
  written.replace(at, inputs.size(),
                  "inputs: { X0: home, X1: { function: none, active: low }, X2: { function: stop, "
                  "active: low } }");
  const auto left = load_text(aliased, "a.yaml"), right = load_text(written, "b.yaml");
  ASSERT_TRUE(left.configuration && right.configuration) << findings(left) << findings(right);
  EXPECT_EQ(dump(*left.configuration), dump(*right.configuration));
}

TEST(Loader, NamesTheFileThatItCannotRead) {
  EXPECT_EQ(findings(load_file("/nowhere/axisd.yaml")),
            "/nowhere/axisd.yaml: cannot be read: No such file or directory; check path and permissions\n");
  EXPECT_EQ(findings(load_file("/")), "/: cannot be read: Is a directory; check path and permissions\n");
}

TEST(Loader, RefusesHugeFiles) {
  EXPECT_EQ(findings(load_file("/dev/zero")),
            "/dev/zero:1:1: the file is too large; at most 1048576 bytes\n");
  EXPECT_EQ(findings(load_text(std::string(1024UZ * 1024 + 1, '#'), "big.yaml")),
            "big.yaml:1:1: the file is too large; at most 1048576 bytes\n");
  EXPECT_EQ(findings(load_text(std::string(1024UZ * 1024, '#'), "big.yaml")),
            "big.yaml:1:1: the file is empty; start from config/examples/demo.yaml\n");
}

TEST(Loader, TellsWhereANulByteIs) {
  using namespace std::string_view_literals;
  EXPECT_EQ(findings(load_text("machine: a\nbu\0ses: b\n"sv, "nul.yaml")),
            "nul.yaml:2:3: a NUL byte: this is no YAML text; save the file as UTF-8\n");
}

TEST(Loader, LoopbackNeedsNoTls) {
  const std::string text = read_text(source_path("config/examples/demo.yaml"));
  const auto with = [&](const std::string& listen) {
    auto changed = text;
    changed.replace(changed.find("localhost:7443"), 14, listen);
    return load_text(changed, "demo.yaml").configuration.has_value();
  };
  for (const auto* listen :
       {"localhost:0", "127.0.0.1:7443", "127.3.2.1:1", "'[::1]:7443'", "unix:/run/axisd.sock"}) {
    EXPECT_TRUE(with(listen)) << listen;
  }
  for (const auto* listen :
       {"0.0.0.0:7443", "'[::]:7443'", "127.example.com:1", "127.0.0.1.example.com:1", "press:7443",
        "localhost", "localhost:65536", "'*:7443'", "unix:axisd.sock", "192.168.1.2:7443"}) {
    EXPECT_FALSE(with(listen)) << listen;
  }
}

TEST(Loader, MaximumVelocityOfEachMicrostep) {
  // M11: min(3000, 12,000,000 / pulses per revolution), whole r/min.
  const auto fits = [](int microstep, double rpm) {
    const auto text =
        "machine: m\nbuses: { a: { modbus_rtu: { port: sim } } }\naxes:\n  x: { bus: a, node: 1, model: "
        "ykd2405pr, unit: rev, scale: { microstep: " +
        std::to_string(microstep) +
        " pulses/rev, travel: 60 rev/rev }, limits: { velocity: " + std::to_string(rpm) + " rev/s } }\n";
    return load_text(text, "m.yaml").configuration.has_value();
  };
  EXPECT_TRUE(fits(200, 3000));
  EXPECT_FALSE(fits(200, 3001));
  EXPECT_TRUE(fits(4000, 3000));
  EXPECT_FALSE(fits(4000, 3001));
  EXPECT_TRUE(fits(10000, 1200));
  EXPECT_FALSE(fits(10000, 1200.5));
  EXPECT_TRUE(fits(12800, 937));
  EXPECT_FALSE(fits(12800, 937.5)) << "937.5 r/min cannot be set";
}

}  // namespace
}  // namespace axisd::config
