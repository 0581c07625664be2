// The frames that the manual prints, from the slave's side, and the exceptions of 6.2.4.
#include "tests/unit/devices/yako_rtu/simulator_fixture.hpp"

namespace axisd::yako_rtu {
namespace {

struct Golden {
  const char* section;
  const char* request;
  const char* reply;
};

class GoldenFrames : public ::testing::TestWithParam<Golden> {};

TEST_P(GoldenFrames, AreAnsweredAsPrinted) {
  Bench bench;
  EXPECT_EQ(GetParam().reply, bench.send(GetParam().request)) << GetParam().section;
}

// Misprints, with the reading of facts/manual-conflicts: the reply to function 02 prints its CRC as "61 C1"
// (C1 61 fits); the CRC error prints a reply although its text says silence.
INSTANTIATE_TEST_SUITE_P(
    Manual, GoldenFrames,
    ::testing::Values(Golden{"4.3 X0", "01 06 00 43 00 01 B9 DE", "01 06 00 43 00 01 B9 DE"},
                      Golden{"4.3 X1", "01 06 00 44 00 02 48 1E", "01 06 00 44 00 02 48 1E"},
                      Golden{"4.3 X2", "01 06 00 45 00 03 D8 1E", "01 06 00 45 00 03 D8 1E"},
                      Golden{"6.2.1 speed", "01 03 00 23 00 01 75 C0", "01 03 02 00 3C B8 55"},
                      Golden{"6.2.1 block", "01 03 00 20 00 04 45 C3",
                             "01 03 08 00 05 00 64 00 64 00 3C F0 D1"},
                      Golden{"6.2.2 speed", "01 06 00 23 00 3C 78 11", "01 06 00 23 00 3C 78 11"},
                      Golden{"6.2.2 time", "01 06 00 21 01 F4 D9 D7", "01 06 00 21 01 F4 D9 D7"},
                      Golden{"6.2.3", "01 10 00 24 00 02 04 00 00 13 88 FD 12", "01 10 00 24 00 02 01 C3"},
                      Golden{"6.2.4 CRC", "01 03 00 20 00 01 85 C1", "silence"},
                      Golden{"6.2.4 function", "01 02 00 00 00 04 79 C9", "01 82 02 C1 61"},
                      Golden{"6.2.4 hole", "01 03 00 19 00 01 55 CD", "01 83 03 01 31"},
                      Golden{"6.2.4 count", "01 03 00 20 00 20 45 D8", "01 83 05 81 33"},
                      Golden{"6.2.4 access", "01 03 00 27 00 01 34 01", "01 83 06 C1 32"},
                      Golden{"6.2.4 value", "01 06 00 26 00 08 69 C7", "01 86 07 03 A2"},
                      Golden{"6.2.5 current", "01 06 00 10 00 06 08 0D", "01 06 00 10 00 06 08 0D"},
                      Golden{"6.2.5 microstep", "01 06 00 11 00 08 D8 09", "01 06 00 11 00 08 D8 09"},
                      Golden{"6.2.5 block", "01 10 00 20 00 06 0C 00 0A 00 64 00 64 01 F4 00 00 03 E8 3D 69",
                             "01 10 00 20 00 06 41 C1"},
                      Golden{"6.2.5 speed mode", "01 10 00 20 00 04 08 00 0A 00 64 00 64 01 F4 AD C5",
                             "01 10 00 20 00 04 C0 00"},
                      Golden{"7.6.1 relative", "01 06 00 27 00 01 F8 01", "01 06 00 27 00 01 F8 01"},
                      Golden{"7.6.1 absolute", "01 06 00 27 00 05 F9 C2", "01 06 00 27 00 05 F9 C2"},
                      Golden{"7.6.1 speed", "01 06 00 27 00 02 B8 00", "01 06 00 27 00 02 B8 00"},
                      Golden{"7.6.2 normal", "01 06 00 28 00 00 09 C2", "01 06 00 28 00 00 09 C2"},
                      Golden{"7.6.2 emergency", "01 06 00 28 00 01 C8 02", "01 06 00 28 00 01 C8 02"},
                      Golden{"7.6.3", "01 06 00 30 00 01 48 05", "01 06 00 30 00 01 48 05"}));

TEST(SimulatorProtocol, AnswersTheBlockOfCurrentAndMicrostepAsPrinted) {
  Bench bench;
  EXPECT_EQ("01 10 00 10 00 02 40 0D", bench.send("01 10 00 10 00 02 04 00 06 00 08 13 64"));
}

TEST(SimulatorProtocol, TellsHolesFromAddressesBeyondTheLast) {
  Bench bench;
  EXPECT_EQ(3, bench.read(0x0019));
  EXPECT_EQ(3, bench.read(0x0018, 2)) << "a block must not cross a hole";
  EXPECT_EQ(4, bench.read(0x011A));
  EXPECT_EQ(4, bench.read(0x0119, 2));
  EXPECT_EQ(4, bench.write(0xFF00, 88));
  EXPECT_EQ(3, bench.write(0x0050, 1));
  EXPECT_EQ(0, bench.read(0x0000, 13));
  EXPECT_EQ(0, bench.read(0x0090, 16));
  EXPECT_EQ(5, bench.read(0x0090, 17));
  EXPECT_EQ(5, bench.read(0x0090, 0));
}

TEST(SimulatorProtocol, KeepsAttributesAndRanges) {
  Bench bench;
  EXPECT_EQ(6, bench.write(reg::moving, 1));
  EXPECT_EQ(6, bench.read(reg::stop));
  EXPECT_EQ(6, bench.read(reg::homing_start));
  EXPECT_EQ(7, bench.write(reg::microstep, 16));
  EXPECT_EQ(7, bench.write(reg::start_speed, 1));
  EXPECT_EQ(0, bench.write(reg::maximum_speed, -3000));
  EXPECT_EQ(7, bench.write(reg::maximum_speed, -3001));
  EXPECT_EQ(0, bench.write(reg::pulses_low, 0x86A0)) << "the manual's own example";
  EXPECT_EQ(7, bench.write(reg::segment_time, 0)) << "its default cannot be written back";
}

TEST(SimulatorProtocol, IgnoresOtherNodesBroadcastsAndFramesOfWrongSize) {
  Bench bench;
  for (Bytes frame : {Bytes{2, 3, 0, 0, 0, 1}, Bytes{0, 6, 0, 0x29, 0, 0}, Bytes{1, 3, 0, 0, 0, 1, 9},
                      Bytes{1, 16, 0, 0x20, 0, 2, 2, 0, 5}}) {
    simulation::append_frame_crc(frame);
    EXPECT_EQ(std::nullopt, bench.drive().on_frame(frame));
  }
  EXPECT_EQ(std::nullopt, bench.drive().on_frame(Bytes{1}));
}

TEST(SimulatorProtocol, WritesNoneOfABlockWithABadValueUnlessTheSwitchSaysSo) {
  Bench whole;
  EXPECT_EQ(7, whole.write_block(reg::start_speed, {7, 5000, 50}));
  EXPECT_EQ(5, whole.reg(reg::start_speed));
  Bench partial{with_switch("partial_block_write")};
  EXPECT_EQ(7, partial.write_block(reg::start_speed, {7, 5000, 50}));
  EXPECT_EQ(7, partial.reg(reg::start_speed));
  EXPECT_EQ(100, partial.reg(reg::deceleration_time));
  Bench skipping{with_switch("bad_register_skipped")};
  EXPECT_EQ(7, skipping.write_block(reg::start_speed, {7, 5000, 50}));
  EXPECT_EQ(7, skipping.reg(reg::start_speed));
  EXPECT_EQ(100, skipping.reg(reg::acceleration_time));
  EXPECT_EQ(50, skipping.reg(reg::deceleration_time));
}

TEST(SimulatorProtocol, LimitsBlockWritesOnlyBySwitch) {
  const std::vector<int> many(32, 1);
  Bench free;
  EXPECT_EQ(0, free.write_block(reg::segment_pulses_high, many));
  Bench limited{with_switch("limit_block_writes")};
  EXPECT_EQ(5, limited.write_block(reg::segment_pulses_high, many));
}

TEST(SimulatorProtocol, OtherReadingsOfTheErrorExamplesAreSwitches) {
  Bench crc{with_switch("crc_error_answered")};
  EXPECT_EQ("01 83 01 80 F0", crc.send("01 03 00 20 00 01 85 C1"));
  Bench function{with_switch("function_error_code_1")};
  EXPECT_EQ("01 82 01 81 60", function.send("01 02 00 00 00 04 79 C9"));
}

TEST(SimulatorProtocol, ReadsIdentity) {
  Bench bench;
  EXPECT_EQ(0x0301, bench.reg(reg::model));
  EXPECT_EQ(0x0100, bench.reg(reg::version));
  EXPECT_EQ(1, bench.reg(reg::node));
  EXPECT_EQ(0x0302, Bench{with_switch("model_code_0302")}.reg(reg::model));
}

TEST(SimulatorSwitches, AreDocumentedUniqueAndUnknownOnesRefused) {
  for (const auto* simulator : simulation::simulators()) {
    std::vector<std::string_view> names;
    for (const auto& one : simulator->switches) {
      EXPECT_FALSE(one.meaning.empty()) << one.name;
      names.push_back(one.name);
    }
    if (simulator->make != nullptr) EXPECT_GT(names.size(), 30U) << simulator->model;  // those of the family
    std::ranges::sort(names);
    EXPECT_EQ(names.end(), std::ranges::adjacent_find(names)) << simulator->model;
  }
  EXPECT_THROW(Bench{with_switch("no_such_switch")}, std::invalid_argument);
  EXPECT_THROW(Bench{with_switch("position_is_commanded")}, std::invalid_argument) << "it has no encoder";
}

/// As one frame shows it.
std::int32_t position_read(Bench& bench) {
  Bytes frame{1, 3, 0, 0x0A, 0, 2};
  simulation::append_frame_crc(frame);
  const auto reply = bench.drive().on_frame(frame);
  if (!reply || reply->size() != 9) throw std::runtime_error("no reply");
  std::uint32_t position = 0;
  for (std::size_t i = 3; i < 7; ++i) position = position << 8U | (*reply)[i];
  return static_cast<std::int32_t>(position);
}

TEST(Position, ItsWordsAreOfTwoMomentsWhereTheyCarryOnlyIfTheSwitchSaysSo) {
  for (const bool torn : {false, true}) {
    Bench bench(with_switch("position_words_torn", torn));
    EXPECT_EQ(0, position_read(bench));
    bench.move(-3);
    bench.wait(240ms);
    ASSERT_EQ(-3, bench.position());
    EXPECT_EQ(torn ? 0xFFFD : -3, position_read(bench));
    EXPECT_EQ(-3, position_read(bench)) << "once";
    bench.move(3);
    bench.wait(1s);
    EXPECT_EQ(0, position_read(bench)) << "that was long ago";
    bench.move(-3);
    bench.wait(240ms);
    bench.write(reg::position_clear, 1);
    EXPECT_EQ(0, position_read(bench)) << "no carry";
  }
}

}  // namespace
}  // namespace axisd::yako_rtu
