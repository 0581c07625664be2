// Statistics, traces and flight records of a machine.
#include <algorithm>
#include <sstream>

#include "bus_access_rig.hpp"
#include "daemon/core/bus_watch_service.hpp"

namespace axisd::core {
namespace {

using namespace std::chrono_literals;

class BusWatchTest : public test::BusAccessRig {
 protected:
  struct Traced {
    std::vector<KeptFrame> frames;
    std::uint64_t lost = 0;
    int batches = 0;
    std::optional<Error> error;
  };
  std::shared_ptr<StreamToken> trace(TraceRequest request, Traced& to, bool quick = true) {
    auto token = std::make_shared<std::weak_ptr<StreamToken>>();
    auto made = watch_.trace(std::move(request), [&to, token, quick](Result<TraceBatch> batch) {
      ++to.batches;
      if (!batch) {
        to.error = batch.error();
        return;
      }
      to.lost += batch->lost;
      std::ranges::move(batch->frames, std::back_inserter(to.frames));
      if (const auto held = token->lock(); held && quick) held->wanted = true;
    });
    *token = made;
    return made;
  }
  BusStatistics statistics() {
    std::optional<Result<std::vector<BusStatistics>>> got;
    watch_.statistics("line-a", [&](auto result) { got = std::move(result); });
    EXPECT_TRUE(world_.run_until([&] { return got.has_value(); }, 1s));
    return got->value().at(0);
  }
  [[nodiscard]] std::vector<Event> records_told() const {
    std::vector<Event> told;
    for (auto& event : machine_->events().events_after(0, 10'000).events)
      if (std::holds_alternative<FlightRecordWritten>(event.content)) told.push_back(event);
    return told;
  }
  void enable() {
    submit("a1", EnableRequest{});
    ASSERT_EQ(machine_->find("a1")->snapshot()->state, AxisState::standstill);
  }

  BusWatchService watch_{world_.executor(), world_.clock(), *machine_};
};

TEST_F(BusWatchTest, StatisticsNameTheNodesAndAgreeWithTheWire) {
  start();
  const auto before = statistics();
  line_->forget_wire();
  world_.run_for(5s);
  const auto after = statistics();
  const auto of = [](const BusStatistics& all, std::uint8_t node) {
    return all.line->nodes().at(node).replies;
  };
  for (const std::uint8_t node : {1, 2, 9}) {
    const auto on_wire = static_cast<std::uint64_t>(
        std::ranges::count(line_->wire(), node, [](const auto& entry) { return entry.node(); }));
    EXPECT_NEAR(static_cast<double>(of(after, node) - of(before, node)), static_cast<double>(on_wire), 1)
        << int{node};
  }
  EXPECT_EQ(after.known.at(1).name, "a1");
  EXPECT_EQ(after.known.at(9).name, "io");
  EXPECT_GT(after.recent_load, 0);
  EXPECT_LT(after.recent_load, 0.5);
  std::optional<Result<std::vector<BusStatistics>>> unknown;
  watch_.statistics("line-x", [&](auto result) { unknown = std::move(result); });
  ASSERT_TRUE(world_.run_until([&] { return unknown.has_value(); }, 1s));
  EXPECT_EQ(unknown->error().reason, Reason::invalid_argument);
}

TEST_F(BusWatchTest, StatisticsTellSinceWhenANodeIsInQuarantine) {
  start();
  EXPECT_FALSE(statistics().quarantine.contains(2));
  drives_.at(1)->set_power(false);
  world_.run_for(20s);
  const auto silent = statistics();
  const auto& there = silent.quarantine.at(2);
  EXPECT_TRUE(there.active);
  EXPECT_GT(there.lasting, 15s);
  EXPECT_LE(there.lasting, 20s);
  EXPECT_GT(there.probes, 1U);
  EXPECT_EQ(there.times, 1U);
  EXPECT_FALSE(silent.quarantine.contains(1));
  // Every probe is a request without a reply; those before it was put there are no probes.
  const auto timeouts = silent.line->nodes().at(2).timeouts;
  EXPECT_LT(there.probes, timeouts);
  EXPECT_LE(timeouts - there.probes, 10U);
  ASSERT_TRUE(world_.run_until([this] { return statistics().held_back > 0; }, 10s));
  EXPECT_GT(statistics().quarantine.at(2).next_probe_in, 0s);

  drives_.at(1)->set_power(true);
  world_.run_for(30s);
  const auto back = statistics();
  EXPECT_FALSE(back.quarantine.at(2).active);
  EXPECT_EQ(back.quarantine.at(2).probes, 0U);
  EXPECT_EQ(back.quarantine.at(2).lasting, 0s);
  EXPECT_GE(back.quarantine.at(2).times, 1U);
  EXPECT_EQ(back.held_back, 0U);
}

TEST_F(BusWatchTest, ALostPortKeepsCountHowOftenANodeWasInQuarantine) {
  start();
  drives_.at(1)->set_power(false);
  world_.run_for(10s);
  line_->set_open(false);
  world_.run_for(100ms);
  const auto lost = statistics();
  EXPECT_FALSE(lost.quarantine.at(2).active);
  EXPECT_EQ(lost.quarantine.at(2).times, 1U);
  line_->set_open(true);
  world_.run_for(10s);
  EXPECT_EQ(statistics().quarantine.at(2).times, 2U);
}

TEST_F(BusWatchTest, StatisticsComeAtOnceAndThenEachPeriodUntilNobodyWantsThem) {
  start();
  std::vector<TimePoint> at;
  std::weak_ptr<StreamToken> reader;
  const auto take = [&](Result<StatisticsTick> tick) {
    ASSERT_TRUE(tick);
    EXPECT_EQ(tick->buses.at(0).bus, "line-a");
    EXPECT_EQ(tick->missed, 0U);
    at.push_back(world_.now());
    if (const auto token = reader.lock()) token->wanted = true;
  };
  auto token = watch_.watch_statistics("", 250ms, take);
  reader = token;
  const auto begin = world_.now();
  world_.run_for(1100ms);
  EXPECT_EQ(at, (std::vector<TimePoint>{begin, begin + 250ms, begin + 500ms, begin + 750ms, begin + 1000ms}));
  token.reset();
  world_.run_for(1s);
  EXPECT_EQ(at.size(), 5U);
}

TEST_F(BusWatchTest, ASlowReaderOfStatisticsIsOwedOneTickAndGetsTheNewestValues) {
  start();
  std::vector<StatisticsTick> ticks;
  const auto token = watch_.watch_statistics("line-a", 1s, [&](auto tick) { ticks.push_back(tick.value()); });
  world_.run_for(5500ms);  // those at 1 s to 5 s cannot be taken
  ASSERT_EQ(ticks.size(), 1U);
  token->wanted = true;
  world_.run_for(shortest_statistics_period);
  ASSERT_EQ(ticks.size(), 2U);
  EXPECT_EQ(ticks.at(1).missed, 4U);
  EXPECT_GE(ticks.at(1).buses.at(0).since_start - ticks.at(0).buses.at(0).since_start, 5400ms);
  token->wanted = true;
  world_.run_for(500ms);
  ASSERT_EQ(ticks.size(), 3U) << "the one at 6 s is not late";
  EXPECT_EQ(ticks.at(2).missed, 0U);
  std::optional<Error> error;
  const auto nobody = watch_.watch_statistics("line-x", 1s, [&](auto tick) { error = tick.error(); });
  world_.run_for(10ms);
  ASSERT_TRUE(error);
  EXPECT_EQ(error->reason, Reason::invalid_argument);
}

TEST_F(BusWatchTest, ATraceHasEveryFrameOnceAndInOrder) {
  start();
  Traced all;
  Traced of_device;
  const auto token = trace({.bus = "line-a"}, all);
  const auto filtered = trace({.bus = "line-a", .node = 9}, of_device);
  world_.run_for(40ms);
  EXPECT_EQ(of_device.batches, 1) << "told at once that it has begun";
  line_->forget_wire();
  all = {};
  world_.run_for(3s);
  EXPECT_EQ(all.lost, 0U);
  ASSERT_GT(all.frames.size(), 20U);
  for (std::size_t i = 1; i < all.frames.size(); ++i)
    EXPECT_EQ(all.frames[i].sequence, all.frames[i - 1].sequence + 1);
  std::vector<std::vector<std::uint8_t>> sent;
  for (const auto& frame : all.frames)
    if (frame.frame.kind == TracedFrame::Kind::sent) sent.push_back(frame.data);
  const auto& wire = line_->wire();
  ASSERT_LE(sent.size(), wire.size());
  const auto same = [&](const auto& bytes) {
    return std::ranges::any_of(wire, [&](const auto& entry) { return entry.request == bytes; });
  };
  EXPECT_TRUE(std::ranges::all_of(sent, same));
  EXPECT_GE(sent.size() + 4, wire.size()) << "but for what ended in the last 20 ms";
  ASSERT_FALSE(of_device.frames.empty());
  EXPECT_TRUE(std::ranges::all_of(of_device.frames, [](const auto& f) { return f.frame.node == 9; }));
}

TEST_F(BusWatchTest, ASlowReaderLosesFramesAndHearsHowMany) {
  start();
  Traced traced;
  const auto token = trace({.bus = "line-a"}, traced, false);
  world_.run_for(1s);
  EXPECT_EQ(traced.batches, 2) << "the greeting, and one batch that was not taken";
  const auto last = traced.frames.back().sequence;
  world_.run_for(60s);
  EXPECT_EQ(traced.batches, 2);
  token->wanted = true;
  world_.run_for(25ms);
  ASSERT_EQ(traced.batches, 3);
  EXPECT_GT(traced.lost, 100U);
  const auto next = std::ranges::find_if(traced.frames, [&](const auto& f) { return f.sequence > last; });
  EXPECT_EQ(next->sequence, last + traced.lost + 1);
}

TEST_F(BusWatchTest, ATraceOfAnUnknownBusIsRefused) {
  start();
  Traced traced;
  const auto token = trace({.bus = "line-x"}, traced);
  world_.run_for(25ms);
  ASSERT_TRUE(traced.error);
  EXPECT_EQ(traced.error->reason, Reason::invalid_argument);
}

TEST_F(BusWatchTest, AnAlarmLeavesAFlightRecordWithTheStopThatFollowed) {
  start();
  enable();
  drives_.at(0)->raise_alarm(1);
  ASSERT_TRUE(world_.run_until([&] { return !records_told().empty(); }, 10s));
  const auto event = records_told().at(0);
  const auto& record = std::get<FlightRecordWritten>(event.content);
  EXPECT_EQ(event.axis, "a1");
  EXPECT_EQ(record.bus, "line-a");
  EXPECT_NE(record.reason.find("a1: ErrorStop"), std::string::npos) << record.reason;
  const auto& text = records_.texts.at(record.name);
  EXPECT_TRUE(text.starts_with("# bus: line-a\n# reason: " + record.reason + "\n")) << text.substr(0, 200);
  EXPECT_NE(text.find(" line-a tx 01 06 00 28 00 00"), std::string::npos) << "the stop";
  // Each line can be read back: time, bus, what, and the bytes.
  std::istringstream lines(text);
  std::string line;
  int frames = 0;
  while (std::getline(lines, line)) {
    if (line.starts_with('#')) continue;
    std::istringstream words(line);
    long long ns = 0;
    std::string bus;
    std::string what;
    ASSERT_TRUE(words >> ns >> bus >> what) << line;
    EXPECT_EQ(bus, "line-a");
    EXPECT_TRUE(what == "tx" || what == "rx" || what == "--") << line;
    ++frames;
  }
  EXPECT_GT(frames, 50);
}

TEST_F(BusWatchTest, ManyFaultsWriteOneRecordAndOneMoreLater) {
  start();
  const auto& recorder = *machine_->find_recorder("line-a");
  auto& flight = machine_->flight_recorder();
  flight.fault(recorder, "a1", "first");
  for (int i = 0; i < 200; ++i) flight.fault(recorder, "a2", "reason " + std::to_string(i % 100));
  world_.run_for(1s);
  ASSERT_EQ(records_.texts.size(), 1U);
  const auto first = std::get<FlightRecordWritten>(records_told().at(0).content).reason;
  EXPECT_TRUE(first.starts_with("first; reason 0; reason 1; ")) << first;
  EXPECT_TRUE(first.ends_with(" more")) << first;
  flight.fault(recorder, "a1", "later");
  world_.run_for(8s);
  EXPECT_EQ(records_.texts.size(), 1U);
  world_.run_for(3s);
  EXPECT_EQ(records_.texts.size(), 2U);
}

TEST_F(BusWatchTest, ALostPortLeavesARecordAndOneCanBeAskedFor) {
  start();
  line_->set_open(false);
  world_.run_for(1s);
  ASSERT_EQ(records_.texts.size(), 1U);
  std::optional<Result<std::string>> name;
  watch_.write_flight_record("line-a", "local:unix", [&](auto result) { name = std::move(result); });
  ASSERT_TRUE(world_.run_until([&] { return name.has_value(); }, 1s));
  EXPECT_NE(records_.texts.at(name->value()).find("# reason: asked for by local:unix\n"), std::string::npos);
  std::optional<Result<std::vector<FlightRecord>>> listed;
  watch_.flight_records([&](auto result) { listed = std::move(result); });
  ASSERT_TRUE(world_.run_until([&] { return listed.has_value(); }, 1s));
  EXPECT_EQ(listed->value().size(), 2U);
  std::optional<Result<std::string>> text;
  watch_.flight_record(name->value(), [&](auto result) { text = std::move(result); });
  ASSERT_TRUE(world_.run_until([&] { return text.has_value(); }, 1s));
  EXPECT_EQ(text->value(), records_.texts.at(name->value()));
  line_->set_open(true);
}

}  // namespace
}  // namespace axisd::core
