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

TEST(Loader, DemoIsThreeSimulatedAxes) {
  const auto result = load_file(source_path("config/examples/demo.yaml"));
  ASSERT_TRUE(result.configuration) << findings(result);
  const auto& configuration = *result.configuration;
  EXPECT_EQ(configuration.machine, "demo");
  EXPECT_EQ(configuration.server.listen, "localhost:7443");
  ASSERT_EQ(configuration.buses.size(), 1U);
  EXPECT_TRUE(configuration.buses[0].simulated());
  ASSERT_EQ(configuration.axes.size(), 3U);

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
  EXPECT_EQ(findings(load_text(std::string(1024 * 1024 + 1, '#'), "big.yaml")),
            "big.yaml:1:1: the file is too large; at most 1048576 bytes\n");
  EXPECT_EQ(findings(load_text(std::string(1024 * 1024, '#'), "big.yaml")),
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
