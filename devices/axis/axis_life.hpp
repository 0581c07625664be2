// From the start of an axis to its end.
#pragma once

#include <cstdint>

namespace axisd {

/// Pure. Thread: core.
///
///   serving -- close() ---------------------> closing
///   serving -- retire(), drive is silent ---> retired
///   serving -- retire(), drive answers -----> retired_online
class AxisLife {
 public:
  enum class State : std::uint8_t {
    serving,
    closing,         ///< the daemon ends
    retired,         ///< another axis of the same name, or none, takes its place; its drive was silent then
    retired_online,  ///< the same, and its drive answered
  };

  void close() {
    if (state_ == State::serving) state_ = State::closing;
  }
  void retire(bool answers) { state_ = answers ? State::retired_online : State::retired; }

  [[nodiscard]] State state() const { return state_; }
  /// Sequences run out, and nothing new begins.
  [[nodiscard]] bool ends() const { return state_ != State::serving; }
  [[nodiscard]] bool retired() const { return state_ >= State::retired; }
  [[nodiscard]] bool answered() const { return state_ == State::retired_online; }

 private:
  State state_ = State::serving;
};

}  // namespace axisd
