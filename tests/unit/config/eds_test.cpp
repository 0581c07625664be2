// A model that a file describes: errors of the file stand at its key, and nothing else is lost.
#include "buses/canopen/eds.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "config/budget.hpp"
#include "config/fields.hpp"
#include "config/file_warnings.hpp"
#include "devices/descriptor.hpp"
#include "tests/unit/config/support.hpp"

namespace axisd::config {
namespace {

using ::testing::AllOf;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

/// Unit objects, in decimal as a configuration has whole numbers: 00B44700h, 00010300h (metres), 00B45700h
/// (r/s^2), 00C00300h.
constexpr std::string_view velocities_in_rpm = "11814656", velocities_in_metres = "66304",
                           ramps_in_revolutions = "11818752", ramps_in_rpm = "12583680";

constexpr std::string_view template_text = R"(machine: press-1
buses:
  can0:
    canopen: {{ interface: sim }}
axes:
  feeder:
    bus: can0
    node: 1
    model: cia402
    unit: mm
    scale: {{ microstep: {} pulses/rev, travel: 5 mm/rev, invert: {} }}
    limits: {{ position: [0, 300], velocity: {} }}
    inputs: {{ {} }}
    drive:
      eds: {}
      velocity_unit: {}
{})";

struct Axis {
  std::string pulses = "65536", invert = "false", velocity = "100 mm/s";
  std::string inputs = "NEG: negative_limit, POS: positive_limit, HOME: home";
  std::string eds = "standard-drive.eds", more{};
  std::string velocity_unit = "pulses_per_second";
};

std::string text_of(const Axis& axis) {
  return fmt::format(fmt::runtime(template_text), axis.pulses, axis.invert, axis.velocity, axis.inputs,
                     axis.eds, axis.velocity_unit, axis.more);
}

LoadResult load(const Axis& axis) {
  return load_text(text_of(axis), source_path("config/examples/test.yaml").string());
}

/// A file of its own for each test, beside which nothing else stands.
class EdsFile : public ::testing::Test {
 protected:
  void SetUp() override {
    path_ = std::filesystem::path(::testing::TempDir()) /
            fmt::format("axisd-{}-{}.eds", ::testing::UnitTest::GetInstance()->current_test_info()->name(),
                        ::testing::UnitTest::GetInstance()->random_seed());
  }
  void TearDown() override { std::filesystem::remove(path_); }
  void write(std::string_view text) const { std::ofstream(path_, std::ios::binary) << text; }
  /// The example with one text replaced by another.
  void write_changed(std::string_view from, std::string_view to) const {
    auto text = read_text(source_path("config/examples/standard-drive.eds"));
    const auto at = text.find(from);
    ASSERT_NE(at, std::string::npos) << from;
    write(text.replace(at, from.size(), to));
  }
  /// The example with an object turned into one of the maker's.
  void write_without(std::string_view object) const {
    auto text = read_text(source_path("config/examples/standard-drive.eds"));
    for (const auto& entry : {fmt::format("=0x{}", object), fmt::format("[{}]", object)}) {
      const auto at = text.find(entry);
      ASSERT_NE(at, std::string::npos) << entry;
      text.replace(at + entry.find(object), object.size(), "609B");
    }
    write(text);
  }
  [[nodiscard]] std::string found(Axis axis = {}) const {
    axis.eds = path_.string();
    return findings(load(axis));
  }

  [[nodiscard]] std::ptrdiff_t line_of(std::string_view text) const {
    const auto all = read_text(path_);
    return 1 + std::ranges::count(all.substr(0, all.find(text)), '\n');
  }

