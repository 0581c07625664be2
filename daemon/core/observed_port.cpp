#include "daemon/core/observed_port.hpp"

#include <utility>

namespace axisd::core {

ObservedPort::ObservedPort(std::unique_ptr<can::Port> inner, Clock& clock, NetworkObserver observer)
    : inner_(std::move(inner)),
      clock_(&clock),
      observer_(std::make_shared<const NetworkObserver>(std::move(observer))) {}

void ObservedPort::start(can::PortHandlers handlers) {
  inner_->start(
      {.on_frame =
           [observer = observer_, told = std::move(handlers.on_frame)](const can::ReceivedFrame& received) {
             observer->received(received);
             if (told) told(received);
           },
       .on_state =
           [observer = observer_, clock = clock_,
            told = std::move(handlers.on_state)](const can::PortState& state) {
             observer->state(state, clock->now());
             if (told) told(state);
           },
       .may_gather = std::move(handlers.may_gather)});
}

void ObservedPort::send(const can::Frame& frame, const can::SendOptions& options,
                        can::Completion completion) {
  inner_->send(frame, options,
               [observer = observer_, frame, transaction_class = options.transaction_class, clock = clock_,
                told = std::move(completion)](const can::SendResult& result) {
                 observer->ended(frame, transaction_class, result, clock->now());
                 if (told) told(result);
               });
}

}  // namespace axisd::core
