#include "daemon/core/link_cycler.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <utility>

#include "buses/log_about.hpp"

namespace axisd::core {

LinkCycler::LinkCycler(Executor executor, Clock& clock, canopen::CanopenBus& bus, LinkHelper helper)
    : executor_(std::move(executor)), clock_(&clock), bus_(&bus), helper_(std::move(helper)) {}

void LinkCycler::close() {
  closing_ = true;
  if (reply_) reply_->came.notify_all();
}

Task<> LinkCycler::run() {
  while (!closing_) {
    if (bus_->link().needs_cycle()) {
      co_await cycle();
    } else {
      refused_.reset();
      if (!helper_.check || bus_->settings().simulated()) {
        co_await bus_->port_changed().wait();
        continue;
      }
      if (clock_->now() >= check_at_) check();
      co_await bus_->port_changed().wait_until(check_at_);
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
  log_about(spdlog::level::warn, LogKind::link_cycled, {.bus = bus_->name()},
            fmt::format("{}: {}; its link was taken down and up", bus_->name(), why));
  // The interface's own report follows at once. Should it not, the pause ends the waiting.
  if (bus_->link().needs_cycle()) co_await bus_->port_changed().wait_until(asked_at_ + pause_);
}

Task<std::optional<Result<void>>> LinkCycler::ask() {
  if (bus_->cycle_link()) co_return Result<void>{};
  if (!helper_.cycle)
    co_return fail(Reason::not_supported, "nobody here can take a CAN link down and up",
                   "set it down and up by hand");
  const auto reply = std::make_shared<Reply>(Reply{.value = {}, .came = Signal(executor_, *clock_)});
  reply_ = reply;
  helper_.cycle(bus_->settings().interface, [weak = std::weak_ptr(reply)](Result<void> answer) {
    const auto waiting = weak.lock();
    if (!waiting) return;
    waiting->value = std::move(answer);
    waiting->came.notify_all();
  });
  while (!reply->value && !closing_) co_await reply->came.wait();
  reply_.reset();
  co_return std::move(reply->value);
}

void LinkCycler::check() {
  check_at_ = clock_->now() + check_period;
  if (checking_) return;
  checking_ = std::make_shared<int>();
  helper_.check(bus_->settings().interface,
                [this, weak = std::weak_ptr(checking_)](const Result<void>& answer) {
                  if (!weak.expired()) checked(answer);
                });
}

void LinkCycler::checked(const Result<void>& answer) {
  checking_.reset();
  if (!note(unready_, answer)) return;
  if (unready_)
    spdlog::warn("{}: its link would not be cycled after bus-off or a stall: {}", bus_->name(),
                 to_string(*unready_));
  else
    spdlog::info("{}: its link would be cycled after bus-off or a stall", bus_->name());
}

void LinkCycler::report(const Result<void>& answer) {
  if (note(refused_, answer) && refused_) spdlog::error("{}", to_string(*refused_));
}

/// Whether that is news: each trouble is told once, not with every attempt.
bool LinkCycler::note(std::optional<Error>& trouble, const Result<void>& answer) const {
  const auto before = trouble ? trouble->message : std::string();
  trouble.reset();
  if (!answer) {
    trouble = answer.error();
    trouble->where.bus = bus_->name();
  }
  return before != (trouble ? trouble->message : std::string());
}

}  // namespace axisd::core
