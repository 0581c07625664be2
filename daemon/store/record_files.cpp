#include "daemon/store/record_files.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>

#include "buses/traced_frame.hpp"

namespace axisd::store {
namespace {

constexpr std::string_view bus_key = "# bus: ";
constexpr std::string_view reason_key = "# reason: ";

std::string line_after(std::string_view text, std::string_view key) {
  const auto begin = text.find(key);
  if (begin == std::string_view::npos) return {};
  const auto rest = text.substr(begin + key.size());
  return std::string(rest.substr(0, rest.find('\n')));
}

/// "20261121T134455.123Z"
std::string stamp(WallTime wall) {
  const auto whole = std::chrono::floor<std::chrono::milliseconds>(wall);
  return fmt::format("{:%Y%m%dT%H%M}{:%S}Z", whole, whole.time_since_epoch());
}

}  // namespace

std::string record_head(const std::string& bus, const std::string& reason, TimePoint monotonic,
                        WallTime wall) {
  auto one_line = reason;
  std::ranges::replace(one_line, '\n', ' ');
  const auto ns = std::chrono::duration_cast<std::chrono::nanoseconds>(wall.time_since_epoch()).count();
  return fmt::format("{}{}\n{}{}\n# CLOCK_MONOTONIC {} ns is {}.{:09} s since 1970\n# format: {}\n", bus_key,
                     bus, reason_key, one_line, monotonic.time_since_epoch().count(), ns / 1'000'000'000,
                     ns % 1'000'000'000, trace_text_version);
}

void describe(std::string_view text, FlightRecord& record) {
  record.bus = line_after(text, bus_key);
  record.reason = line_after(text, reason_key);
}

std::string record_name(const std::string& bus, WallTime wall) {
  return fmt::format("{}-{}.wire", bus, stamp(wall));
}

}  // namespace axisd::store
