// A drive's own unit objects at bring-up: what it counts is what the axis was planned with, or it is refused.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "buses/can/network.hpp"
#include "buses/canopen/canopen_bus.hpp"
#include "devices/cia402_eds/eds_drive.hpp"
#include "devices/cia402_eds/simulator.hpp"
#include "devices/drive.hpp"
#include "devices/simulation/can_nodes.hpp"
#include "tests/support/source_tree.hpp"
#include "tests/support/virtual_world.hpp"

namespace axisd::cia402_eds {
namespace {

using ::testing::HasSubstr;
using Settings = std::map<std::string, SettingValue>;

constexpr std::uint8_t node = 5;
constexpr std::uint32_t velocity_si = 0x60A900, position_si = 0x60A800;
constexpr std::uint32_t in_rpm = 0x00B44700, in_pulses = 0x00B50300;

/// What the maker's drive answers by SDO in place of the simulated one; nothing: the object does not exist.
using Answers = std::map<std::uint32_t, std::optional<std::uint32_t>>;

/// The standard drive with unit objects of its own.
class DriveWithUnits final : public simulation::SimulatedCanNode {
 public:
  DriveWithUnits(simulation::SimulatedNodeSettings settings, Answers& answers)
      : drive_(std::move(settings)), answers_(&answers) {}
  [[nodiscard]] std::uint8_t address() const override { return drive_.address(); }
  void advance(TimePoint now) override { drive_.advance(now); }
  void on_frame(const can::Frame& frame) override {
    constexpr std::uint8_t initiate_upload = 0x40;
    const std::uint32_t object = std::uint32_t{frame.data[2]} << 16U | std::uint32_t{frame.data[1]} << 8U |
                                 std::uint32_t{frame.data[3]};
    const auto found = answers_->find(object);
    if (frame.id != 0x600U + node || frame.data[0] != initiate_upload || found == answers_->end())
      return drive_.on_frame(frame);
    constexpr std::uint32_t no_such_object = 0x06020000;
    constexpr std::uint8_t four_bytes = 0x43, abort = 0x80;
    const auto value = found->second.value_or(no_such_object);
    std::vector<std::uint8_t> bytes{found->second ? four_bytes : abort, frame.data[1], frame.data[2],
                                    frame.data[3]};
    for (unsigned i = 0; i < 4; ++i) bytes.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
    replies_.push_back(can::make_frame(0x580U + node, bytes));
  }
  std::optional<can::Frame> take_frame() override {
    if (replies_.empty()) return drive_.take_frame();
    auto frame = replies_.front();
    replies_.pop_front();
    return frame;
  }
  [[nodiscard]] TimePoint next_event() const override { return drive_.next_event(); }
  void set_power(bool on) override { drive_.set_power(on); }
  void set_input(std::string_view terminal, std::optional<bool> active) override {
    drive_.set_input(terminal, active);
  }
  void raise_alarm(int code) override { drive_.raise_alarm(code); }
  [[nodiscard]] std::int64_t shaft_pulses() const override { return drive_.shaft_pulses(); }
  [[nodiscard]] bool shaft_moving() const override { return drive_.shaft_moving(); }
  [[nodiscard]] int starts() const override { return drive_.starts(); }
  [[nodiscard]] std::uint32_t peek(std::uint32_t address) const override { return drive_.peek(address); }
  void poke(std::uint32_t address, std::uint32_t value) override { drive_.poke(address, value); }

