#include "api/cell/watch.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <spdlog/spdlog.h>

#include <utility>

namespace axisd::cell {

Watch::Watch(Clock& clock, Duration interval, Ask ask, Tell tell)
    : clock_(clock),
      watched_(interval > Duration::zero()),
      supervision_(interval),
      ask_(std::move(ask)),
      tell_(std::move(tell)) {
  look();
}

void Watch::look() {
  using Sign = Supervision::Sign;
  const auto now = clock_.now();
  const auto progress = ask_();
  const auto found = supervision_.look(now, {{.name = "accept loop", .last = progress.accept_loop}},
                                       progress.hand_over > supervision_.doors_owe_since(now));
  if (found.sign == Sign::alive && watched_) tell_("WATCHDOG=1");
  if (found.sign == Sign::dead) {
    if (watched_) tell_("WATCHDOG=trigger");  // first: the log may be what stands still
    spdlog::critical("no progress: {}", fmt::join(found.dead, ", "));
  }
  if (found.sign == Sign::silent) spdlog::critical("no answer for clients: handing connections over");
  timer_ = clock_.call_at(now + found.next, [this] { look(); });
}

}  // namespace axisd::cell