  std::filesystem::path path_;
};

TEST(Eds, MakesTheModelThatDrive) {
  const auto result = load({});
  ASSERT_TRUE(result.configuration) << findings(result);
  const auto& axis = result.configuration->axes[0].axis;
  ASSERT_NE(axis.own_descriptor, nullptr);
  EXPECT_EQ(descriptor_of(axis), axis.own_descriptor.get());
  EXPECT_NE(find_parameter(axis.own_descriptor->parameters, 0x608100), nullptr);
  EXPECT_EQ(axis.model_settings.at("eds"),
            SettingValue(source_path("config/examples/standard-drive.eds").string()));
  EXPECT_EQ(axis.model_settings.at("ramps"), SettingValue(std::string("rate")));
}

TEST(Eds, IsKeptForTheSimulatedDriveAlone) {
  const auto simulated = load({});
  ASSERT_TRUE(simulated.configuration) << findings(simulated);
  const auto& sheet = simulated.configuration->axes[0].simulation.sheet;
  ASSERT_NE(sheet, nullptr);
  EXPECT_EQ(sheet->product, 0x00402001U);
  auto text = text_of({});
  const std::string_view bus = "interface: sim";
  text.replace(text.find(bus), bus.size(), "interface: can0");
  const auto real = load_text(text, source_path("config/examples/test.yaml").string());
  ASSERT_TRUE(real.configuration) << findings(real);
  EXPECT_EQ(real.configuration->axes[0].simulation.sheet, nullptr);
}

TEST(Eds, TakesAnyNumberOfPulses) {
  EXPECT_TRUE(load({.pulses = "12345"}).configuration);
  // 2,000,000 increments/s: 30 r/s at 65536 pulses/rev.
  EXPECT_THAT(findings(load({.velocity = "200 mm/s"})), HasSubstr("at most 1831 r/min at 65536 pulses/rev"));
}

TEST(Eds, LimitsAreThoseOfTheUnit) {
  // 2,000,000 of 0.1 r/min, and of 0.001 r/min.
  const std::string silent = "      objects: { 60A9h: { access: none } }\n";
  EXPECT_EQ(findings(load({.velocity = "150 mm/s", .more = silent, .velocity_unit = "0.1rpm"})), "");
  EXPECT_THAT(findings(load({.velocity = "200 mm/s", .more = silent, .velocity_unit = "0.001rpm"})),
              HasSubstr("at most 2000 r/min"));
  EXPECT_THAT(findings(load({.velocity_unit = "0.1"})), HasSubstr("velocity_unit"));
}

TEST(Eds, TheUnitOfVelocitiesIsNeverGuessed) {
  auto text =
      fmt::format(fmt::runtime(template_text), "1000", "false", "10 mm/s", "", "standard-drive.eds", "", "");
  const std::string line = "      velocity_unit: \n";
  const auto at = text.find(line);
  ASSERT_NE(at, std::string::npos);
  text.erase(at, line.size());
  const auto loaded = [&text](const std::string& more) {
    return findings(load_text(text + more, source_path("config/examples/test.yaml").string()));
  };
  // As if it were a drive that does not tell.
  EXPECT_THAT(loaded("      objects: { 60A9h: { access: none } }\n"),
              AllOf(HasSubstr("test.yaml:15:12: "),
                    HasSubstr("nothing in it tells what the drive's velocities count"),
                    HasSubstr("drive: { velocity_unit: UNIT }")));
  const auto told = [&loaded](std::string_view value) {
    return loaded(
        fmt::format("      objects: {{ 60A9h: {{ type: u32, access: ro, default: {} }} }}\n", value));
  };
  EXPECT_EQ(told(velocities_in_rpm), "");
  EXPECT_THAT(told(velocities_in_metres), HasSubstr("is not clear: 60A9h is 00010300h"));
}

TEST(Eds, AKeyThatContradictsTheDriveIsRefused) {
  const auto said = [](const std::string& unit, const std::string& access) {
    return findings(
        load({.velocity = "10 mm/s",
              .more = fmt::format("      objects: {{ 60A9h: {{ type: u32, access: {}, default: {} }} }}\n",
                                  access, velocities_in_rpm),
              .velocity_unit = unit}));
  };
  EXPECT_EQ(said("rpm", "ro"), "");
  EXPECT_THAT(said("pulses_per_second", "ro"),
              AllOf(HasSubstr("its velocities count r/min (60A9h is 00B44700h), and drive.velocity_unit says "
                              "pulses/s"),
                    HasSubstr("write drive: { velocity_unit: rpm }")));
  EXPECT_EQ(said("pulses_per_second", "rw"), "") << "the drive itself is asked";
}

TEST(Eds, AKeyThatContradictsWhatADriveMayBeSetToIsAWarning) {
  const auto told = [](const std::string& unit) {
    const auto result =
        load({.velocity = "10 mm/s",
              .more = fmt::format("      objects: {{ 60A9h: {{ type: u32, access: rw, default: {} }} }}\n",
                                  velocities_in_rpm),
              .velocity_unit = unit});
    EXPECT_TRUE(result.configuration) << findings(result);
    return result.configuration ? file_warnings(*result.configuration) : std::vector<std::string>{"refused"};
  };
  EXPECT_THAT(told("rpm"), ::testing::IsEmpty());
  EXPECT_THAT(told("pulses_per_second"),
              ElementsAre(AllOf(HasSubstr("its velocities count r/min (60A9h is 00B44700h), and "
                                          "drive.velocity_unit says pulses/s; a drive that was not set "
                                          "otherwise is refused at bring-up"),
                                HasSubstr("write drive: { velocity_unit: rpm }"))));
}

TEST(Eds, RampsAndPolarityAreLookedAt) {
  const auto said = [](const std::string& object, const std::string& more = {}) {
    return findings(load({.more = "      objects: { " + object + " }\n" + more}));
  };
  const auto odd = fmt::format("60AAh: {{ type: u32, access: rw, default: {} }}", ramps_in_revolutions);
  EXPECT_THAT(said(odd), AllOf(HasSubstr("its ramps count something unclear (60AAh is 00B45700h)"),
                               HasSubstr("acceleration_unit: UNIT")));
  EXPECT_EQ(said(odd, "      ramps: time\n"), "");
  EXPECT_EQ(said(odd, "      acceleration_unit: rev_per_second\n"), "");
  EXPECT_THAT(said(odd, "      acceleration_unit: rpm\n      ramps: time\n"),
              HasSubstr("drive.acceleration_unit has no effect with ramps: time"));
  const auto in_rpm = fmt::format("60AAh: {{ type: u32, access: ro, default: {} }}", ramps_in_rpm);
  EXPECT_EQ(said(in_rpm), "");
  EXPECT_THAT(
      said(in_rpm, "      ramps: time\n"),
      HasSubstr("its ramps count r/min per second (60AAh is 00C00300h), and the axis is planned with times"));
  EXPECT_THAT(said("607Eh: { type: u8, access: rw, default: 128 }"),
              HasSubstr("it turns positions or velocities round, and not both (607Eh is 80h)"));
  EXPECT_EQ(said("607Eh: { type: u8, access: rw, default: 192 }"), "");
}

TEST(Eds, TerminalsHaveOneFunctionEach) {
  EXPECT_THAT(
      findings(load({.inputs = "NEG: home"})),
      HasSubstr("test.yaml:13:20: terminal NEG of model cia402 is always the drive's negative_limit"));
  EXPECT_THAT(findings(load({.inputs = "NEG: { function: negative_limit, active: low }"})),
              HasSubstr("the level of terminal NEG cannot be set"));
  EXPECT_TRUE(load({.inputs = "NEG: { function: negative_limit, active: high }"}).configuration);
  // On an inverted axis the drive's negative limit is the axis's positive one.
  EXPECT_TRUE(load({.invert = "true", .inputs = "NEG: positive_limit, HOME: home"}).configuration);
  EXPECT_THAT(findings(load({.invert = "true"})),
              HasSubstr("on an inverted axis it has the mirrored function"));
}

/// What a finding says to add is accepted.
TEST(Eds, AMissingSwitchIsSoughtAtTheTerminalThatHasIt) {
  const std::string homing =
      "    homing: { method: home_positive, velocity: 50 mm/s, search_velocity: 5 mm/s }\n";
  EXPECT_THAT(findings(load({.inputs = "NEG: negative_limit", .more = homing})),
              HasSubstr("add inputs: { HOME: home }"));
  EXPECT_TRUE(load({.inputs = "NEG: negative_limit, HOME: home", .more = homing}).configuration);
  const std::string limit =
      "    homing: { method: positive_limit, velocity: 50 mm/s, search_velocity: 5 mm/s }\n";
  EXPECT_THAT(findings(load({.invert = "true", .inputs = "HOME: home", .more = limit})),
              HasSubstr("add inputs: { NEG: positive_limit }"));
}

TEST(Eds, WhatTheDriveLacksIsRefused) {
  EXPECT_THAT(findings(load({.more = "    outputs: { Y0: alarm }\n"})),
              HasSubstr("model cia402 has no output terminal 'Y0'; it has none"));
  EXPECT_THAT(
      findings(load({.more = "    homing: { method: home_positive, velocity: 50 mm/s, search_velocity: 5 "
                             "mm/s, offset: 1 mm }\n"})),
      HasSubstr("model cia402 stops at the switch: it goes no 'offset' further; leave it out"));
}

TEST(Eds, KeysOfOtherModelsAreRefused) {
  const auto refused = [](const std::string& more) { return findings(load({.more = more})); };
  EXPECT_THAT(refused("      overtravel_stop: free\n"),
              HasSubstr("model cia402 has no setting 'overtravel_stop'"));
  EXPECT_THAT(
      refused("    drift_check: 20 s\n"),
      HasSubstr("'drift_check' has no effect: axisd sets no terminals on model cia402; leave it out"));
  EXPECT_THAT(refused("    brake: { release_time: 80 ms }\n"),
              HasSubstr("'brake' has no effect: model cia402 has no output function 'brake'"));
  EXPECT_THAT(refused("    segments: { velocities: { 1: { velocity: 20 mm/s } } }\n"),
              HasSubstr("model cia402 has no table of segments"));
}

TEST(Eds, NothingIsSavedByTheWay) {
  EXPECT_THAT(findings(load({.more = "    persist: true\n"})), HasSubstr("saves on command only"));
  EXPECT_TRUE(load({.more = "    persist: false\n"}).configuration);
}

TEST_F(EdsFile, ErrorsAreNamedWithTheirLines) {
  write_changed("HighLimit=2000000\n", "HighLimit=many\n");
  const auto text = found({.velocity = "1 mm/min"});
  EXPECT_THAT(text, HasSubstr(fmt::format("test.yaml:15:12: {}:{}: highlimit=many", path_.string(),
                                          line_of("HighLimit=many"))));
  EXPECT_THAT(text,
              HasSubstr("and axisd uses object 6081h:00; say what the drive's manual says: drive: { objects: "
                        "{ 6081h: { maximum: NUMBER } } }"));
  EXPECT_THAT(text, HasSubstr("test.yaml:12:")) << "the rest is judged all the same";
}

TEST_F(EdsFile, WhatTheConfigurationSaysStandsBeforeIt) {
  write_changed("HighLimit=2000000\n", "HighLimit=many\n");
  Axis axis{.velocity = "70 mm/s",
            .eds = path_.string(),
            .more = "      objects: { 6081h: { maximum: 1000000 } }\n"};
  const auto result = load(axis);
  ASSERT_TRUE(result.configuration) << findings(result);
  const auto& loaded = result.configuration->axes[0].axis;
  EXPECT_EQ(find_parameter(loaded.own_descriptor->parameters, 0x608100)->maximum, 1'000'000);
  EXPECT_EQ(loaded.model_settings.at("objects.6081h:00.maximum"), SettingValue(std::int64_t{1'000'000}));
  EXPECT_TRUE(file_warnings(*result.configuration).empty()) << "it is settled";
  axis.velocity = "100 mm/s";  // 1'310'720 increments/s
  EXPECT_THAT(findings(load(axis)), HasSubstr("at most 915 r/min"));
  axis.more = "      objects: { 6081h: { maximum: 999999 } }\n";
  axis.velocity = "70 mm/s";
  const auto other = load(axis);
  ASSERT_TRUE(other.configuration) << findings(other);
  EXPECT_EQ(differences(*result.configuration, *other.configuration).at(0).keys,
            std::vector<std::string>{"drive.objects.6081h:00.maximum"});
}

TEST_F(EdsFile, FlawsThatDoNotMatterAreToldOnce) {
  write_changed("DefaultValue=0x00020192", "DefaultValue=many");
  Axis axis{.eds = path_.string()};
  const auto result = load(axis);
  ASSERT_TRUE(result.configuration) << findings(result);
  const auto warning =
      fmt::format("{}:{}: defaultvalue=many: not a number", path_.string(), line_of("DefaultValue=many"));
  EXPECT_THAT(file_warnings(*result.configuration), ElementsAre(HasSubstr(warning)));
  EXPECT_THAT(warnings(*result.configuration), Contains(HasSubstr(warning)));
}

TEST(EdsObjects, KeysAreChecked) {
  const auto refused = [](const std::string& objects) {
    return findings(load({.more = fmt::format("      objects: {}\n", objects)}));
  };
  EXPECT_EQ(refused("{ 6084h: { type: u32, access: rw, minimum: 1, maximum: 5, default: 2, pdo: false } }"),
            "");
  EXPECT_THAT(refused("{ 0x6084: { type: u32 } }"),
              HasSubstr("'0x6084' is no object; write INDEXh or INDEXh:SUB"));
  EXPECT_THAT(refused("{ 6084h: { typ: u32 } }"), HasSubstr("did you mean 'type'?"));
  EXPECT_THAT(refused("{ 6084h: { type: u64 } }"), HasSubstr("'type' cannot be 'u64'"));
  EXPECT_THAT(refused("{ 6084h: { access: rww } }"), HasSubstr("'access' cannot be 'rww'"));
  EXPECT_THAT(refused("{ 6084h: u32 }"), HasSubstr("must be a section of keys"));
  EXPECT_THAT(refused("u32"), HasSubstr("'objects' must be a section of keys"));
  EXPECT_THAT(refused("{ 6084h: { maximum: 1 }, 6084h:00: { minimum: 1 } }"),
              HasSubstr("object 6084h:00 stands there twice"));
  EXPECT_THAT(refused("{ 6084h: { maximum: 4294967296 } }"), HasSubstr("'maximum' is out of range"));
  EXPECT_THAT(refused("{ 6060h: { maximum: 300 } }"),
              HasSubstr("drive.objects, 6060h:00: its type cannot hold 'maximum' 300"));
  EXPECT_THAT(refused("{ 6084h: { minimum: 6, maximum: 5 } }"),
              HasSubstr("its minimum 6 is above its maximum 5"));
  EXPECT_THAT(refused("{ 2999h: { type: u8 } }"), HasSubstr("the file does not describe it"));
  EXPECT_THAT(refused("{ 6083h: { access: none } }"),
              HasSubstr("object 6083h:00 (profile acceleration) is missing"));
  EXPECT_THAT(refused("{ 60FDh: { access: none } }"), HasSubstr("has no terminal NEG"));
}

TEST(EdsObjects, WithoutADecelerationBothRampsAreAlike) {
  for (const std::string access : {"none", "ro"}) {
    Axis axis{.more = fmt::format("      objects: {{ 6084h: {{ access: {} }} }}\n", access)};
    EXPECT_EQ(findings(load(axis)), "") << access;
    axis.velocity = "100 mm/s, deceleration_time: 80 ms";
    EXPECT_THAT(findings(load(axis)), HasSubstr("'deceleration_time' has no effect")) << access;
  }
}

/// A value that templates have: from 100 mm/s it would brake for two weeks.
TEST(EdsObjects, ADecelerationThatNoDriveHasIsNotBelieved) {
  const auto found = [](const std::string& value, const std::string& velocity, const std::string& more = "") {
    return findings(load(
        {.velocity = velocity,
         .more = fmt::format("      objects: {{ 6084h: {{ access: ro, default: {} }} }}\n{}", value, more)}));
  };
  EXPECT_THAT(
      found("1", "100 mm/s"),
      AllOf(HasSubstr("test.yaml:12:"), HasSubstr("by 6084h it brakes for 86400 s from limits.velocity"),
            HasSubstr("lower limits.velocity, or say what the drive does: objects: { 6084h: { access: "
                      "none } }")));
  EXPECT_EQ(found("25000", "100 mm/s"), "") << "52 s";
  EXPECT_THAT(found("20000", "100 mm/s"), HasSubstr("it brakes for 66 s"));
  EXPECT_EQ(found("20000", "50 mm/s"), "");
  EXPECT_EQ(found("60000", "100 mm/s", "      ramps: time\n"), "");
  EXPECT_THAT(found("60001", "100 mm/s", "      ramps: time\n"), HasSubstr("it brakes for 60 s"));
  EXPECT_EQ(found("0", "100 mm/s"), "") << "it tells nothing";
}

/// It is enabled by way of no mode, in which nobody knows what holds the load.
TEST(EdsObjects, AVerticalLoadNeedsAModeToRestIn) {
  const auto found = [](const std::string& lacking) {
    return findings(load({.more = "      objects: { " + lacking + " }\n    load: vertical\n"}));
  };
  const std::string no_velocity = "60FFh: { access: none }", no_homing = "6098h: { access: none }";
  EXPECT_EQ(found(no_homing), "");
  EXPECT_EQ(found(no_velocity), "");
  EXPECT_THAT(found(no_velocity + ", " + no_homing),
              AllOf(HasSubstr("test.yaml:18:11: this drive of model cia402 may let a vertical load sag"),
                    HasSubstr("drive: { objects: ... }")));
}

TEST_F(EdsFile, EachMissingObjectIsNamed) {
  write(
      "[DeviceInfo]\nVendorNumber=1\n[6041]\nParameterName=Statusword\nObjectType=7\nDataType=6\nAccessType="
      "ro\n");
  const auto text = found();
  for (const auto object : {"6040h:00", "6060h:00", "6064h:00", "607Ah:00", "6081h:00"})
    EXPECT_THAT(text, HasSubstr(fmt::format("test.yaml:15:12: {}: object {}", path_.string(), object)));
  EXPECT_EQ(text.find("6041h"), std::string::npos);
}

TEST_F(EdsFile, ADriveWithoutHomingModeHasNoHoming) {
  write_changed("DefaultValue=0x00000025", "DefaultValue=0x00000005");
  EXPECT_EQ(found(), "");
  EXPECT_THAT(
      found({.more = "    homing: { method: home_positive, velocity: 50 mm/s, search_velocity: 5 mm/s }\n"}),
      HasSubstr("this drive of model cia402 does not home"));
}

std::string homing_by(std::string_view method, std::string_view more = "") {
  return fmt::format("    homing: {{ method: {}, velocity: 50 mm/s, search_velocity: 5 mm/s{} }}\n", method,
                     more);
}

TEST(EdsHoming, AMethodByItsNumberIsTheDrivesOwn) {
  const auto found = [](std::string_view method, std::string_view more = "", std::string invert = "false") {
    return findings(load({.invert = std::move(invert), .inputs = "", .more = homing_by(method, more)}));
  };
  for (const auto* method : {"17", "1", "37", "-1", "-128"}) EXPECT_EQ(found(method), "") << method;
  EXPECT_THAT(found("0"), AllOf(HasSubstr("this drive of model cia402 has no homing method 0"),
                                HasSubstr("by its data sheet it may have -128 to -1, 1 to 37")));
  EXPECT_THAT(found("38"), HasSubstr("this drive of model cia402 has no homing method 38"));
  EXPECT_THAT(found("128"), HasSubstr("'method' is out of range"));
  EXPECT_THAT(found("'17'"), HasSubstr("'method' cannot be '17'"));
  EXPECT_THAT(found("17", ", backoff: 5 mm"), HasSubstr("'backoff' has no effect with a homing method by"));
  const auto objects = [](std::string_view said, std::string_view more) {
    return findings(load(
        {.inputs = "", .more = fmt::format("      objects: {{ {} }}\n{}", said, homing_by("17", more))}));
  };
  const auto once = objects("60FDh: { access: none }", ", backoff: 5 mm");
  EXPECT_THAT(once, HasSubstr("'backoff' has no effect with a homing method by its number"));
  EXPECT_EQ(std::ranges::count(once, '\n'), 1) << once;
  EXPECT_THAT(objects("6098h: { minimum: 0, maximum: 0 }", ""),
              AllOf(HasSubstr("this drive of model cia402 has no homing method, by its data sheet"),
                    HasSubstr("6098h: { minimum: NUMBER, maximum: NUMBER }")));
  EXPECT_EQ(found("24", "", "true"), "");
  EXPECT_THAT(found("-3", "", "true"), HasSubstr("homing method -3 cannot be mirrored for an inverted axis"));
  const auto axis = [](std::string_view method) {
    return load({.inputs = "", .more = homing_by(method)}).configuration.value();
  };
  EXPECT_EQ(axis("-7").axes.at(0).axis.homing->number, std::optional<std::int8_t>(-7));
  const auto changes = differences(axis("17"), axis("18"));
  ASSERT_EQ(changes.size(), 1U);
  EXPECT_THAT(changes[0].keys, ElementsAre("homing.method"));
}

TEST_F(EdsFile, ADriveWithoutDigitalInputsHasNoTerminals) {
  write_without("60FD");
  EXPECT_EQ(found({.inputs = ""}), "");
  EXPECT_THAT(
      found({.inputs = "NEG: negative_limit"}),
      HasSubstr("this drive of model cia402 has no terminal NEG: its data sheet has no object for it"));
  const std::string homing =
      "    homing: { method: home_positive, velocity: 50 mm/s, search_velocity: 5 mm/s";
  EXPECT_EQ(found({.inputs = "", .more = homing + " }\n"}), "") << "the switch is the drive's own affair";
  EXPECT_THAT(found({.inputs = "", .more = homing + ", backoff: 5 mm }\n"}),
              HasSubstr("'backoff' has no effect: this drive of model cia402 does not show its switches"));
}

TEST_F(EdsFile, ADriveWithoutHomingAccelerationTakesNoTimeForIt) {
  write_without("609A");
  const std::string homing =
      "    homing: { method: home_positive, velocity: 50 mm/s, search_velocity: 5 mm/s";
  EXPECT_EQ(found({.more = homing + " }\n"}), "");
  EXPECT_THAT(found({.more = homing + ", acceleration_time: 200 ms }\n"}),
              HasSubstr("'acceleration_time' has no effect: this drive of model cia402 has none for homing"));
}

TEST_F(EdsFile, WhatIsNoEdsIsRefusedInTime) {
  write(std::string(5U << 20U, 'x'));
  EXPECT_THAT(found(), HasSubstr("test.yaml:15:12: "));
  write("");
  EXPECT_THAT(found(), HasSubstr("no object is described"));
}

}  // namespace
}  // namespace axisd::config
