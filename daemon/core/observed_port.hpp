#pragma once

#include <functional>
#include <memory>

#include "buses/can/port.hpp"

namespace axisd::core {

/// Told everything that a CAN port does, in the order in which it tells it. Thread: core; must not wait.
struct NetworkObserver {
  std::function<void(const can::ReceivedFrame& received)> received;
  /// A frame of ours ended; `at`: when that was known.
  std::function<void(const can::Frame& frame, TransactionClass transaction_class,
                     const can::SendResult& result, TimePoint at)>
      ended;
  std::function<void(const can::PortState& state, TimePoint at)> state;
};

/// A port that tells an observer before it tells its owner. Thread: core.
class ObservedPort final : public can::Port {
 public:
  /// Precondition: the observer has all its functions. `clock` outlives it.
  ObservedPort(std::unique_ptr<can::Port> inner, Clock& clock, NetworkObserver observer);

  void start(can::PortHandlers handlers) override;
  void send(const can::Frame& frame, const can::SendOptions& options, can::Completion completion) override;
  void purge_superseded(const AxisGate& gate) override { inner_->purge_superseded(gate); }
  void close() override { inner_->close(); }
  bool cycle() override { return inner_->cycle(); }
  [[nodiscard]] const can::PortState& state() const override { return inner_->state(); }
  [[nodiscard]] const can::PortCounters& counters() const override { return inner_->counters(); }
  [[nodiscard]] const can::PortSettings& settings() const override { return inner_->settings(); }

 private:
  std::unique_ptr<can::Port> inner_;
  Clock* clock_;
  /// A completion may come while this is being destroyed.
  std::shared_ptr<const NetworkObserver> observer_;
};

}  // namespace axisd::core
