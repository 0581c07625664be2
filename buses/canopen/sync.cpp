#include "buses/canopen/sync.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace axisd::canopen {

can::Frame sync_frame(std::uint32_t cob_id, std::uint8_t counter) {
  return can::make_frame(cob_id, std::span(&counter, counter == 0 ? 0U : 1U));
}

Result<void> SyncProducer::start(SyncSettings settings, Handler on_sync) {
  constexpr std::uint8_t least_overflow = 2, most_overflow = 240;  // CiA 301 7.5.2.22
  if (settings.period < std::chrono::milliseconds(1))
    return fail(Reason::invalid_argument, "the SYNC period is below 1 ms", "choose at least 1 ms");
  if (settings.counter_overflow != 0 &&
      (settings.counter_overflow < least_overflow || settings.counter_overflow > most_overflow))
    return fail(Reason::invalid_argument, fmt::format("SYNC counter overflow {}", settings.counter_overflow),
                "choose 0 or 2 to 240");
  stop();
  settings_ = settings;
  on_sync_ = std::move(on_sync);
  counters_ = {};
  counter_ = 0;
  ++run_;
  running_ = true;
  due_ = clock_->now() + settings_.period;
  if (!held_) arm();
  return {};
}

void SyncProducer::stop() {
  running_ = false;
  timer_.reset();
}

void SyncProducer::hold() {
  held_ = true;
  timer_.reset();
}

void SyncProducer::resume() {
  held_ = false;
  if (!running_) return;
  // Close behind one that was sent beside the cycles another would only cost the network twice the answers.
  const auto earliest = std::max(clock_->now(), sent_once_ + settings_.period / 2);
  if (due_ < earliest)
    due_ += (earliest - due_ + settings_.period - Duration(1)) / settings_.period * settings_.period;
  arm();
}

void SyncProducer::put(const can::SendOptions& options, can::Completion completion) {
  if (settings_.counter_overflow != 0) counter_ = counter_ % settings_.counter_overflow + 1;
  ++on_its_way_;
  port_->send(sync_frame(settings_.cob_id, counter_), options,
              [this, completion = std::move(completion)](const can::SendResult& result) {
                --on_its_way_;
                completion(result);
                if (on_its_way_ == 0 && on_idle_) on_idle_();
              });
}

void SyncProducer::send_once(const can::SendOptions& options, can::Completion completion) {
  put(options, [this, completion = std::move(completion)](const can::SendResult& result) {
    if (result.status == can::SendStatus::sent) sent_once_ = result.sent_at;
    completion(result);
  });
}

void SyncProducer::arm() {
  timer_ = clock_->call_at(due_, [this] { on_cycle(); });
}

void SyncProducer::on_cycle() {
  const auto late = clock_->now() - due_;
  counters_.latest = std::max<Duration>(counters_.latest, late);
  const auto lost = late / settings_.period;
  counters_.missed += static_cast<std::uint64_t>(lost);
  due_ += (lost + 1) * settings_.period;
  // What the network does not take within this cycle would only push the next one away.
  const can::SendOptions how{.transaction_class = TransactionClass::motion,
                             .deadline = due_ - std::chrono::nanoseconds(1)};
  put(how, [this, run = run_](const can::SendResult& result) {
    if (run != run_) return;
    if (result.status != can::SendStatus::sent) {
      ++counters_.missed;
      return;
    }
    ++counters_.sent;
    if (on_sync_) on_sync_(result.sent_at);
  });
  arm();
}

}  // namespace axisd::canopen