 private:
  StandardDrive drive_;
  Answers* answers_;
  std::deque<can::Frame> replies_;
};

/// The example's drive, as if its data sheet had these objects, too.
Settings with_objects(const std::map<std::string, std::int64_t>& objects, const std::string& unit) {
  Settings settings{{"eds", test::in_source_tree("config/examples/standard-drive.eds")}};
  if (!unit.empty()) settings["velocity_unit"] = unit;
  for (const auto& [name, value] : objects) {
    settings["objects." + name + ".type"] = std::string("u32");
    settings["objects." + name + ".access"] = std::string("rw");
    settings["objects." + name + ".default"] = value;
  }
  return settings;
}

class UnitBench {
 public:
  UnitBench(const Settings& settings, Answers answers)
      : answers_(std::move(answers)),
        nodes_(world_.clock(), network_),
        bus_(world_.executor(), world_.clock(), canopen::NetworkSettings{.name = "can0", .interface = "sim"},
             std::make_unique<can::NetworkPort>(
                 world_.clock(), can::PortSettings{.bus = "can0", .interface = "sim", .bitrate = 1'000'000},
                 network_)) {
    simulated_ = &nodes_.nodes().add(
        std::make_unique<DriveWithUnits>(simulation::SimulatedNodeSettings{.address = node}, answers_));
    world_.run_for(std::chrono::seconds(1));  // it boots
    const auto* model = find_drive_model("cia402");
    auto made = model->specialise(*model, settings);
    if (!made) throw std::runtime_error(to_string(made.error()));
    DriveContext context{.executor = world_.executor(), .clock = &world_.clock(), .canopen = &bus_};
    context.node = node;
    context.setup.pulses_per_revolution = 1000;
    context.setup.own_descriptor = *made;
    drive_ = model->make(std::move(context));
    bus_.start();
    world_.run_for(std::chrono::milliseconds(10));
  }
  ~UnitBench() {
    bus_.close();
    world_.run_for(std::chrono::seconds(5));
  }
  UnitBench(const UnitBench&) = delete;

  template <class T>
  Result<T> run(Task<Result<T>> task) {
    std::optional<Result<T>> result;
    spawn(world_.executor(), store(std::move(task), result), "test");
    if (!world_.run_until([&] { return result.has_value(); }, std::chrono::minutes(1)))
      return fail(Reason::internal, "it does not end");
    return std::move(*result);
  }
  Result<void> bring_up() {
    const auto identity = run(drive_->identify(TransactionClass::parameters));
    if (!identity) return fail(identity.error());
    return run(drive_->configure());
  }
  void cycle_power() {
    for (const bool on : {false, true}) {
      simulated_->set_power(on);
      nodes_.nodes().advance();
      world_.run_for(std::chrono::seconds(2));
    }
  }
  Answers& answers() { return answers_; }
  [[nodiscard]] Drive& drive() { return *drive_; }

 private:
  template <class T>
  static Task<> store(Task<Result<T>> task, std::optional<Result<T>>& result) {
    result = co_await std::move(task);
  }

