// Simulated drives made of makers' data sheets, by their objects alone: raw SDO frames, and no driver. The
// files are not part of this project: as in makers_files_test.cpp, what is not there is skipped by name.
#include <algorithm>
#include <cctype>
#include <filesystem>
#include <memory>
#include <ostream>
#include <string_view>
#include <system_error>

#include "buses/canopen/eds.hpp"
#include "tests/support/makers_files.hpp"
#include "tests/unit/devices/cia402_eds/standard_drive_bench.hpp"

namespace axisd::cia402_eds {
namespace {

constexpr std::uint32_t no_object = 0x06020000, no_sub_index = 0x06090011, read_only = 0x06010002,
                        bad_value = 0x06090030;

enum class Homes : std::uint8_t { yes, no };

/// What the file tells of its drive, worked out by hand for 4096 counts per revolution where it tells none.
struct Row {
  std::string_view file;
  std::uint32_t vendor;
  std::optional<std::uint32_t> product;
  std::int32_t counts;  ///< of 6064h in a revolution
  std::int64_t speed;   ///< 2 revolutions per second, in 6081h and 60FFh
  std::int64_t ramp;    ///< 10 revolutions per second squared, in 6083h to 6085h
  Homes homes = Homes::yes;
  std::uint32_t deceleration = 0;  ///< how a write to 6084h ends
  double halting_turns = 0.2;      ///< (2 r/s)^2 / (2 x 10 r/s^2)
};

// Increments: 2 x counts, 10 x counts. r/min: 120, and 600 r/min/s.
constexpr Row table[] = {
    {"elmo-gold-whistle-v002.dcf", 0x9A, 0x00030923, 4096, 8192, 40960},  // 608Fh is 1/1
    {"elmo-simpliq.dcf", 0x9A, 0, 4096, 8192, 40960},
    {"elmo.eds", 0x9A, 0x00030923, 4096, 8192, 40960},
    {"eyou-yiyou-servo-1.4.eds", 0x668, 0x00220811, 4096, 8192, 40960, Homes::no},
    {"faulhaber-327-3150-1.eds", 327, 3150, 2048, 4096, 20480},     // 608Fh: 2048
    {"faulhaber-605-3150-67-b.eds", 327, 3150, 3000, 6000, 30000},  // 608Fh: 3000
    {"maxon-epos-70-10.eds", 0xFB, 1611661312, 4096, 120, 600},     // 608Ch, 608Eh: A4h
    {"maxon-epos4.eds", 0xFB, 0x60500000, 4096, 120, 600},          // 60A9h, 60AAh: r/min, r/min/s
    {"nanotec-cl4-e-1-12.eds", 0x26C, 0x5A, 3600, 120, 600},        // 60A8h: 0.1 degrees, 60A9h: r/min
    {"oriental-motor-blvd-krd-v400.eds", 702, 5111, 36000, 72000, 360000},  // 608Fh: 36000
    {"ros2-canopen-fake-slave.eds", 0x555, 1, 4096, 8192, 40960},
    {"ros2-canopen-robot-control.eds", 0x1A3, 0, 4096, 8192, 40960, Homes::yes, no_object},
    {"technosoft-isd860.eds", 0x1A3, std::nullopt, 4096, 8192, 40960, Homes::yes, no_object},
    // It brakes with the 2000 inc/s^2 of its 6084h: 4 / (2 x 2000 / 4096).
    {"trinamic-tmcc-160.eds", 0x286, 0xA0, 4096, 8192, 40960, Homes::yes, read_only, 4.096},
    {"trinamic-tmcm-1231.eds", 0x286, 0x4CF, 4096, 8192, 40960},
    {"trinamic-tmcm-1270.eds", 0x286, 0x4F6, 4096, 8192, 40960},
    {"trinamic-tmcm-1636.eds", 0x286, 0x664, 4096, 8192, 40960},
};

void PrintTo(const Row& row, std::ostream* out) { *out << row.file; }

class SimulatedMakersDrive : public ::testing::TestWithParam<Row> {
 protected:
  void SetUp() override {
    const auto path = test::makers_file(row().file);
    if (!std::filesystem::exists(path))
      GTEST_SKIP() << path << " is not there; name the folder of makers' files in AXISD_EDS_FOLDER";
    auto sheet = canopen::load_eds(path.string());
    ASSERT_TRUE(sheet) << to_string(sheet.error());
    bench_.emplace(
        simulation::SimulatedNodeSettings{.sheet = std::make_shared<const canopen::Eds>(std::move(*sheet)),
                                          .units = {.counts_per_revolution = 4096}});
  }
  [[nodiscard]] static const Row& row() { return GetParam(); }
  Bench& bench() { return *bench_; }
  [[nodiscard]] double turns() { return static_cast<double>(bench().drive().shaft_pulses()) / row().counts; }

