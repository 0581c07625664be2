// SDO, NMT, heartbeat, PDO and EMCY of the simulated drive on the wire.
#include <gmock/gmock.h>

#include "tests/unit/devices/yss_c/simulator_fixture.hpp"

namespace axisd::yss_c {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

TEST(YssCSdo, ReadsAndWritesByType) {
  Bench bench;
  EXPECT_EQ("581 43 00 10 00 92 01 04 00", bench.ask("601 40 00 10 00 00 00 00 00"));
  EXPECT_EQ("581 4B 06 20 00 08 00 00 00", bench.ask("601 40 06 20 00 00 00 00 00"));
  EXPECT_EQ("581 4F 61 60 00 00 00 00 00", bench.ask("601 40 61 60 00 00 00 00 00"));
  EXPECT_EQ(0U, bench.write(0x60FF, 4, -3000));
  EXPECT_EQ(-3000, static_cast<std::int32_t>(bench.read(0x60FF)));
  EXPECT_EQ(1, bench.read(0x2000));
  EXPECT_EQ(0x100, bench.read(0x1018, 1));
}

TEST(YssCSdo, AbortsWhatIsWrong) {
  Bench bench;
  EXPECT_EQ(0x06020000U, bench.write(0x3000, 2, 0)) << "no such object";
  EXPECT_EQ(0x06090011U, bench.write(0x6099, 3, 4, 60)) << "no such sub-index";
  EXPECT_EQ(0x06010002U, bench.write(0x6041, 2, 0)) << "read-only";
  EXPECT_EQ(0x06070012U, bench.write(0x6098, 2, 17)) << "too long";
  EXPECT_EQ(0x06070013U, bench.write(0x6081, 2, 60)) << "too short, as the example of 6.2.4";
  EXPECT_EQ(0x06090030U, bench.write(0x607A, 4, 1'000'001)) << "range";
  EXPECT_EQ(0x06090030U, bench.write(0x6060, 1, 2)) << "no such mode";
  EXPECT_EQ("581 80 0F 20 00 01 00 01 06", bench.ask("601 40 0F 20 00 00 00 00 00")) << "write-only";
  EXPECT_EQ("581 80 00 10 00 01 00 04 05", bench.ask("601 A0 00 10 00 00 00 00 00")) << "block upload";
}

TEST(YssCSdo, TakesSegmentedDownloads) {
  Bench bench;
  EXPECT_EQ("581 60 7A 60 00 00 00 00 00", bench.ask("601 21 7A 60 00 04 00 00 00"));
  EXPECT_EQ("581 20 00 00 00 00 00 00 00", bench.ask("601 07 88 13 00 00 00 00 00"));
  EXPECT_EQ(5000, bench.read(0x607A));
  bench.ask("601 21 7A 60 00 04 00 00 00");
  EXPECT_EQ("581 80 7A 60 00 00 00 03 05", bench.ask("601 17 88 13 00 00 00 00 00")) << "toggle";
  EXPECT_EQ("581 80 7A 60 00 12 00 07 06", bench.ask("601 21 7A 60 00 05 00 00 00"));
  EXPECT_EQ("581 80 7A 60 00 01 00 04 05", bench.ask("601 07 88 13 00 00 00 00 00")) << "none was begun";
}

TEST(YssCSdo, GivesSegmentedUploadsInParts) {
  Bench bench({{"segmented_uploads", true}});
  EXPECT_EQ("581 41 00 10 00 04 00 00 00", bench.ask("601 40 00 10 00 00 00 00 00"));
  EXPECT_EQ("581 80 00 10 00 00 00 03 05", bench.ask("601 70 00 00 00 00 00 00 00")) << "toggle";
  bench.ask("601 40 00 10 00 00 00 00 00");
  EXPECT_EQ("581 07 92 01 04 00 00 00 00", bench.ask("601 60 00 00 00 00 00 00 00"));
}

TEST(YssCNmt, FollowsCommandsToItselfAndToAll) {
  Bench bench;
  EXPECT_EQ(0U, bench.write(0x1017, 2, 100));
  EXPECT_THAT(bench.run(100ms), ElementsAre("701 7F"));
  bench.put("000 01 00");
  EXPECT_THAT(bench.run(100ms), ElementsAre("701 05"));
  bench.put("000 02 01");
  EXPECT_THAT(bench.run(100ms), ElementsAre("701 04"));
  EXPECT_EQ("silence", bench.ask("601 40 00 10 00 00 00 00 00")) << "stopped: no SDO";
  bench.put("000 80 02");
  EXPECT_THAT(bench.run(100ms), ElementsAre("701 04")) << "another node's";
  bench.put("000 80 01");
  EXPECT_THAT(bench.run(100ms), ElementsAre("701 7F"));
}

TEST(YssCNmt, ResetsItselfOrItsCommunication) {
  Bench bench;
  bench.enable(3);
  bench.write(0x60FF, 4, 60);
  bench.run(1s);
  bench.write(0x1014, 4, 0x85);
  bench.put("000 82 01");
  EXPECT_THAT(bench.run(20ms), ElementsAre("701 00"));
  EXPECT_EQ(0x81, bench.read(0x1014));
  EXPECT_TRUE(bench.drive().shaft_moving()) << "the drive goes on";
  bench.put("000 81 00");
  EXPECT_FALSE(bench.drive().shaft_moving());
  EXPECT_THAT(bench.run(299ms), IsEmpty());
  EXPECT_THAT(bench.run(2ms), ElementsAre("701 00"));
  EXPECT_EQ(0, bench.read(0x60FF));
}

/// TPDO1 with the status word and the speed.
void map_status(Bench& bench, int type) {
  EXPECT_EQ(0U, bench.write(0x1800, 1, 4, 0x80000181));
  EXPECT_EQ(0U, bench.write(0x1800, 2, 1, type));
  EXPECT_EQ(0U, bench.write(0x1A00, 0, 1, 0));
  EXPECT_EQ(0U, bench.write(0x1A00, 1, 4, 0x60410010));
  EXPECT_EQ(0U, bench.write(0x1A00, 2, 4, 0x20020010));
  EXPECT_EQ(0U, bench.write(0x1A00, 0, 1, 2));
  EXPECT_EQ(0U, bench.write(0x1800, 1, 4, 0x181));
}

TEST(YssCPdo, ComesWithSyncByItsType) {
  Bench bench;
  map_status(bench, 2);
  bench.put("080");
  EXPECT_THAT(bench.run(1ms), IsEmpty()) << "pre-operational";
  bench.put("000 01 01");
  bench.put("080");
  EXPECT_THAT(bench.run(1ms), IsEmpty());
  bench.put("080");
  EXPECT_THAT(bench.run(1ms), ElementsAre("181 50 02 00 00"));
  EXPECT_EQ(0U, bench.write(0x1005, 4, 0x90));
  bench.put("080");
  bench.put("080");
  EXPECT_THAT(bench.run(1ms), IsEmpty()) << "SYNC is 90h now";
}

TEST(YssCPdo, OfType0ComesWithTheSyncAfterAChange) {
  Bench bench;
  map_status(bench, 0);
  bench.put("000 01 01");
  bench.put("080");
  EXPECT_EQ(1U, bench.run(1ms).size());
  bench.put("080");
  EXPECT_THAT(bench.run(1ms), IsEmpty());
  bench.control(6);
  bench.put("080");
  EXPECT_THAT(bench.run(1ms), ElementsAre("181 31 02 00 00"));
}

TEST(YssCPdo, ComesByEventWithInhibitTimeAndTimer) {
  Bench bench;
  map_status(bench, 255);
  bench.write(0x1800, 3, 2, 100);  // 10 ms
  bench.put("000 01 01");
  EXPECT_THAT(bench.run(2ms), ElementsAre("181 50 02 00 00"));
  EXPECT_THAT(bench.run(1s), IsEmpty()) << "nothing changes";
  bench.put("601 2B 40 60 00 06 00 00 00");
  EXPECT_THAT(bench.run(2ms), ElementsAre("181 31 02 00 00", "581 60 40 60 00 00 00 00 00"))
      << "nothing was sent for long: at once";
  bench.control(7);
  EXPECT_THAT(bench.run(5ms), IsEmpty()) << "inhibited";
  EXPECT_THAT(bench.run(5ms), ElementsAre("181 33 22 00 00"));
  bench.write(0x1800, 5, 2, 50);
  bench.run(5ms);
  EXPECT_EQ(4U, bench.run(200ms).size());
}

TEST(YssCPdo, ShowsAMotionAtMostOncePerCycle) {
  Bench bench;
  map_status(bench, 255);
  bench.enable(3);
  bench.put("000 01 01");
  bench.write(0x60FF, 4, 600);
  bench.run(10ms);
  const auto sent = bench.run(20ms);
  EXPECT_LE(sent.size(), 21U);
  EXPECT_GE(sent.size(), 19U);
}

TEST(YssCPdo, ControlWordByEventAndBySync) {
  Bench bench;
  bench.put("201 06 00");
  EXPECT_EQ(0, bench.read(0x6040)) << "pre-operational";
  bench.put("000 01 01");
  bench.put("201 06 00");
  EXPECT_EQ(0x21, bench.status() & 0x6F);
  bench.put("201 07");
  EXPECT_EQ(0x21, bench.status() & 0x6F) << "too short";
  EXPECT_EQ(0U, bench.write(0x1400, 2, 1, 1));
  bench.put("201 07 00");
  EXPECT_EQ(0x21, bench.status() & 0x6F);
  bench.put("080");
  EXPECT_EQ(0x23, bench.status() & 0x6F);
  bench.put("201 0F 00");
  bench.put("000 80 01");
  bench.put("000 01 01");
  bench.put("080");
  EXPECT_EQ(0x23, bench.status() & 0x6F) << "what waited for SYNC is gone with Operational";
}

TEST(YssCPdo, RefusesMappingsOutOfOrder) {
  Bench bench;
  EXPECT_EQ(0x08000022U, bench.write(0x1600, 1, 4, 0x60FF0020)) << "the number is not 0";
  EXPECT_EQ(0U, bench.write(0x1A00, 0, 1, 0));
  EXPECT_EQ(0x06020000U, bench.write(0x1A00, 1, 4, 0x30000010));
  EXPECT_EQ(0x06040041U, bench.write(0x1A00, 1, 4, 0x60990008)) << "not mappable";
  EXPECT_EQ(0x06040041U, bench.write(0x1A00, 1, 4, 0x60410020)) << "wrong length";
  EXPECT_EQ(0x06040041U, bench.write(0x1601, 1, 4, 0x60410010)) << "read-only in an RPDO";
  for (const std::uint8_t sub : {1, 2, 3}) EXPECT_EQ(0U, bench.write(0x1A00, sub, 4, 0x60640020));
  EXPECT_EQ(0x06040042U, bench.write(0x1A00, 0, 1, 3)) << "12 bytes";
  EXPECT_EQ(0x06090030U, bench.write(0x1A00, 0, 1, 5)) << "4 entries at most";
  EXPECT_EQ(0x06090030U, bench.write(0x1800, 1, 4, 0x1A0)) << "while it exists";
  EXPECT_EQ(0x06090030U, bench.write(0x1800, 2, 1, 252));
}

TEST(YssCPdo, TheNumberFollowsTheEntriesWhereItIsReadOnly) {
  Bench bench({{"pdo_parameters_read_only", true}});
  EXPECT_EQ(1, bench.read(0x1600));
  EXPECT_EQ(0x06010002U, bench.write(0x1A00, 0, 1, 0));
  EXPECT_EQ(0U, bench.write(0x1A00, 1, 4, 0x60640020));
  EXPECT_EQ(0U, bench.write(0x1A00, 2, 4, 0x20020010));
  EXPECT_EQ(2, bench.read(0x1A00));
  EXPECT_EQ(0x06040042U, bench.write(0x1A00, 3, 4, 0x607A0020));
  bench.put("000 01 01");
  EXPECT_THAT(bench.run(2ms), ElementsAre("181 00 00 00 00 00 00"));
  EXPECT_EQ(0U, bench.write(0x1A00, 1, 4, 0));
  EXPECT_EQ(0, bench.read(0x1A00));
}

TEST(YssCEmergency, IsSentRememberedAndTakenBack) {
  Bench bench;
  bench.drive().raise_alarm(4);
  EXPECT_THAT(bench.run(1ms), ElementsAre("081 04 FF 81 00 00 00 00 00"));
  EXPECT_EQ(0x81, bench.read(0x1001));
  bench.control(0x80);
  EXPECT_EQ(0, bench.read(0x1001));
  bench.drive().raise_alarm(2);
  bench.run(1ms);
  EXPECT_EQ(0xFF02, bench.read(0x1003, 1));
  EXPECT_EQ(0xFF04, bench.read(0x1003, 2));
  bench.drive().raise_alarm(0);
  EXPECT_THAT(bench.run(1ms), ElementsAre("081 00 00 00 00 00 00 00 00"));
  EXPECT_EQ(0U, bench.write(0x1014, 4, 0x80000081));
  bench.drive().raise_alarm(4);
  EXPECT_THAT(bench.run(1ms), IsEmpty()) << "switched off";
}

}  // namespace
}  // namespace axisd::yss_c
