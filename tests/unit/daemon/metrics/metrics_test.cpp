#include "daemon/metrics/metrics.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <boost/smart_ptr/make_shared.hpp>
#include <string>

#include "tests/unit/api/fake_machine.hpp"

namespace axisd::metrics {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;
using ::testing::Not;

class MetricsTest : public ::testing::Test {
 protected:
  MetricsTest() {
    core::BusReading bus;
    bus.status = {.name = "line-a", .port = "/dev/ttyUSB0", .open = true};
    bus.classes.at(std::to_underlying(TransactionClass::motion)).ends.answered = 7;
    bus.stops.some.frame.add(3ms);
    reading_.buses.push_back(std::move(bus));
  }
  std::string scrape(Format format = Format::text) { return *metrics_.scrape(format); }
  void pass(Duration time) { machine_.set_now(machine_.now() + time); }

  axisd::testing::FakeMachine machine_;
  core::MachineReading reading_;
  Metrics metrics_{
      {.machine = &machine_,
       .reading = [this] { return boost::make_shared<const core::MachineReading>(reading_); },
       .journal_syncs = [] { return LatencyHistogram(); },
       .budgets = {{.predicted = {.bus = "line-a",
                                  .stops = {{.axes = 1, .last_frame = 6ms, .standstill = 20ms},
                                            {.axes = 2, .last_frame = 9ms, .standstill = 30ms}}}}},
       .files_expire =
           [] {
             return std::vector<FileExpiry>{{.key = "certificate", .at = WallTime(1'800'000'000s)},
                                            {.key = "crl", .at = WallTime(1'700'000'000s)}};
           }}};
};

TEST_F(MetricsTest, SaysWhatAxesPublish) {
  AxisSnapshot feeder{.name = "feeder", .bus = "line-a", .node = 3, .model = "ykd2405pr", .unit = "mm"};
  feeder.state = AxisState::discrete_motion;
  feeder.link = LinkState::online;
  feeder.position = 12.5;
  feeder.following_error = -0.25;
  feeder.sampled.set(machine_.now() - 20ms, machine_.now() - 10ms, {});
  machine_.publish(feeder);
  const auto text = scrape();
  for (const auto* line : {
           R"(axisd_axis_info{axis="feeder",bus="line-a",node="3",model="ykd2405pr",unit="mm"} 1)",
           R"(axisd_axis_state{axis="feeder",state="DiscreteMotion"} 1)",
           R"(axisd_axis_state{axis="feeder",state="Standstill"} 0)",
           R"(axisd_axis_link{axis="feeder",state="online"} 1)",
           R"(axisd_axis_position{axis="feeder",unit="mm"} 12.5)",
           R"(axisd_axis_following_error{axis="feeder",unit="mm"} -0.25)",
           R"(axisd_axis_sample_age_seconds{axis="feeder"} 0.02)",
           R"(axisd_axis_link{axis="turntable",state="offline"} 1)",
       })
    EXPECT_THAT(text, HasSubstr(std::string("\n") + line + "\n"));
  EXPECT_THAT(text, Not(HasSubstr("axisd_axis_position{axis=\"turntable\""))) << "it was never read";
}

TEST_F(MetricsTest, BoundsStandBesideWhatWasSeen) {
  const auto text = scrape();
  for (const auto* line : {
           R"(axisd_stop_frame_seconds_count{bus="line-a",scope="some"} 1)",
           R"(axisd_stop_frame_longest_seconds{bus="line-a",scope="some"} 0.003)",
           R"(axisd_stop_frame_bound_seconds{bus="line-a",scope="one"} 0.006)",
           R"(axisd_stop_frame_bound_seconds{bus="line-a",scope="all"} 0.009)",
           R"(axisd_bus_transactions_total{bus="line-a",class="motion",outcome="answered"} 7)",
           R"(axisd_bus_transactions_total{bus="line-a",class="stop",outcome="no_reply"} 0)",
           R"(axisd_certificate_expiry_timestamp_seconds{file="certificate"} 1800000000)",
           R"(axisd_certificate_expiry_timestamp_seconds{file="crl"} 1700000000)",
       })
    EXPECT_THAT(text, HasSubstr(std::string("\n") + line + "\n"));
}

TEST_F(MetricsTest, WhoeverComesSoonerGetsTheTextOfBefore) {
  const auto first = metrics_.scrape(Format::text);
  pass(Metrics::renewed_after - 1ms);
  EXPECT_EQ(metrics_.scrape(Format::text), first);
  EXPECT_THAT(scrape(Format::openmetrics), ::testing::EndsWith("# EOF\n"));
  pass(1ms);
  EXPECT_NE(metrics_.scrape(Format::text), first);
  EXPECT_THAT(scrape(), HasSubstr("axisd_metrics_scrapes_total 4\n"));
}

TEST_F(MetricsTest, NothingThatClientsSayMakesASample) {
  const auto samples = [this] {
    pass(Metrics::renewed_after);
    return std::ranges::count(scrape(), '\n');
  };
  const auto before = samples();
  auto feeder = *machine_.snapshot("feeder");
  for (int i = 0; i < 10'000; ++i) {
    const auto name = fmt::format("client-{}", i);
    reading_.tallies.add("feeder",
                         LeaseChange{.what = LeaseChange::What::taken, .holder = name, .before = ""});
    reading_.tallies.add("feeder", CommandChange{.command = std::make_shared<const Command>(Command{
                                                     .id = name, .request_id = name, .client = name})});
    reading_.tallies.add("feeder", StopHoldChange{.hold = {.holder = name}, .by = name});
  }
  feeder.lease_holder = "client-1";
  feeder.command_id = "client-2";
  feeder.fault = Error{.reason = Reason::alarm, .message = "client-3"};
  machine_.publish(feeder);
  EXPECT_EQ(samples(), before);
  EXPECT_THAT(scrape(), Not(HasSubstr("client-")));
}

}  // namespace
}  // namespace axisd::metrics