  /// Speed and ramps of the table, as far as they can be written.
  void set_profile() {
    EXPECT_EQ(bench().write(0x6081, 4, row().speed), 0U);
    EXPECT_EQ(bench().write(0x6083, 4, row().ramp), 0U);
    EXPECT_EQ(bench().write(0x6084, 4, row().ramp), row().deceleration);
    EXPECT_EQ(bench().write(0x6085, 4, row().ramp), 0U);
  }
  /// Turns of the shaft within a second, by the shaft itself.
  double turns_per_second() {
    const auto before = turns();
    bench().run(1s);
    return turns() - before;
  }
  /// Turns from `word` to standstill.
  double turns_after(std::uint16_t word) {
    const auto before = turns();
    bench().control(word);
    bench().run(6s);
    EXPECT_FALSE(bench().drive().shaft_moving());
    return turns() - before;
  }

 private:
  std::optional<Bench> bench_;
};

TEST_P(SimulatedMakersDrive, BootsAndSaysWhoItIs) {
  bench().put(0x000, {0x81, 0x01});
  const auto sent = bench().run(1s);
  ASSERT_FALSE(sent.empty());
  EXPECT_EQ(sent.front().id, 0x701U);
  EXPECT_EQ(sent.front().data[0], 0);
  EXPECT_EQ(bench().read(0x1000) & 0xFFFF, 402);
  EXPECT_EQ(bench().read(0x1018, 1), row().vendor);
  if (row().product)
    EXPECT_EQ(bench().read(0x1018, 2), *row().product);
  else
    EXPECT_EQ(bench().write(0x1018, 2, 4, 0), no_sub_index);
  EXPECT_EQ(bench().write(0x9F00, 4, 0), no_object);
  EXPECT_EQ(bench().status() & 0x4FU, 0x40U);
  EXPECT_EQ(bench().position(), 0);
  EXPECT_EQ(bench().drive().starts(), 0);
}

TEST_P(SimulatedMakersDrive, HomesWhereItStandsOrRefusesTheMode) {
  if (row().homes == Homes::no) {
    EXPECT_EQ(bench().write(0x6098, 1, 35), no_object);
    EXPECT_EQ(bench().write(0x6060, 1, 6), bad_value);
    return;
  }
  set_profile();
  bench().enable(1);
  bench().move(row().counts);
  bench().run(10s);
  EXPECT_EQ(bench().position(), row().counts);
  bench().home(35);
  EXPECT_TRUE(bench().bit(12));
  EXPECT_TRUE(bench().bit(10));
  EXPECT_FALSE(bench().bit(13));
  EXPECT_EQ(bench().position(), 0);
  EXPECT_NEAR(turns(), 1, 1e-9);
}

TEST_P(SimulatedMakersDrive, MovesToItsTargetAtItsTrueSpeed) {
  set_profile();
  bench().enable(1);
  bench().move(20 * row().counts);
  EXPECT_TRUE(bench().bit(12));
  EXPECT_FALSE(bench().bit(10));
  bench().run(1s);
  EXPECT_NEAR(turns_per_second(), 2, 0.02);
  EXPECT_NEAR(bench().velocity(), row().speed, static_cast<double>(row().speed) / 100);
  bench().run(15s);
  EXPECT_EQ(bench().position(), 20 * row().counts);
  EXPECT_NEAR(turns(), 20, 1e-9);
  EXPECT_TRUE(bench().bit(10));
  bench().control(0x0F);
  EXPECT_FALSE(bench().bit(12));
}

TEST_P(SimulatedMakersDrive, HaltsAndQuickStopsOnItsRamps) {
  set_profile();
  bench().enable(1);
  bench().move(100 * row().counts);
  bench().run(2s);
  EXPECT_NEAR(turns_after(0x11F), row().halting_turns, row().halting_turns / 100);
  EXPECT_EQ(bench().velocity(), 0);
  EXPECT_EQ(bench().status() & 0x6FU, 0x27U);
  bench().control(0x0F);  // and goes on
  bench().run(2s);
  EXPECT_NEAR(turns_after(0x0B), 0.2, 0.002);
  EXPECT_NE(bench().status() & 0x6FU, 0x27U);
  bench().control(0x00);
  bench().enable(1);
  bench().run(1s);
  EXPECT_FALSE(bench().drive().shaft_moving()) << "nothing resumes";
}

TEST_P(SimulatedMakersDrive, RunsAtItsTargetVelocity) {
  set_profile();
  bench().enable(3);
  EXPECT_EQ(bench().write(0x60FF, 4, -row().speed), 0U);
  bench().run(1s);
  EXPECT_NEAR(turns_per_second(), -2, 0.02);
  EXPECT_EQ(bench().write(0x60FF, 4, 0), 0U);
  bench().run(6s);
  EXPECT_FALSE(bench().drive().shaft_moving());
}

TEST_P(SimulatedMakersDrive, FaultsAndIsReset) {
  set_profile();
  bench().enable(1);
  bench().move(20 * row().counts);
  bench().run(1s);
  bench().drive().raise_alarm(0x2310);
  const auto sent = bench().run(1ms);
  const auto emergency = std::ranges::find(sent, 0x81U, &can::Frame::id);
  ASSERT_NE(emergency, sent.end());
  EXPECT_EQ(emergency->data[0] | emergency->data[1] << 8, 0x2310);
  EXPECT_EQ(bench().status() & 0x4FU, 0x08U);
  bench().control(0x00);
  bench().control(0x80);
  EXPECT_EQ(bench().status() & 0x4FU, 0x40U);
  bench().enable(1);
  bench().run(1s);
  EXPECT_EQ(bench().drive().starts(), 1) << "nothing resumes";
}

/// Templates, and files of drives that are none of CiA 402: whatever can be read makes a node that boots.
TEST(SimulatedMakersDrives, BootWhateverTheyAre) {
  int seen = 0;
  for (std::error_code error;
       const auto& entry : std::filesystem::directory_iterator(test::makers_folder(), error)) {
    const auto extension = entry.path().extension();
    if (extension != ".eds" && extension != ".dcf") continue;
    SCOPED_TRACE(entry.path());
    ++seen;
    auto sheet = canopen::load_eds(entry.path().string());
    if (!sheet) continue;
    Bench bench({.sheet = std::make_shared<const canopen::Eds>(std::move(*sheet))});
    bench.put(0x000, {0x81, 0x01});
    const auto sent = bench.run(1s);
    ASSERT_FALSE(sent.empty());
    EXPECT_EQ(sent.front().id, 0x701U);
    bench.put(0x000, {0x01, 0x01});
    bench.put(0x080, {});
    bench.run(100ms);
    EXPECT_FALSE(bench.drive().shaft_moving());
  }
  if (seen == 0)
    GTEST_SKIP() << "no file in " << test::makers_folder()
                 << "; name the folder of makers' files in AXISD_EDS_FOLDER";
}

std::string name_of(const ::testing::TestParamInfo<Row>& info) {
  std::string name(info.param.file);
  std::ranges::replace_if(name, [](unsigned char c) { return std::isalnum(c) == 0; }, '_');
  return name;
}
INSTANTIATE_TEST_SUITE_P(Each, SimulatedMakersDrive, ::testing::ValuesIn(table), name_of);

}  // namespace
}  // namespace axisd::cia402_eds
