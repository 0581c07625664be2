#include "api/axisctl/repetition.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>

#include "api/axisctl/format.hpp"
#include "api/axisctl/terminal.hpp"

namespace axisd::axisctl {
namespace {

using std::chrono::milliseconds;
using Clock = std::chrono::steady_clock;

constexpr milliseconds first_pause(50), longest_pause(500);

std::string text_of(std::chrono::nanoseconds time) {
  return duration_text(std::chrono::duration<double>(time).count());
}

}  // namespace

Repetition::Repetition(std::chrono::nanoseconds limit)
    : limit_(limit), deadline_(Clock::now() + limit), pause_(first_pause) {}

std::chrono::nanoseconds Repetition::left() const {
  return std::max<std::chrono::nanoseconds>(deadline_ - Clock::now(), first_pause);
}

bool Repetition::again(const Client& client, const Failure& failure) {
  nothing_sent_ = nothing_sent_ && failure.nothing_sent();
  if (Clock::now() + pause_ > deadline_) return false;
  if (!repeated_ && is_terminal(STDERR_FILENO))
    fmt::print(stderr, "axisctl: {}; the stop is repeated for {}\n", failure.what(), text_of(limit_));
  repeated_ = true;
  client.wait_for_connection(Lane::stop, pause_);
  pause_ = std::min(2 * pause_, longest_pause);
  return true;
}

Failure Repetition::in_vain(const Failure& failure) const {
  return {failure.code(),
          fmt::format("{}; the stop was repeated for {}: {}", failure.what(), text_of(limit_),
                      nothing_sent_ ? "it never arrived" : "whether it arrived is not known"),
          nothing_sent_};
}

}  // namespace axisd::axisctl
