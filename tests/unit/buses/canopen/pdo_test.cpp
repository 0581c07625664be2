#include "buses/canopen/pdo.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "buses/canopen/pdo_configuration.hpp"
#include "network.hpp"

namespace axisd::canopen {
namespace {

using namespace test;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using Kind = PdoOutcome::Kind;

constexpr MappedObject status_word{{0x6041, 0}, 16}, position{{0x6064, 0}, 32}, speed{{0x2002, 0}, 16};

/// TPDO 1 of the YSS-C as chapter 7 has it at power-up, COB-ID and count written as the standard wants.
FakeServer drive() {
  FakeServer server;
  server.objects = {{{0x1800, 0}, {5, 1}}, {{0x1800, 1}, {0x181, 4}}, {{0x1800, 2}, {0xFF, 1}},
                    {{0x1800, 3}, {0, 2}}, {{0x1800, 4}, {0, 1}},     {{0x1800, 5}, {0, 2}},
                    {{0x1A00, 0}, {0, 1}}, {{0x1A00, 1}, {0, 4}},     {{0x1A00, 2}, {0, 4}},
                    {{0x1A00, 3}, {0, 4}}, {{0x1A00, 4}, {0, 4}}};
  return server;
}

PdoSettings state_pdo() {
  return {.number = 1,
          .cob_id = 0x181,
          .transmission_type = 1,
          .inhibit_time = 50,
          .event_timer = 0,
          .mapping = {status_word, position, speed}};
}

TEST(Pdo, Mapping) {
  EXPECT_EQ(status_word.raw(), 0x60410010U);
  EXPECT_EQ(MappedObject::of(0x60640020), position);
  EXPECT_TRUE(check_mapping({status_word, position, speed}));
  EXPECT_FALSE(check_mapping({position, position, speed}));
  EXPECT_FALSE(check_mapping({{{0x6041, 0}, 0}}));
}

TEST(Pdo, PacksAndUnpacksLowestBitFirst) {
  const PdoMapping mapping{status_word, position, speed};
  const std::vector<std::uint64_t> values{0x0237, static_cast<std::uint32_t>(-5000), 60};
  const auto bytes = pack_pdo(mapping, values);
  EXPECT_THAT(bytes, ElementsAre(0x37, 0x02, 0x78, 0xEC, 0xFF, 0xFF, 0x3C, 0x00));
  const auto unpacked = unpack_pdo(mapping, bytes);
  EXPECT_EQ(*unpacked, values);
  EXPECT_EQ(sign_extended(unpacked->at(1), 32), -5000);
  EXPECT_EQ(unpack_pdo(mapping, std::span(bytes).first(7)).error().reason, Reason::misconfigured);
  EXPECT_EQ(unpack_pdo({status_word}, bytes)->at(0), 0x0237U);

  const PdoMapping bits{{{0x2000, 1}, 1}, {{0x2000, 2}, 3}, {{0x2000, 3}, 5}};
  EXPECT_THAT(pack_pdo(bits, std::vector<std::uint64_t>{0xFF, 0x2, 0x11}), ElementsAre(0x15, 0x01));
  EXPECT_THAT(*unpack_pdo(bits, Bytes{0x15, 0x01}), ElementsAre(1, 2, 0x11));
  const PdoMapping whole{{{0x2000, 1}, 64}};
  EXPECT_EQ(unpack_pdo(whole, pack_pdo(whole, std::vector<std::uint64_t>{~0ULL}))->at(0), ~0ULL);
}

TEST(PdoConfiguration, FollowsTheProcedureAndWritesNothingTheSecondTime) {
  Network net;
  net.servers[1] = drive();
  auto outcome = net.run(configure_pdo(net.master->node(1), state_pdo()));
  EXPECT_EQ(outcome.kind, Kind::changed) << (outcome.error ? to_string(*outcome.error) : "");
  EXPECT_THAT(net.servers[1].writes,
              ElementsAre("1800h:01=80000181", "1A00h:00=0", "1A00h:01=60410010", "1A00h:02=60640020",
                          "1A00h:03=20020010", "1A00h:00=3", "1800h:02=1", "1800h:03=32", "1800h:01=181"));
  EXPECT_EQ(outcome.written.size(), 9U);
  EXPECT_TRUE(outcome.carries(state_pdo().mapping));
  outcome = net.run(configure_pdo(net.master->node(1), state_pdo()));
  EXPECT_EQ(outcome.kind, Kind::as_found);
  EXPECT_TRUE(outcome.written.empty());
  EXPECT_EQ(net.servers[1].writes.size(), 9U);
}

TEST(PdoConfiguration, WritesOnlyDifferences) {
  Network net;
  net.servers[1] = drive();
  net.run(configure_pdo(net.master->node(1), state_pdo()));
  net.servers[1].writes.clear();
  auto wanted = state_pdo();
  wanted.cob_id = 0x191;
  wanted.mapping[2] = {{0x603F, 0}, 16};
  EXPECT_EQ(net.run(configure_pdo(net.master->node(1), wanted)).kind, Kind::changed);
  EXPECT_THAT(net.servers[1].writes, ElementsAre("1800h:01=80000181", "1A00h:00=0", "1A00h:03=603F0010",
                                                 "1A00h:00=3", "1800h:01=191"));
  net.servers[1].writes.clear();
  EXPECT_EQ(net.run(configure_pdo(net.master->node(1), {.number = 1, .enabled = false})).kind, Kind::changed);
  EXPECT_THAT(net.servers[1].writes, ElementsAre("1800h:01=80000191"));
}

TEST(PdoConfiguration, TakesReadOnlyIdentifiersAndCountsAsTheyAre) {
  Network net;
  auto& server = net.servers[1] = drive();
  server.objects[{0x1800, 1}].writable = false;
  server.objects[{0x1A00, 0}] = {3, 1, false};  // as if the count followed the entries
  auto outcome = net.run(configure_pdo(net.master->node(1), state_pdo()));
  EXPECT_EQ(outcome.kind, Kind::changed);
  EXPECT_THAT(outcome.read_only, ElementsAre(Object{0x1800, 1}, Object{0x1A00, 0}));

  auto other = state_pdo();
  other.cob_id = 0x199;
  outcome = net.run(configure_pdo(net.master->node(1), other));
  EXPECT_EQ(outcome.kind, Kind::deviates);
  EXPECT_TRUE(outcome.carries(other.mapping));
  EXPECT_EQ(outcome.state.cob_id(), 0x181U);
  EXPECT_THAT(outcome.remarks, ElementsAre("COB-ID 181h instead of 199h"));

  server.objects[{0x1A00, 0}].value = 0;  // a count that does not follow
  outcome = net.run(configure_pdo(net.master->node(1), state_pdo()));
  EXPECT_EQ(outcome.kind, Kind::deviates);
  EXPECT_FALSE(outcome.carries(state_pdo().mapping));
  EXPECT_THAT(outcome.remarks.at(0), HasSubstr("maps nothing instead of 60410010h"));
}

TEST(PdoConfiguration, AnObjectThatCannotBeMappedLeavesThePdoOff) {
  Network net;
  net.servers[1] = drive();
  net.servers[1].refusals[{0x1A00, 2}] = 0x06040041;
  const auto outcome = net.run(configure_pdo(net.master->node(1), state_pdo()));
  EXPECT_EQ(outcome.kind, Kind::failed);
  EXPECT_EQ(outcome.error->where.native_code, 0x06040041U);
  EXPECT_FALSE(outcome.state.enabled());
  EXPECT_FALSE(outcome.carries(state_pdo().mapping));
}

TEST(PdoConfiguration, SaysWhatTheNodeLacks) {
  Network net;
  net.servers[1] = drive();
  net.servers[1].objects.erase({0x1800, 3});
  net.servers[1].objects.erase({0x1800, 5});
  const auto outcome = net.run(configure_pdo(net.master->node(1), state_pdo()));
  EXPECT_EQ(outcome.kind, Kind::deviates);
  EXPECT_THAT(outcome.remarks, ElementsAre("has no inhibit time"));  // no event timer is what was wanted
}

TEST(PdoConfiguration, StopsTryingWhenTheNodeIsLost) {
  Network net;
  net.servers[1] = drive();
  net.servers[1].answers = false;
  auto second = state_pdo();
  second.number = 2;
  const auto outcomes = net.run(configure_pdos(net.master->node(1), {state_pdo(), second}));
  ASSERT_EQ(outcomes.size(), 2U);
  for (const auto& outcome : outcomes) {
    EXPECT_EQ(outcome.kind, Kind::failed);
    EXPECT_EQ(outcome.error->reason, Reason::no_reply);
  }
  EXPECT_THAT(net.port->log, testing::Each(testing::Not(HasSubstr("0118"))));  // 1801h was not asked for
}

TEST(PdoConfiguration, ChecksWhatIsWanted) {
  Network net;
  auto wanted = state_pdo();
  wanted.number = 0;
  EXPECT_EQ(net.run(configure_pdo(net.master->node(1), wanted)).error->reason, Reason::invalid_argument);
  wanted = state_pdo();
  wanted.cob_id = 0x800;
  EXPECT_EQ(net.run(configure_pdo(net.master->node(1), wanted)).error->reason, Reason::invalid_argument);
  wanted = state_pdo();
  wanted.mapping.assign(3, position);
  EXPECT_EQ(net.run(configure_pdo(net.master->node(1), wanted)).error->reason, Reason::invalid_argument);
  EXPECT_THAT(net.port->log, IsEmpty());
}

}  // namespace
}  // namespace axisd::canopen
