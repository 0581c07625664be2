// Lines that somebody else causes, as they stand in the log.
#include "buses/limited_log.hpp"

#include <gmock/gmock.h>
#include <spdlog/sinks/ostream_sink.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <memory>
#include <sstream>

namespace axisd {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;
using ::testing::Not;

class LimitedLog : public ::testing::Test {
 protected:
  LimitedLog() {
    (void)tell_left_out(TimePoint::max());
    auto logger =
        std::make_shared<spdlog::logger>("", std::make_shared<spdlog::sinks::ostream_sink_mt>(text_));
    logger->set_pattern("%l %v");
    spdlog::set_default_logger(std::move(logger));
  }
  ~LimitedLog() override { spdlog::set_default_logger(before_); }
  [[nodiscard]] std::ptrdiff_t lines() const { return std::ranges::count(text_.str(), '\n'); }

  std::shared_ptr<spdlog::logger> before_ = spdlog::default_logger();
  std::ostringstream text_;
};

TEST_F(LimitedLog, SaysWhatItLeftOut) {
  for (int i = 0; i < 62; ++i)
    log_limited(spdlog::level::info, "hmi", "refused calls", fmt::format("Move refused {}", i));
  log_limited(spdlog::level::warn, "panel", "refused calls", "Move refused");
  log_limited(spdlog::level::warn, "hmi", "stops", "group stop of 2 axes");
  EXPECT_EQ(lines(), 52);
  EXPECT_THAT(text_.str(), HasSubstr("info hmi: Move refused 49\n"));
  EXPECT_THAT(text_.str(), Not(HasSubstr("Move refused 50")));
  EXPECT_THAT(text_.str(), HasSubstr("warning panel: Move refused\n"));
  const auto now = monotonic_now();
  EXPECT_LE(tell_left_out(now), now + 10s);
  EXPECT_EQ(lines(), 52);
  (void)tell_left_out(now + 10s);
  EXPECT_EQ(lines(), 53);
  EXPECT_THAT(text_.str(), HasSubstr("warning hmi: refused calls: 12 more like this in the last 10 s\n"));
}

TEST_F(LimitedLog, WhatTheLevelHidesIsNotCounted) {
  for (int i = 0; i < 100; ++i) log_limited(spdlog::level::debug, "hmi", "calls", "renewed");
  (void)tell_left_out(TimePoint::max());
  EXPECT_EQ(lines(), 0);
}

}  // namespace
}  // namespace axisd
