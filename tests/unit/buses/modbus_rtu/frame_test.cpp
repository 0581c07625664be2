#include "buses/modbus_rtu/frame.hpp"

#include <gtest/gtest.h>

#include <random>
#include <sstream>
#include <string>
#include <vector>

namespace axisd::modbus_rtu {
namespace {

using Bytes = std::vector<std::uint8_t>;

Bytes from_hex(const std::string& text) {
  Bytes bytes;
  std::istringstream stream(text);
  for (unsigned byte = 0; stream >> std::hex >> byte;) bytes.push_back(static_cast<std::uint8_t>(byte));
  return bytes;
}

Request read(std::uint16_t address, std::uint16_t count, std::uint8_t node = 1) {
  return {.node = node, .address = address, .count = count};
}
Request write(std::uint16_t address, std::uint16_t value, std::uint8_t node = 1) {
  return {.node = node, .function = Function::write_single_register, .address = address, .values = {value}};
}
Request write_many(std::uint16_t address, std::vector<std::uint16_t> values, std::uint8_t node = 1) {
  return {.node = node,
          .function = Function::write_multiple_registers,
          .address = address,
          .count = static_cast<std::uint16_t>(values.size()),
          .values = std::move(values)};
}

std::string encoded(const Request& request) {
  const auto frame = encode(request);
  return frame ? to_hex(frame->bytes()) : to_string(frame.error());
}

/// One printed dialogue of the YKD2405PR manual.
struct Golden {
  std::string section;
  Request request;
  std::string request_hex;
  std::string reply_hex;  ///< empty where the manual prints the request only
  std::vector<std::uint16_t> registers{};
};

const std::vector<Golden>& printed_dialogues() {
  static const std::vector<Golden> dialogues{
      {"4.3", write(0x0043, 1), "01 06 00 43 00 01 B9 DE", ""},
      {"4.3", write(0x0044, 2), "01 06 00 44 00 02 48 1E", ""},
      {"4.3", write(0x0045, 3), "01 06 00 45 00 03 D8 1E", ""},
      {"6.2.1",
       read(0x0020, 4),
       "01 03 00 20 00 04 45 C3",
       "01 03 08 00 05 00 64 00 64 00 3C F0 D1",
       {5, 100, 100, 60}},
      {"6.2.2", write(0x0021, 500), "01 06 00 21 01 F4 D9 D7", "01 06 00 21 01 F4 D9 D7"},
      {"6.2.3", write_many(0x0024, {0, 5000}), "01 10 00 24 00 02 04 00 00 13 88 FD 12",
       "01 10 00 24 00 02 01 C3"},
      {"6.2.5", write(0x0010, 6), "01 06 00 10 00 06 08 0D", "01 06 00 10 00 06 08 0D"},
      {"6.2.5", write(0x0011, 8), "01 06 00 11 00 08 D8 09", "01 06 00 11 00 08 D8 09"},
      {"6.2.5", write_many(0x0020, {10, 100, 100, 500, 0, 1000}),
       "01 10 00 20 00 06 0C 00 0A 00 64 00 64 01 F4 00 00 03 E8 3D 69", "01 10 00 20 00 06 41 C1"},
      {"6.2.5", write(0x0027, 1), "01 06 00 27 00 01 F8 01", "01 06 00 27 00 01 F8 01"},
      {"6.2.5", write_many(0x0010, {6, 8}), "01 10 00 10 00 02 04 00 06 00 08 13 64",
       "01 10 00 10 00 02 40 0D"},
      // The text says "backwards"; +500 is forwards (7.2).
      {"6.2.5", write_many(0x0020, {10, 100, 100, 500}), "01 10 00 20 00 04 08 00 0A 00 64 00 64 01 F4 AD C5",
       "01 10 00 20 00 04 C0 00"},
      {"6.2.5", write(0x0027, 2), "01 06 00 27 00 02 B8 00", "01 06 00 27 00 02 B8 00"},
      {"7.6.1", write(0x0027, 1), "01 06 00 27 00 01 F8 01", ""},
      {"7.6.1", write(0x0027, 5), "01 06 00 27 00 05 F9 C2", ""},
      {"7.6.1", write(0x0027, 2), "01 06 00 27 00 02 B8 00", ""},
      {"7.6.2", write(0x0028, 0), "01 06 00 28 00 00 09 C2", ""},
      {"7.6.2", write(0x0028, 1), "01 06 00 28 00 01 C8 02", ""},
      {"7.6.3", write(0x0030, 1), "01 06 00 30 00 01 48 05", ""},
  };
  return dialogues;
}

/// One printed refusal (manual 6.2.4).
struct Refusal {
  Request request;
  std::string request_hex;
  std::string printed_reply;
  std::string right_reply;  ///< differs from the print where that has a misprint
  std::uint8_t code;
};

const std::vector<Refusal>& printed_refusals() {
  static const std::vector<Refusal> refusals{
      // Printed as the answer to a wrong CRC, which the text says is met with silence. Both are understood.
      {read(0x0020, 1), "01 03 00 20 00 01 85 C0", "01 83 01 80 F0", "01 83 01 80 F0", 0x01},
      {read(0x0019, 1), "01 03 00 19 00 01 55 CD", "01 83 03 01 31", "01 83 03 01 31", 0x03},
      // Request printed with the low CRC byte 45, high D8: right. 32 registers at once are too many for the
      // drive.
      {read(0x0020, 32), "01 03 00 20 00 20 45 D8", "01 83 05 81 33", "01 83 05 81 33", 0x05},
      {read(0x0027, 1), "01 03 00 27 00 01 34 01", "01 83 06 C1 32", "01 83 06 C1 32", 0x06},
      {write(0x0026, 8), "01 06 00 26 00 08 69 C7", "01 86 07 03 A2", "01 86 07 03 A2", 0x07},
  };
  return refusals;
}

TEST(Golden, RequestsEncodeAsPrinted) {
  for (const auto& golden : printed_dialogues())
    EXPECT_EQ(encoded(golden.request), golden.request_hex) << golden.section;
}

TEST(Golden, RepliesMatchAsPrinted) {
  int replies = 0;
  for (const auto& golden : printed_dialogues()) {
    if (golden.reply_hex.empty()) continue;
    ++replies;
    const auto bytes = from_hex(golden.reply_hex);
    const auto reply = decode(golden.request, bytes);
    EXPECT_EQ(reply.kind, ReplyKind::match) << golden.section << ": " << golden.reply_hex;
    const Registers read{Frame(bytes)};
    EXPECT_TRUE(std::ranges::equal(read.values(), golden.registers)) << golden.section;
    EXPECT_EQ(reply_size(golden.request), bytes.size()) << golden.section;
  }
  EXPECT_EQ(replies, 10);
}

TEST(Golden, RefusalsAreExceptionsWithTheDrivesCode) {
  for (const auto& refusal : printed_refusals()) {
    EXPECT_EQ(encoded(refusal.request), refusal.request_hex);
    const auto reply = decode(refusal.request, from_hex(refusal.right_reply));
    EXPECT_EQ(reply.kind, ReplyKind::exception) << refusal.right_reply;
    EXPECT_EQ(reply.exception_code, refusal.code) << refusal.right_reply;
  }
}

/// Frames that the manual prints wrongly, beside what is meant.
TEST(Golden, MisprintsAreCorruptAndTheirCorrectionsSound) {
  struct Misprint {
    std::string printed, corrected;
  };
  const Misprint misprints[]{
      {"01 82 02 61 C1", "01 82 02 C1 61"},                    // 6.2.4 function error: CRC bytes swapped
      {"01 03 00 20 00 01 85 C1", "01 03 00 20 00 01 85 C0"},  // 6.2.4 CRC error: wrong on purpose
  };
  for (const auto& misprint : misprints) {
    EXPECT_NE(crc16(from_hex(misprint.printed)), 0) << misprint.printed;
    EXPECT_EQ(crc16(from_hex(misprint.corrected)), 0) << misprint.corrected;
  }
  // Function 02 is never sent; the refusal of it can still be read, with the code of the example (02, not
  // 01).
  // NOLINTNEXTLINE(clang-analyzer-optin.core.EnumCastOutOfRange): what encode() must refuse
  const Request unsupported{.node = 1, .function = static_cast<Function>(0x02), .count = 4};
  EXPECT_FALSE(encode(unsupported));
  EXPECT_EQ(crc16(from_hex("01 02 00 00 00 04 79 C9")), 0);
  EXPECT_EQ(decode(unsupported, from_hex(misprints[0].printed)).kind, ReplyKind::corrupt);
  const auto reply = decode(unsupported, from_hex(misprints[0].corrected));
  EXPECT_EQ(reply.kind, ReplyKind::exception);
  EXPECT_EQ(reply.exception_code, 0x02);
}

TEST(Encode, RefusesWhatMustNotGoOut) {
  EXPECT_FALSE(encode(read(0, 1, 0)));    // broadcast
  EXPECT_FALSE(encode(read(0, 1, 248)));  // reserved
  EXPECT_FALSE(encode(read(0, 0)));
  EXPECT_FALSE(encode(read(0, 126)));
  EXPECT_FALSE(encode(read(0xFFFF, 2)));
  EXPECT_FALSE(encode(write_many(0, {})));
  EXPECT_FALSE(encode(write_many(0, std::vector<std::uint16_t>(124))));
  EXPECT_FALSE(encode(write_many(0xFFFE, {1, 2, 3})));
  auto two = write(0, 1);
  two.values.push_back(2);
  EXPECT_FALSE(encode(two));
}

TEST(Encode, AcceptsTheLargest) {
  EXPECT_EQ(encode(write_many(0, std::vector<std::uint16_t>(123)))->size(), 255U);
  EXPECT_EQ(reply_size(read(0, 125)), 255U);
  EXPECT_TRUE(encode(read(0xFFFF, 1, 247)));
}

TEST(Encode, ErrorNamesNodeAndRegister) {
  const auto refused = encode(read(0x0020, 126, 3));
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().reason, Reason::invalid_argument);
  EXPECT_EQ(refused.error().where.node, 3);
  EXPECT_EQ(refused.error().where.object, 0x0020U);
  EXPECT_NE(refused.error().message.find("126"), std::string::npos);
}

Bytes with_crc(const std::string& hex) {
  Frame frame(from_hex(hex));
  frame.append_crc();
  return {frame.bytes().begin(), frame.bytes().end()};
}

TEST(Decode, SoundFramesThatAnswerSomethingElseAreForeign) {
  const std::pair<Request, std::string> cases[]{
      {read(0x0020, 2), "02 03 04 00 05 00 64"},        // another node
      {read(0x0020, 2), "01 03 02 00 05"},              // another count: a late reply
      {read(0x0020, 2), "01 03 04 00 05 00 64 00 00"},  // count and length disagree
      {read(0x0020, 2), "01 06 00 20 00 02"},           // another function
      {read(0x0020, 2), "01 86 03"},                    // exception to another function
      {read(0x0020, 2), "01 83 03 00"},                 // too long for an exception
      {read(0x0020, 2), "01 83"},                       // too short for one
      {write(0x0027, 1), "01 06 00 28 00 01"},          // another register
      {write(0x0027, 1), "01 06 00 27 00 02"},          // another value
      {write(0x0027, 1), "01 06 00 27 00 01 00"},       // echo and more
      {write_many(0x20, {1, 2}), "01 10 00 21 00 02"},  // another register
      {write_many(0x20, {1, 2}), "01 10 00 20 00 01"},  // fewer written
      {write_many(0x20, {1, 2}), "00 10 00 20 00 02"},  // the broadcast address answers nobody
  };
  for (const auto& [request, hex] : cases)
    EXPECT_EQ(decode(request, with_crc(hex)).kind, ReplyKind::foreign) << hex;
}

TEST(Decode, KeepsVendorExceptionCodes) {
  for (unsigned code = 0; code < 256; ++code) {
    Frame frame(from_hex("01 83"));
    frame.append(static_cast<std::uint8_t>(code));
    frame.append_crc();
    const auto reply = decode(read(0, 1), frame.bytes());
    EXPECT_EQ(reply.kind, ReplyKind::exception);
    EXPECT_EQ(reply.exception_code, code);
  }
}

TEST(Decode, NothingAndTooMuchIsCorrupt) {
  EXPECT_EQ(decode(read(0, 1), {}).kind, ReplyKind::corrupt);
  EXPECT_EQ(decode(read(0, 1), Bytes(300)).kind, ReplyKind::corrupt);
}

/// A request of random shape and the reply that a drive gives to it.
std::pair<Request, Bytes> random_exchange(std::mt19937& random) {
  const auto pick = [&random](int low, int high) { return std::uniform_int_distribution(low, high)(random); };
  const auto word = [&] { return static_cast<std::uint16_t>(pick(0, 0xFFFF)); };
  const auto node = static_cast<std::uint8_t>(pick(1, 247));
  const auto address = static_cast<std::uint16_t>(pick(0, 0xFF00));
  Request request = read(address, static_cast<std::uint16_t>(pick(1, 16)), node);
  Frame reply;
  reply.append(node);
  const int shape = pick(0, 2);
  if (shape == 0) {
    reply.append(0x03);
    reply.append(static_cast<std::uint8_t>(2 * request.count));
    for (int index = 0; index < request.count; ++index) reply.append_word(word());
  } else if (shape == 1) {
    request = write(address, word(), node);
    reply = Frame(encode(request)->bytes().first(6));
  } else {
    request =
        write_many(address, std::vector<std::uint16_t>(static_cast<std::size_t>(pick(1, 16)), word()), node);
    reply = Frame(encode(request)->bytes().first(6));
  }
  reply.append_crc();
  return {request, Bytes(reply.bytes().begin(), reply.bytes().end())};
}

TEST(DecodeProperty, NoDamagedByteAndNoTruncationEverMatches) {
  std::mt19937 random(2405);  // NOLINT(bugprone-random-generator-seed): the same cases in each run
  for (int round = 0; round < 200; ++round) {
    const auto [request, reply] = random_exchange(random);
    ASSERT_EQ(decode(request, reply).kind, ReplyKind::match) << to_hex(reply);
    for (std::size_t length = 0; length < reply.size(); ++length)
      ASSERT_NE(decode(request, std::span(reply).first(length)).kind, ReplyKind::match) << to_hex(reply);
    for (std::size_t index = 0; index < reply.size(); ++index) {
      for (unsigned flip = 1; flip < 256; ++flip) {
        auto damaged = reply;
        damaged[index] ^= static_cast<std::uint8_t>(flip);
        ASSERT_EQ(decode(request, damaged).kind, ReplyKind::corrupt) << to_hex(damaged);
      }
    }
  }
}

TEST(DecodeProperty, ReadsComeBackAsWritten) {
  std::mt19937 random(16);  // NOLINT(bugprone-random-generator-seed): the same cases in each run
  for (int round = 0; round < 200; ++round) {
    const auto [request, bytes] = random_exchange(random);
    const Registers read{Frame(bytes)};
    const auto registers = read.values();
    if (request.function != Function::read_holding_registers) {
      ASSERT_TRUE(registers.empty());
      continue;
    }
    ASSERT_EQ(registers.size(), request.count);
    for (std::size_t index = 0; index < request.count; ++index)
      ASSERT_EQ(registers[index], bytes[3 + 2 * index] * 256U + bytes[4 + 2 * index]);
  }
}

TEST(Frame, HexAndEquality) {
  EXPECT_EQ(to_hex({}), "");
  EXPECT_EQ(to_hex(Bytes{0x0A, 0xFF}), "0A FF");
  EXPECT_EQ(Frame(Bytes{1, 2}), Frame(Bytes{1, 2}));
  EXPECT_FALSE(Frame(Bytes{1, 2}) == Frame(Bytes{1, 2, 0}));
  EXPECT_THROW(Frame(Bytes(257)), std::out_of_range);
}

TEST(Crc, KnownValue) {
  const std::string digits = "123456789";
  EXPECT_EQ(crc16(Bytes(digits.begin(), digits.end())), 0x4B37);  // check value of CRC-16/MODBUS
}

}  // namespace
}  // namespace axisd::modbus_rtu