  Answers answers_;
  test::VirtualWorld world_;
  can::Network network_{world_.clock(), 1'000'000};
  simulation::NetworkNodes nodes_;
  simulation::SimulatedCanNode* simulated_ = nullptr;
  canopen::CanopenBus bus_;
  std::unique_ptr<Drive> drive_;
};

void expect_refused(const Result<void>& configured, std::uint32_t object, const std::string& message,
                    const std::string& remedy) {
  ASSERT_FALSE(configured);
  EXPECT_EQ(configured.error().reason, Reason::misconfigured);
  EXPECT_EQ(configured.error().where.object, object);
  EXPECT_EQ(configured.error().where.node, node);
  EXPECT_THAT(configured.error().message, HasSubstr(message));
  EXPECT_THAT(configured.error().remedy, HasSubstr(remedy));
}

TEST(UnitCheck, ADriveThatCountsAsPlannedIsConfigured) {
  UnitBench by_file(with_objects({{"60A9h:00", in_pulses}}, ""), {{velocity_si, in_pulses}});
  const auto configured = by_file.bring_up();
  EXPECT_TRUE(configured) << to_string(configured.error());
  UnitBench by_key(with_objects({{"60A9h:00", in_rpm}}, "pulses_per_second"), {{velocity_si, in_pulses}});
  const auto keyed = by_key.bring_up();
  EXPECT_TRUE(keyed) << to_string(keyed.error());
}

TEST(UnitCheck, AnObjectThatTheDriveDoesNotHaveTellsNothing) {
  for (const bool zero : {false, true}) {
    const auto answer = zero ? std::optional<std::uint32_t>(0) : std::nullopt;
    UnitBench bench(with_objects({{"60A9h:00", in_pulses}, {"60A8h:00", 0x00B50000}}, ""),
                    {{velocity_si, answer}, {position_si, answer}});
    const auto configured = bench.bring_up();
    EXPECT_TRUE(configured) << to_string(configured.error());
  }
}

TEST(UnitCheck, ADriveThatCountsOtherwiseThanItsDataSheetIsRefused) {
  UnitBench bench(with_objects({{"60A9h:00", in_pulses}}, ""), {{velocity_si, in_rpm}});
  expect_refused(bench.bring_up(), velocity_si,
                 "its velocities count r/min (60A9h is 00B44700h), and its data sheet says pulses/s",
                 "drive: { velocity_unit: rpm }");
  bench.answers()[velocity_si] = in_pulses;  // somebody mends it
  const auto mended = bench.bring_up();
  EXPECT_TRUE(mended) << to_string(mended.error());
}

TEST(UnitCheck, ADriveThatCountsOtherwiseThanTheKeyIsRefused) {
  UnitBench bench(with_objects({{"60A9h:00", in_pulses}}, "pulses_per_second"), {{velocity_si, in_rpm}});
  expect_refused(bench.bring_up(), velocity_si, "and drive.velocity_unit says pulses/s",
                 "60A9h: { access: none }");
}

TEST(UnitCheck, ARevolutionWithOtherCountsIsRefused) {
  UnitBench bench(with_objects({{"60A8h:00", 0}}, "pulses_per_second"), {{position_si, 0xFF410000}});
  expect_refused(bench.bring_up(), position_si,
                 "a revolution has 3600 counts (60A8h is FF410000h), and scale.microstep says 1000",
                 "scale: { microstep: ... }");
}

/// 6084h of the file is in each prediction and each bound.
TEST(UnitCheck, ADriveThatBrakesForLongerThanItsDataSheetSaysIsRefused) {
  constexpr std::uint32_t deceleration = 0x608400;
  auto settings = with_objects({}, "pulses_per_second");
  settings["objects.6084h:00.access"] = std::string("ro");
  settings["objects.6084h:00.default"] = std::int64_t{5000};
  UnitBench bench(settings, {{deceleration, 4999}});
  expect_refused(bench.bring_up(), deceleration,
                 "it brakes for longer than its data sheet says: 6084h is 4999 instead of 5000",
                 "objects: { 6084h: { default: 4999 } }");
  bench.answers()[deceleration] = 0;
  expect_refused(bench.bring_up(), deceleration, "6084h is 0 instead of 5000", "6084h: { access: none }");
  bench.answers()[deceleration] = std::nullopt;
  const auto missing = bench.bring_up();
  ASSERT_FALSE(missing) << "nobody knows what it brakes with";
  EXPECT_THAT(missing.error().remedy, HasSubstr("6084h: { access: none }"));
  for (const std::uint32_t good : {5000U, 6000U}) {
    bench.answers()[deceleration] = good;
    const auto configured = bench.bring_up();
    EXPECT_TRUE(configured) << to_string(configured.error());
  }
  settings["ramps"] = std::string("time");
  UnitBench times(settings, {{deceleration, 5001}});
  expect_refused(times.bring_up(), deceleration, "6084h is 5001 instead of 5000", "{ default: 5001 }");
  times.answers()[deceleration] = 4000;
  EXPECT_TRUE(times.bring_up());
}

/// The unit that was set is gone with the power.
TEST(UnitCheck, APowerCycleIsLookedAtAnew) {
  UnitBench bench(with_objects({{"60A9h:00", in_pulses}}, ""), {{velocity_si, in_pulses}});
  ASSERT_TRUE(bench.bring_up());
  bench.answers()[velocity_si] = in_rpm;
  bench.cycle_power();
  EXPECT_FALSE(bench.run(bench.drive().enable({}))) << "it is not configured in this power cycle";
  (void)bench.bring_up();  // tells of the restart, where nobody did yet
  expect_refused(bench.bring_up(), velocity_si, "its velocities count r/min", "velocity_unit: rpm");
}

/// Whoever else sets the drive while it is in use, or while it cannot be reached.
TEST(UnitCheck, AUnitThatIsChangedLaterIsFound) {
  UnitBench bench(with_objects({{"60A9h:00", in_pulses}}, ""), {{velocity_si, in_pulses}});
  ASSERT_TRUE(bench.bring_up());
  const auto look = [&] { return bench.run(bench.drive().check_drift({})); };
  const auto none = look();
  ASSERT_TRUE(none) << to_string(none.error());
  EXPECT_EQ(none->text, "");
  bench.answers()[velocity_si] = in_rpm;
  const auto drift = look();
  ASSERT_TRUE(drift) << to_string(drift.error());
  EXPECT_THAT(drift->text, HasSubstr("its velocities count r/min (60A9h is 00B44700h)"));
  EXPECT_TRUE(drift->scale_changed);
}

/// Its 6084h is in each bound of a stop, and the maker's tool sets it whenever it likes.
TEST(UnitCheck, ADecelerationThatIsChangedLaterIsFound) {
  constexpr std::uint32_t deceleration = 0x608400;
  auto settings = with_objects({}, "pulses_per_second");
  settings["objects.6084h:00.access"] = std::string("ro");
  settings["objects.6084h:00.default"] = std::int64_t{5000};
  UnitBench bench(settings, {{deceleration, 5000}});
  ASSERT_TRUE(bench.bring_up());
  const auto look = [&] { return bench.run(bench.drive().check_drift({})); };
  for (const std::uint32_t good : {5000U, 6000U}) {
    bench.answers()[deceleration] = good;
    const auto none = look();
    ASSERT_TRUE(none) << to_string(none.error());
    EXPECT_EQ(none->text, "");
    EXPECT_FALSE(none->limits_changed);
  }
  bench.answers()[deceleration] = 4999;
  const auto drift = look();
  ASSERT_TRUE(drift) << to_string(drift.error());
  EXPECT_THAT(drift->text, HasSubstr("it brakes for longer than its data sheet says"));
  EXPECT_TRUE(drift->limits_changed);
  EXPECT_FALSE(drift->scale_changed) << "its positions mean what they did";
}

/// M13: what the drive holds tells how long a quick stop is waited for. 1000 counts are a revolution.
TEST(UnitCheck, TheRampOfAQuickStopIsReadFromTheDrive) {
  using namespace std::chrono_literals;
  constexpr std::uint32_t quick_stop_ramp = 0x608500;
  UnitBench bench(with_objects({}, "pulses_per_second"), {{quick_stop_ramp, 500'000}});
  EXPECT_EQ(bench.drive().quick_stop_time(600), std::nullopt) << "not known yet: as a stop";
  ASSERT_TRUE(bench.bring_up());
  EXPECT_EQ(bench.drive().quick_stop_time(600), std::optional<Duration>(20ms));
  const auto look = [&](std::optional<std::uint32_t> held) {
    bench.answers()[quick_stop_ramp] = held;
    const auto drift = bench.run(bench.drive().check_drift({}));
    ASSERT_TRUE(drift) << to_string(drift.error());
    EXPECT_EQ(drift->text, "");
  };
  look(1'000'000);
  EXPECT_EQ(bench.drive().quick_stop_time(600), std::optional<Duration>(10ms));
  bench.answers()[quick_stop_ramp] = 2'000'000;  // as it is read back
  const auto written = bench.run(bench.drive().facets().parameters->write_parameters(
      {{.address = quick_stop_ramp, .value = 2'000'000}}));
  ASSERT_TRUE(written) << to_string(written.error());
  EXPECT_EQ(bench.drive().quick_stop_time(600), std::optional<Duration>(5ms)) << "it counts at once";
  look(1);
  EXPECT_EQ(bench.drive().quick_stop_time(600), std::nullopt) << "softer than a stop: it is not chosen";
  look(0);
  EXPECT_EQ(bench.drive().quick_stop_time(600), std::nullopt) << "that is no ramp";
  look(500'000);
  look(std::nullopt);
  EXPECT_EQ(bench.drive().quick_stop_time(600), std::nullopt) << "its file lists it, and it has none";
}

/// Without a 605Dh that can be written 6085h means nothing, and is not asked for.
TEST(UnitCheck, ADriveThatHaltsInOneWayHasNoRampOfAQuickStop) {
  auto settings = with_objects({}, "pulses_per_second");
  settings["objects.605Dh:00.access"] = std::string("ro");
  UnitBench bench(settings, {{0x608500, 20'000}});
  ASSERT_TRUE(bench.bring_up());
  EXPECT_EQ(bench.drive().quick_stop_time(600), std::nullopt);
}

TEST(UnitCheck, WhoWritesParametersLeavesUnitsAlone) {
  UnitBench bench(
      with_objects({{"607Eh:00", 0}, {"60A8h:00", 0}, {"60A9h:00", in_pulses}, {"60AAh:00", 0}}, ""),
      {{velocity_si, in_pulses}});
  EXPECT_EQ(bench.drive().facets().parameters->configured_by(0x607E00), "scale.invert");
  EXPECT_EQ(bench.drive().facets().parameters->configured_by(position_si), "scale.microstep");
  EXPECT_EQ(bench.drive().facets().parameters->configured_by(velocity_si), "drive.velocity_unit");
  EXPECT_EQ(bench.drive().facets().parameters->configured_by(0x60AA00), "drive.acceleration_unit");
}

}  // namespace
}  // namespace axisd::cia402_eds
