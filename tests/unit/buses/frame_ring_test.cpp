#include "buses/frame_ring.hpp"

#include <gtest/gtest.h>

#include <random>
#include <string>
#include <vector>

namespace axisd {
namespace {

using namespace std::chrono_literals;
using Bytes = std::vector<std::uint8_t>;

TracedFrame request(const Bytes& bytes, int at) {
  return {.at = TimePoint(Duration(at)),
          .transaction_class = TransactionClass::motion,
          .node = 3,
          .bytes = bytes};
}

TEST(FrameRing, GivesBackWhatWasPut) {
  FrameRing ring(4096);
  const Bytes bytes = {0x01, 0x06, 0x00, 0x27};
  ring.push(request(bytes, 7));
  auto frame = request({}, 9);
  frame.kind = TracedFrame::Kind::failed;
  frame.why = "timeout";
  ring.push(frame);
  can::Frame can{.id = 0x18FF0102, .extended = true, .rtr = true, .size = 8};
  TracedFrame remote{.kind = TracedFrame::Kind::received};
  remote.set(can);
  ring.push(remote);

  auto place = ring.begin();
  FrameRing::Read read;
  ASSERT_TRUE(ring.read(place, read));
  EXPECT_EQ(read.sequence, 1U);
  EXPECT_EQ(read.frame.at, TimePoint(Duration(7)));
  EXPECT_EQ(read.frame.kind, TracedFrame::Kind::sent);
  EXPECT_EQ(read.frame.transaction_class, TransactionClass::motion);
  EXPECT_EQ(read.frame.node, 3);
  EXPECT_EQ(Bytes(read.frame.bytes.begin(), read.frame.bytes.end()), bytes);
  ASSERT_TRUE(ring.read(place, read));
  EXPECT_EQ(read.frame.why, "timeout");
  EXPECT_TRUE(read.frame.bytes.empty());
  ASSERT_TRUE(ring.read(place, read));
  EXPECT_EQ(read.frame.frame(), can);
  EXPECT_FALSE(ring.read(place, read));
}

TEST(FrameRing, KeepsTheNewestAndTellsASlowReaderHowManyItLost) {
  FrameRing ring(1000);
  auto place = ring.begin();
  const Bytes bytes(8, 0x55);
  for (int i = 1; i <= 100; ++i) ring.push(request(bytes, i));
  EXPECT_EQ(ring.size(), 25U);  // 40 bytes each
  FrameRing::Read read;
  ASSERT_TRUE(ring.read(place, read));
  EXPECT_EQ(read.lost, 75U);
  EXPECT_EQ(read.sequence, 76U);
  EXPECT_EQ(read.frame.at, TimePoint(Duration(76)));
  ASSERT_TRUE(ring.read(place, read));
  EXPECT_EQ(read.lost, 0U);
  EXPECT_EQ(read.sequence, 77U);
}

TEST(FrameRing, ReaderAtItsEndSeesWhatComes) {
  FrameRing ring(1000);
  ring.push(request({1}, 1));
  auto place = ring.end();
  FrameRing::Read read;
  EXPECT_FALSE(ring.read(place, read));
  ring.push(request({2}, 2));
  ASSERT_TRUE(ring.read(place, read));
  EXPECT_EQ(read.sequence, 2U);
}

TEST(FrameRing, TakesTheLongestFrameInTheLeastMemory) {
  FrameRing ring(0);
  const Bytes longest(256, 0xAA);
  for (int i = 0; i < 5; ++i) ring.push(request(longest, i));
  EXPECT_EQ(ring.size(), 1U);
  auto place = ring.begin();
  FrameRing::Read read;
  ASSERT_TRUE(ring.read(place, read));
  EXPECT_EQ(Bytes(read.frame.bytes.begin(), read.frame.bytes.end()), longest);
}

TEST(FrameRing, AgreesWithAListOverRandomFrames) {
  std::mt19937 random(5);
  FrameRing ring(3001);
  std::vector<Bytes> all;
  auto place = ring.begin();
  std::uint64_t seen = 0;
  for (int round = 0; round < 3000; ++round) {
    Bytes bytes(random() % 257);
    for (auto& byte : bytes) byte = static_cast<std::uint8_t>(random());
    ring.push(request(bytes, round));
    all.push_back(std::move(bytes));
    if (random() % 4 != 0) continue;
    FrameRing::Read read;
    while (ring.read(place, read)) {
      seen += read.lost + 1;
      ASSERT_EQ(read.sequence, seen);
      ASSERT_EQ(Bytes(read.frame.bytes.begin(), read.frame.bytes.end()), all.at(seen - 1));
    }
    ASSERT_EQ(seen, all.size());
  }
}

}  // namespace
}  // namespace axisd
