#include "daemon/core/link_cycler.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <utility>

namespace axisd::core {

LinkCycler::LinkCycler(Executor executor, Clock& clock, canopen::CanopenBus& bus, RequestLinkCycle request)
    : executor_(std::move(executor)), clock_(&clock), bus_(&bus), request_(std::move(request)) {}

void LinkCycler::close() {
  closing_ = true;
  if (reply_) reply_->came.notify_all();
}

Task<> LinkCycler::run() {
  while (!closing_) {
    if (bus_->link().needs_cycle()) {
      co_await cycle();
    } else {
      trouble_.reset();
      co_await bus_->port_changed().wait();
    }
  }
}

/// One request, no sooner than its pause allows. Returns when the link's state is to be looked at again.
Task<> LinkCycler::cycle() {
  const auto next = asked_at_ + pause_;
  if (asked_ && clock_->now() < next) {
    co_await bus_->port_changed().wait_until(next);
    co_return;
  }
  pause_ = asked_ && clock_->now() - asked_at_ < sound_after
               ? std::clamp(2 * pause_, first_pause, longest_pause)
               : first_pause;
  asked_ = true;
  asked_at_ = clock_->now();
  const auto why = bus_->link().error ? bus_->link().error->message : std::string();
  const auto answer = co_await ask();
  if (!answer) co_return;
  report(*answer);
  if (!*answer) co_return;
  spdlog::warn("{}: {}; its link was taken down and up", bus_->name(), why);
  // The interface's own report follows at once. Should it not, the pause ends the waiting.
  if (bus_->link().needs_cycle()) co_await bus_->port_changed().wait_until(asked_at_ + pause_);
}

Task<std::optional<Result<void>>> LinkCycler::ask() {
  if (!request_)
    co_return fail(Reason::not_supported, "nobody here can take a CAN link down and up",
                   "set it down and up by hand");
  const auto reply = std::make_shared<Reply>(Reply{.value = {}, .came = Signal(executor_, *clock_)});
  reply_ = reply;
  request_(bus_->settings().interface, [weak = std::weak_ptr(reply)](Result<void> answer) {
    const auto waiting = weak.lock();
    if (!waiting) return;
    waiting->value = std::move(answer);
    waiting->came.notify_all();
  });
  while (!reply->value && !closing_) co_await reply->came.wait();
  reply_.reset();
  co_return std::move(reply->value);
}

/// Each trouble once, not with every attempt.
void LinkCycler::report(const Result<void>& answer) {
  if (answer) {
    trouble_.reset();
    return;
  }
  const bool known = trouble_ && trouble_->message == answer.error().message;
  trouble_ = answer.error();
  trouble_->where.bus = bus_->name();
  if (!known) spdlog::error("{}", to_string(*trouble_));
}

}  // namespace axisd::core
