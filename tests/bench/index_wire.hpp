// What goes over a virtual line while axes index, by what it is for; and a raw script at the same drives.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "tests/support/virtual_line.hpp"

namespace axisd::bench {

/// Of a request; manual of the YKD2405PR, 6.1. `one`: block and trigger in one frame.
enum class Purpose : std::uint8_t { state, canary, block, trigger, one, stop, other };
inline constexpr std::array purposes{"state", "canary", "block", "trigger", "one", "stop", "other"};
Purpose purpose_of(const test::WireEntry& request);
inline bool starts(Purpose purpose) { return purpose == Purpose::trigger || purpose == Purpose::one; }

/// Counts the requests on a line, and keeps none of them.
class WireCount {
 public:
  explicit WireCount(test::VirtualLine& line);
  ~WireCount() { line_->set_on_bind({}); }
  WireCount(const WireCount&) = delete;
  [[nodiscard]] long count(Purpose purpose) const { return counts_.at(static_cast<std::size_t>(purpose)); }
  [[nodiscard]] long all() const;
  void forget() { counts_ = {}; }

  /// Told of each, before its first byte.
  std::function<void(const test::WireEntry&, Purpose)> on_request;
  /// What was written to registers 0x0020..0x0023 last: start speed, times of both ramps, speed.
  std::array<std::uint16_t, 4> profile{};

 private:
  test::VirtualLine* line_;
  std::array<long, purposes.size()> counts_{};
};

/// From the first byte of a request to the first of the next, if the drive answers as fast as it can.
Duration transaction(test::VirtualLine& line, int baud, std::size_t request_bytes, std::size_t reply_bytes);
/// Of a reading of the state, and of a trigger.
Duration reading(test::VirtualLine& line, int baud);
Duration trigger(test::VirtualLine& line, int baud);

/// As bench_index_loop, in virtual time: each drive is asked for its state in turn, and who is done gets its
/// next move at once.
class RawScript {
 public:
  enum class Start : std::uint8_t { apart, one };
  struct Settings {
    int drives = 1, baud = 115200;
    std::uint16_t microstep = 0;  ///< 0x0011
    std::array<std::uint16_t, 4> profile{};
    std::int32_t here = 0, there = 0;  ///< pulses
    Start start = Start::apart;
  };
  explicit RawScript(const Settings& settings);
  /// Moves per second of the whole line, by so many moves.
  double rate(long moves);

 private:
  struct Drive {
    std::uint8_t node = 0;
    std::int32_t target = 0;
    bool moves = false;
  };
  std::vector<std::uint16_t> ask(modbus_rtu::Request request);
  void write(std::uint8_t node, std::uint16_t address, std::vector<std::uint16_t> values);
  void start(Drive& drive);
  long lap();

  Settings settings_;
  test::VirtualWorld world_;
  test::VirtualLine line_;
  modbus_rtu::Exchange exchange_;
  std::optional<modbus_rtu::ExchangeResult> result_;
  std::vector<Drive> drives_;
};

}  // namespace axisd::bench
