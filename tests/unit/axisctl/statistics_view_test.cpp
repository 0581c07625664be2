#include "api/axisctl/statistics_view.hpp"

#include <gmock/gmock.h>

namespace axisd::axisctl {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

v1::LatencyHistogram histogram(std::initializer_list<std::uint64_t> counts, int longest_ms) {
  v1::LatencyHistogram made;
  for (const auto count : counts) made.add_counts(count);
  made.mutable_longest()->set_nanos(longest_ms * 1'000'000);
  return made;
}

TEST(StatisticsView, PercentilesAreTheBoundsOfTheirBuckets) {
  // At most 0.1 ms, 0.119 ms, 0.141 ms, 0.168 ms, 0.2 ms.
  const auto made = histogram({50, 40, 0, 0, 10}, 1);
  EXPECT_DOUBLE_EQ(percentile(made, 0.5), 0.1e-3);
  EXPECT_NEAR(percentile(made, 0.51), 0.1189e-3, 1e-7);
  EXPECT_NEAR(percentile(made, 0.9), 0.1189e-3, 1e-7);
  EXPECT_DOUBLE_EQ(percentile(made, 0.91), 0.2e-3);
  EXPECT_DOUBLE_EQ(percentile(made, 1), 0.2e-3);
}

TEST(StatisticsView, PercentileIsNotAboveTheLongest) {
  auto made = histogram({0, 0, 0, 0, 0, 0, 0, 0, 1}, 0);
  made.mutable_longest()->set_nanos(350'000);
  EXPECT_DOUBLE_EQ(percentile(made, 0.5), 0.35e-3);
  EXPECT_EQ(percentile(v1::LatencyHistogram(), 0.5), 0);
}

TEST(StatisticsView, PercentileInTheBucketWithoutBoundIsTheLongest) {
  v1::LatencyHistogram made;
  for (int i = 0; i < 69; ++i) made.add_counts(0);
  made.add_counts(1);
  made.mutable_longest()->set_seconds(20);
  EXPECT_EQ(percentile(made, 0.5), 20);
}

TEST(StatisticsView, ShowsWhatMatters) {
  v1::BusStatistics bus;
  bus.set_bus("line-a");
  bus.set_utilisation(0.1251);
  bus.set_utilisation_since_start(0.08);
  bus.mutable_since_start()->set_seconds(185);
  EXPECT_EQ(load_line(bus), "line-a: occupied 12.5 % of the last 10 s, 8 % of 3 min 5 s since the start");
  auto& one = *bus.add_classes();
  one.set_transaction_class(v1::TRANSACTION_CLASS_MOVING_STATE);
  one.set_sent(100);
  one.set_dropped_expired(4);
  *one.mutable_queueing() = histogram({100}, 0);
  EXPECT_THAT(class_table(bus).lines(false), ElementsAre(HasSubstr("QUEUE P50"), HasSubstr("moving state")));
  auto& node = *bus.add_nodes();
  node.set_node(3);
  node.set_name("feeder");
  auto& exception = *node.mutable_line()->add_exceptions();
  exception.set_code(2);
  exception.set_name("illegal data address");
  exception.set_count(7);
  node.mutable_unknown_starts()->set_executed(1);
  const auto lines = line_node_table(bus).lines(false);
  EXPECT_THAT(lines.at(1), HasSubstr("7 x 02 illegal data address"));
  EXPECT_THAT(lines.at(1), HasSubstr("1: 1 executed, 0 not, 0 unresolved"));
  auto& quarantine = *node.mutable_line()->mutable_quarantine();
  quarantine.set_times(2);
  EXPECT_THAT(line_node_table(bus).lines(false).at(1), HasSubstr("2 x so far"));
  quarantine.set_active(true);
  quarantine.set_probes(4);
  quarantine.mutable_lasting()->set_seconds(75);
  quarantine.mutable_next_probe_in()->set_nanos(250'000'000);
  EXPECT_THAT(line_node_table(bus).lines(false).at(1), HasSubstr("for 1 min 15 s, 4 probes, next in 250 ms"));
  bus.set_held_back(5);
  EXPECT_THAT(load_line(bus), HasSubstr("; 5 requests are held back"));
  node.mutable_network()->set_heartbeats_lost(77);
  EXPECT_THAT(network_node_table(bus).lines(false).at(1), HasSubstr("77"));
}

TEST(StatisticsView, HasEachBusBelowTheOtherAsWideAsTheTerminal) {
  v1::GetBusStatisticsResponse all;
  auto& line = *all.add_buses();
  line.set_bus("line-a");
  line.add_classes()->set_transaction_class(v1::TRANSACTION_CLASS_STOP);
  auto& network = *all.add_buses();
  network.set_bus("can0");
  network.set_kind(v1::BUS_KIND_CANOPEN);
  network.add_nodes()->set_node(5);
  EXPECT_THAT(statistics_lines(all.buses(), false, 12),
              ElementsAre("line-a: occu", HasSubstr("CLASS"), HasSubstr("stop"), "", "can0: occupi",
                          HasSubstr("CLASS"), "", HasSubstr("NODE"), HasSubstr("5")));
}

}  // namespace
}  // namespace axisd::axisctl
