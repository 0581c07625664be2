// A machine in virtual time on lines that lose, delay, double and damage frames, by a seed.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "daemon/core/machine_core.hpp"
#include "tests/chaos/witness.hpp"
#include "tests/support/virtual_line.hpp"
#include "tests/support/virtual_world.hpp"

namespace axisd::chaos {

/// Everything random comes from here: one seed, one history.
class Dice {
 public:
  explicit Dice(std::uint64_t seed) : random_(seed) {}
  /// 0 .. n-1
  int pick(int n) { return static_cast<int>(random_() % static_cast<std::uint64_t>(n)); }
  bool chance(double probability) { return static_cast<double>(random_() >> 11U) * 0x1p-53 < probability; }
  Duration up_to(Duration longest) {
    return Duration(static_cast<Duration::rep>(random_() % (longest.count() + 1)));
  }

 private:
  std::mt19937_64 random_;
};

/// An axis with the drive behind it.
struct Station {
  std::string name;
  std::string line;
  std::uint8_t node = 0;
  bool limited = true;  ///< it has position limits: velocity runs as a move to them
  Witness* drive = nullptr;
  Axis* axis = nullptr;
  TimePoint silent_until{};  ///< an outage: nothing passes from or to it
};

inline constexpr double pulses_per_mm = 100;

/// Two lines with three drives each, one of every RS-485 model. Axes: 100 pulses per mm, 100 mm/s; the
/// home switch is 50 mm below the position at power-up.
class Plant {
 public:
  static constexpr std::array line_names{"line-a", "line-b"};
  static constexpr int axes_per_line = 3;
  static constexpr std::uint16_t marked_registers = 0x0090;  ///< 32 of them with values of their own
  static constexpr int marked_count = 32;

  explicit Plant(std::uint64_t seed);
  ~Plant();
  Plant(const Plant&) = delete;

  test::VirtualWorld world;
  std::unique_ptr<core::MachineCore> machine;
  std::vector<Station> stations;

  /// Called at the first byte of each request, and for what reaches a drive.
  std::function<void(Station&, const test::WireEntry&)> on_bind;
  std::function<void(Station&, const Executed&)> on_executed;

  void set_faulty(bool faulty);
  [[nodiscard]] std::uint64_t transactions() const { return transactions_; }
  [[nodiscard]] std::uint64_t faulted() const { return faulted_; }
  /// What marked register `offset` of a node holds.
  [[nodiscard]] static std::uint16_t mark(std::uint8_t node, int offset);
  [[nodiscard]] Station* find(const std::string& axis);

 private:
  void add_axis(config::Configuration& configuration, const std::string& line, std::uint8_t node);
  void add_drive(Station& station, const std::string& model);
  void bound(const std::string& line, const test::WireEntry& entry);
  bool strike(Station& station, test::VirtualLine& line);
  test::VirtualLine& line_of(const std::string& name) { return *lines_.at(name); }

  Dice dice_;
  double share_ = 0;  ///< of transactions that a fault strikes
  bool faulty_ = false;
  std::map<std::string, test::VirtualLine*> lines_;
  std::uint64_t transactions_ = 0, faulted_ = 0;
  std::vector<Clock::Timer> replugs_;
};

}  // namespace axisd::chaos
