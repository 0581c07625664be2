#include "api/server/log_level.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <array>

#include "buses/limited_log.hpp"

namespace axisd::server {

namespace {

struct Level {
  spdlog::level::level_enum of_log;
  v1::LogLevel of_contract;
  std::string_view name;
};

/// The most talkative first.
constexpr std::array levels{Level{spdlog::level::trace, v1::LOG_LEVEL_TRACE, "trace"},
                            Level{spdlog::level::debug, v1::LOG_LEVEL_DEBUG, "debug"},
                            Level{spdlog::level::info, v1::LOG_LEVEL_INFO, "info"},
                            Level{spdlog::level::warn, v1::LOG_LEVEL_WARN, "warn"},
                            Level{spdlog::level::err, v1::LOG_LEVEL_ERROR, "error"}};

const Level& level_of(v1::LogLevel level) {
  const auto* found = std::ranges::find(levels, level, &Level::of_contract);
  return found == levels.end() ? levels.back() : *found;
}

}  // namespace

v1::LogLevel log_level() {
  const auto* found = std::ranges::find(levels, spdlog::get_level(), &Level::of_log);
  return found == levels.end() ? levels.back().of_contract : found->of_contract;
}

std::string change_log_level(v1::LogLevel before, v1::LogLevel after, std::string_view client) {
  auto text =
      fmt::format("the log has level {} now, and had {}", level_of(after).name, level_of(before).name);
  spdlog::set_level(level_of(std::min(before, after)).of_log);
  log_limited(spdlog::level::warn, client, "calls", text, LogKind::log_level_changed, {.client = client});
  spdlog::set_level(level_of(after).of_log);
  return text;
}

}  // namespace axisd::server
