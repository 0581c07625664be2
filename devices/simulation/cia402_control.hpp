// What a master has told a simulated CiA 402 drive: control word and mode, and the state that came of it.
// What a transition does is the drive's.
#pragma once

#include <cstdint>

namespace axisd::simulation {

/// Not Ready ends with the boot, and Fault Reaction Active at once.
enum class PowerState : std::uint8_t { disabled, ready, switched_on, operation, quick_stop, fault };

class Cia402Control {
 public:
  /// Bits of the control word that have just changed.
  struct Edges {
    unsigned rose, fell;
  };
  /// The next control word.
  Edges take(std::uint16_t word) {
    const unsigned before = word_;
    word_ = word;
    return {.rose = word & ~before, .fell = before & ~word};
  }

  [[nodiscard]] PowerState state() const { return state_; }
  [[nodiscard]] bool is(PowerState state) const { return state_ == state; }
  [[nodiscard]] bool operates() const { return state_ == PowerState::operation; }
  void enter(PowerState state) { state_ = state; }
  [[nodiscard]] int mode() const { return mode_; }
  void set_mode(int mode) { mode_ = mode; }

  [[nodiscard]] bool no_quick_stop() const { return bit(2); }
  [[nodiscard]] bool start() const { return bit(4); }
  [[nodiscard]] bool at_once() const { return bit(5); }
  [[nodiscard]] bool relative() const { return bit(6); }
  [[nodiscard]] bool halted() const { return bit(8); }

  /// Bits 0 to 3, 5 and 6 of the status word.
  [[nodiscard]] unsigned state_bits() const {
    switch (state_) {
      case PowerState::disabled:
        return 0x40;
      case PowerState::ready:
        return 0x21;
      case PowerState::switched_on:
        return 0x23;
      case PowerState::operation:
        return 0x27;
      case PowerState::quick_stop:
        return 0x07;
      case PowerState::fault:
        break;
    }
    return 0x08;
  }

  /// As after a power-up.
  void reset(PowerState state, int mode) {
    state_ = state;
    mode_ = mode;
    word_ = 0;
  }

 private:
  [[nodiscard]] bool bit(unsigned number) const { return (word_ >> number & 1U) != 0; }

  PowerState state_ = PowerState::disabled;
  std::uint16_t word_ = 0;
  int mode_ = 0;
};

}  // namespace axisd::simulation
