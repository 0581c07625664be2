// Shorthands of the CAN tests.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "buses/can/port.hpp"

namespace axisd::can::test {

inline Frame frame_of(std::uint32_t id, std::vector<std::uint8_t> bytes = {}) {
  return make_frame(id, bytes);
}

inline SendOptions options_of(TransactionClass transaction_class, TimePoint deadline = TimePoint::max()) {
  return {.transaction_class = transaction_class, .deadline = deadline, .guard = {}};
}

inline SendOptions guarded_by(const std::shared_ptr<AxisGate>& gate) {
  return {.transaction_class = TransactionClass::motion,
          .deadline = TimePoint::max(),
          .guard = {.gate = gate, .epoch = gate->epoch()}};
}

/// Notes how frames ended, as "id:status", in order.
class Endings {
 public:
  Completion of(std::uint32_t id) {
    return [this, id](const SendResult& result) {
      texts_.push_back(std::to_string(id) + ":" + std::string(to_string(result.status)));
      results_.push_back(result);
    };
  }
  [[nodiscard]] const std::vector<std::string>& texts() const { return texts_; }
  [[nodiscard]] const std::vector<SendResult>& results() const { return results_; }

 private:
  std::vector<std::string> texts_;
  std::vector<SendResult> results_;
};

}  // namespace axisd::can::test
