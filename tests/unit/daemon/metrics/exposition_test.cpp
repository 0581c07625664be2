#include "api/exposition/exposition.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

namespace axisd::metrics {
namespace {

using namespace std::chrono_literals;
using testing::HasSubstr;

TEST(Exposition, WritesFamiliesAndSamples) {
  Exposition to(Format::text);
  to.family("axisd_moves_total", MetricType::counter, "Moves.");
  to.sample(Labels().with("axis", "feeder"), 12);
  to.family("axisd_position", MetricType::gauge, "Position.");
  to.sample({}, -0.125);
  to.sample({}, 1e-9);
  to.sample({}, std::numeric_limits<double>::infinity());
  to.sample({}, std::numeric_limits<double>::quiet_NaN());
  to.family("axisd_build_info", MetricType::info, "Build.");
  EXPECT_EQ(to.take(),
            "# HELP axisd_moves_total Moves.\n"
            "# TYPE axisd_moves_total counter\n"
            "axisd_moves_total{axis=\"feeder\"} 12\n"
            "# HELP axisd_position Position.\n"
            "# TYPE axisd_position gauge\n"
            "axisd_position -0.125\n"
            "axisd_position 1e-09\n"
            "axisd_position +Inf\n"
            "axisd_position NaN\n"
            "# HELP axisd_build_info Build.\n"
            "# TYPE axisd_build_info gauge\n");
}

TEST(Exposition, OpenMetricsNamesFamiliesWithoutWhatTheTypeAdds) {
  Exposition to(Format::openmetrics);
  to.family("axisd_moves_total", MetricType::counter, "Moves.");
  to.sample({}, 1);
  to.family("axisd_build_info", MetricType::info, "Build.");
  to.sample(Labels().with("version", "1.0"), 1);
  EXPECT_EQ(to.take(),
            "# HELP axisd_moves Moves.\n"
            "# TYPE axisd_moves counter\n"
            "axisd_moves_total 1\n"
            "# HELP axisd_build Build.\n"
            "# TYPE axisd_build info\n"
            "axisd_build_info{version=\"1.0\"} 1\n"
            "# EOF\n");
}

TEST(Exposition, ValuesOfLabelsAreEscaped) {
  EXPECT_EQ(Labels().with("a", "x").with("b", "\\ \" \n").text(), "a=\"x\",b=\"\\\\ \\\" \\n\"");
}

TEST(Exposition, HistogramsAreCumulativeAndInSeconds) {
  LatencyHistogram durations;
  durations.add(50us);
  durations.add(150us);
  durations.add(1min);
  Exposition to(Format::text);
  to.family("axisd_exchange_seconds", MetricType::histogram, "Exchanges.");
  to.histogram(Labels().with("bus", "a"), durations);
  const auto text = to.take();
  EXPECT_THAT(text, HasSubstr("axisd_exchange_seconds_bucket{bus=\"a\",le=\"0.0001\"} 1\n"));
  EXPECT_THAT(text, HasSubstr("axisd_exchange_seconds_bucket{bus=\"a\",le=\"0.0002\"} 2\n"));
  EXPECT_THAT(text, HasSubstr("axisd_exchange_seconds_bucket{bus=\"a\",le=\"13.1072\"} 2\n"));
  EXPECT_THAT(text, HasSubstr("axisd_exchange_seconds_bucket{bus=\"a\",le=\"+Inf\"} 3\n"
                              "axisd_exchange_seconds_sum{bus=\"a\"} 60.0002\n"
                              "axisd_exchange_seconds_count{bus=\"a\"} 3\n"));
}

}  // namespace
}  // namespace axisd::metrics
