#include "daemon/store/state_text.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <limits>
#include <random>

namespace axisd::store {
namespace {

using testing::HasSubstr;

Generation example() {
  Generation generation{.number = 41, .state = {.start_count = 7, .inhibit = {}, .axes = {}}};
  generation.state.inhibit = {.active = true,
                              .by = "tls:CN=hmi 1, panel\n\"left\" 100%",
                              .since = WallTime(std::chrono::nanoseconds(1'700'000'000'123'456'789))};
  generation.state.axes["feeder"] = {
      .offset = OffsetRecord{.offset_pulses = -123456789012345,
                             .trust = PositionTrust::homed,
                             .canary = {5, 100, 100, 300, 0, 0xFFFF},
                             .last_position_pulses = 42,
                             .pulses_per_revolution = 10000,
                             .invert = true},
      .eeprom_writes = 3,
      .holds = {{{.holder = "tls:hmi 1", .request_id = "r-7"},
                 WallTime(std::chrono::nanoseconds(1'700'000'001'000'000'002))},
                {{.holder = "panel", .request_id = {}}, WallTime{}}}};
  generation.state.axes["turn-table_2"] = {.offset = {}, .eeprom_writes = 0, .holds = {}};
  return generation;
}

/// As it is since the journal vouches for it.
Generation paired() {
  auto generation = example();
  generation.journal = {.pair = "5fd30001", .line = 1234};
  generation.state.convictions = {{.file = KeptFile::previous,
                                   .fault = KeptFault::foreign,
                                   .found = 3,
                                   .expected = 40,
                                   .detail = "of another set",
                                   .since = WallTime(std::chrono::nanoseconds(1'700'000'000'000'000'001))},
                                  {}};
  return generation;
}

TEST(StateText, ReadsBackWhatItWrites) {
  EXPECT_EQ(decode(encode(example())), example());
  EXPECT_EQ(decode(encode({})), Generation{});
  EXPECT_EQ(decode(encode(paired())), paired());
}

TEST(StateText, FormatIsFixed) {
  // An installed file must stay readable: whoever changes this needs a new version line and a migration.
  EXPECT_EQ(
      encode(example()),
      "axisd-state 1\n"
      "generation 41\n"
      "start_count 7\n"
      "inhibit active=1 since_ns=1700000000123456789 by=tls:CN%3dhmi%201%2c%20panel%0a%22left%22%20100%25\n"
      "axis feeder eeprom_writes=3\n"
      "offset pulses=-123456789012345 trust=homed last=42 per_rev=10000 invert=1 "
      "canary=0005.0064.0064.012c.0000.ffff\n"
      "hold since_ns=0 request= by=panel\n"
      "hold since_ns=1700000001000000002 request=r-7 by=tls:hmi%201\n"
      "axis turn-table_2 eeprom_writes=0\n"
      "crc32 " +
          encode(example()).substr(encode(example()).size() - 9));
}

TEST(StateText, TheFormatOfTodayIsFixed) {
  EXPECT_THAT(encode(paired()),
              HasSubstr("axisd-state 2\n"
                        "generation 41\n"
                        "pair 5fd30001 journal_line=1234\n"
                        "start_count 7\n"
                        "inhibit active=1 since_ns=1700000000123456789 "
                        "by=tls:CN%3dhmi%201%2c%20panel%0a%22left%22%20100%25\n"
                        "convicted file=previous fault=foreign found=3 expected=40 "
                        "since_ns=1700000000000000001 detail=of%20another%20set\n"
                        "convicted file=state fault=missing found=0 expected=0 since_ns=0 detail=\n"
                        "axis feeder eeprom_writes=3\n"));
}

Generation with_saves() {
  auto generation = paired();
  generation.state.axes["feeder"].eeprom = {.saves = 12, .by_hour = {{-3, 1}, {472'222, 9}}};
  generation.state.axes["idle"].eeprom = {.saves = 7};
  return generation;
}

TEST(StateText, SavesOfTheDayStandWithTheirAxis) {
  const auto text = encode(with_saves());
  EXPECT_THAT(text, HasSubstr("axis feeder eeprom_writes=3\neeprom saves=12 by_hour=-3:1,472222:9\noffset "));
  EXPECT_THAT(text, HasSubstr("axis idle eeprom_writes=0\neeprom saves=7 by_hour=\naxis "));
  EXPECT_EQ(decode(text), with_saves());
}

TEST(StateText, ReadsWhatWasWrittenBeforeThereWereHolds) {
  const std::string body =
      "axisd-state 1\ngeneration 3\nstart_count 2\ninhibit active=0 since_ns=0 by=\naxis feeder "
      "eeprom_writes=3\n";
  const auto read = decode(body + fmt::format("crc32 {:08x}\n", crc32(body)));
  ASSERT_TRUE(read);
  EXPECT_TRUE(read->state.axes.at("feeder").holds.empty());
}

TEST(StateText, ChecksumIsIeee802) { EXPECT_EQ(crc32("123456789"), 0xCBF43926U); }

TEST(StateText, KeepsExtremes) {
  using Limits = std::numeric_limits<std::int64_t>;
  for (const auto trust :
       {PositionTrust::unknown, PositionTrust::set, PositionTrust::homed, PositionTrust::restored}) {
    Generation generation;
    generation.number = generation.state.start_count = std::numeric_limits<std::uint64_t>::max();
    generation.state.axes["a"].offset = OffsetRecord{.offset_pulses = Limits::min(),
                                                     .trust = trust,
                                                     .canary = {},
                                                     .last_position_pulses = Limits::max(),
                                                     .pulses_per_revolution = -1,
                                                     .invert = false};
    EXPECT_EQ(decode(encode(generation)), generation);
  }
}

TEST(StateText, EveryByteSurvivesInAName) {
  Generation generation;
  for (int byte = 0; byte < 256; ++byte) generation.state.inhibit.by += static_cast<char>(byte);
  EXPECT_EQ(decode(encode(generation)), generation);
}

TEST(StateText, NoTruncationIsAccepted) {
  const auto text = encode(with_saves());
  for (std::size_t length = 0; length < text.size(); ++length) {
    const auto decoded = decode(text.substr(0, length));
    ASSERT_FALSE(decoded) << length;
    EXPECT_EQ(decoded.error().reason, Reason::storage);
    EXPECT_FALSE(newer_format(text.substr(0, length))) << length;
  }
}

TEST(StateText, NoFlippedBitIsAccepted) {
  const auto text = encode(with_saves());
  for (std::size_t bit = 0; bit < text.size() * 8; ++bit) {
    auto flipped = text;
    flipped[bit / 8] = static_cast<char>(flipped[bit / 8] ^ (1 << (bit % 8)));
    ASSERT_FALSE(decode(flipped)) << bit;
    ASSERT_FALSE(newer_format(flipped)) << bit;
  }
}

TEST(StateText, NoMixtureOfTwoGenerationsIsAccepted) {
  // What a torn overwrite would leave: the front of one and the back of the other.
  auto later = example();
  later.state.axes["feeder"].offset->offset_pulses += 111;
  const auto old_text = encode(example());
  const auto new_text = encode(later);
  ASSERT_EQ(old_text.size(), new_text.size());
  for (std::size_t cut = 0; cut <= old_text.size(); ++cut) {
    const auto mixture = new_text.substr(0, cut) + old_text.substr(cut);
    if (mixture != old_text && mixture != new_text) {
      ASSERT_FALSE(decode(mixture)) << cut;
    }
  }
}

std::string with_checksum(std::string body) { return body + fmt::format("crc32 {:08x}\n", crc32(body)); }

std::string replaced(std::string text, std::string_view what, std::string_view by) {
  text.replace(text.find(what), what.size(), by);
  return with_checksum(text.substr(0, text.size() - 15));
}

TEST(StateText, AcceptsOnlyTheCanonicalForm) {
  const auto text = encode(example());
  ASSERT_TRUE(decode(replaced(text, "start_count 7", "start_count 8")));
  for (const auto& [what, by] : std::initializer_list<std::pair<const char*, const char*>>{
           {"start_count 7", "start_count 07"},
           {"start_count 7", "start_count -7"},
           {"start_count 7", "start_count 18446744073709551616"},
           {"start_count 7", "start_count 7 "},
           {"start_count 7", "start_count "},
           {"active=1", "active=2"},
           {"trust=homed", "trust=trusted"},
           {"%0a", "%0A"},
           {"%0a", "%61"},
           {"%0a", "%zz"},
           {"ffff", "fffff"},
           {"0005", "5"},
           {"request=r-7", "request=r 7"},
           {"request= by=panel", "request=r-7 by=tls:hmi%201"},
           {"by=panel", "by=zzz"},
           {"hold since_ns=0", "hold since_ns="},
           {"hold since_ns=0", "holds since_ns=0"},
           {"turn-table_2", "feeder"},
           {"turn-table_2", "aaa"},
           {"turn-table_2 eeprom_writes=0\n", "turn-table_2 eeprom_writes=0\nmore\n"},
           {"axisd-state 1", "axisd-state 2"},
           {"axisd-state 1", "axisd-state 3"},
           {"\n", "\r\n"}}) {
    const auto changed = replaced(text, what, by);
    ASSERT_FALSE(decode(changed)) << by;
    EXPECT_THAT(decode(changed).error().message, HasSubstr("intact")) << by;
  }
}

TEST(StateText, AcceptsOnlyTheCanonicalFormOfSaves) {
  const auto text = encode(with_saves());
  ASSERT_TRUE(decode(replaced(text, "saves=12", "saves=13")));
  for (const auto& [what, by] : std::initializer_list<std::pair<const char*, const char*>>{
           {"axisd-state 2", "axisd-state 1"},
           {"saves=12", "saves="},
           {"saves=12", "saves=-1"},
           {"saves=12", "saves=012"},
           {"by_hour=-3:1,472222:9", "by_hour=472222:9,-3:1"},
           {"by_hour=-3:1,472222:9", "by_hour=-3:1,-3:9"},
           {"by_hour=-3:1,", "by_hour=-3:1,,"},
           {"by_hour=-3:1,472222:9", "by_hour=-3:1,472222"},
           {"by_hour=-3:1,472222:9", "by_hour=-3:1,472222:9,"},
           {"by_hour=-3:1", "by_hour=,-3:1"},
           {"eeprom saves=7 by_hour=\n", "eeprom saves=0 by_hour=\n"},
           {"eeprom saves=7 by_hour=\n", "eeprom saves=7\n"}}) {
    EXPECT_FALSE(decode(replaced(text, what, by))) << by;
  }
}

TEST(StateText, TellsANewerFormatFromDamage) {
  EXPECT_TRUE(newer_format(with_checksum("axisd-state 3\nwhatever\n")));
  EXPECT_FALSE(newer_format(encode(example())));
  EXPECT_FALSE(newer_format(encode(paired())));
  EXPECT_FALSE(newer_format(with_checksum("something else\n")));
}

TEST(StateText, NoiseIsRejected) {
  std::mt19937 random(20240607);
  for (int round = 0; round < 2000; ++round) {
    std::string noise(random() % 300, '\0');
    for (auto& c : noise) c = static_cast<char>(random());
    ASSERT_FALSE(decode(noise));
    ASSERT_FALSE(decode(with_checksum(noise)));
    ASSERT_FALSE(decode(with_checksum("axisd-state 1\n" + noise)));
    ASSERT_FALSE(decode(with_checksum("axisd-state 2\n" + noise)));
  }
}

}  // namespace
}  // namespace axisd::store
