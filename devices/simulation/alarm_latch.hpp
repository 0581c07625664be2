// The alarm that a simulated drive shows, as chapter 8 of its maker's manuals has it, on RS-485 and on CAN
// alike.
#pragma once

namespace axisd::simulation {

/// 1 and 5 stay until the next power-up, 2 and 3 as long as the supply voltage is wrong, 4 until it is
/// cleared.
class AlarmLatch {
 public:
  [[nodiscard]] int shown() const { return shown_; }  ///< 0: none
  [[nodiscard]] bool on() const { return shown_ != 0; }
  /// False: the one that is shown stays.
  bool show(int code) {
    if (shown_ == 1 || shown_ == 5) return false;
    shown_ = code;
    return true;
  }
  void clear() { shown_ = 0; }
  /// What is wrong outside of the drive; only a voltage goes on.
  void set_cause(int code) { cause_ = is_voltage(code) ? code : 0; }
  /// It is one that the supply voltage makes.
  [[nodiscard]] bool of_voltage() const { return is_voltage(shown_); }
  /// A command ends it.
  [[nodiscard]] bool can_be_cleared() const { return shown_ == 4 || (of_voltage() && cause_ == 0); }
  void power_up() { shown_ = cause_; }

 private:
  [[nodiscard]] static bool is_voltage(int code) { return code == 2 || code == 3; }

  int shown_ = 0, cause_ = 0;
};

}  // namespace axisd::simulation
