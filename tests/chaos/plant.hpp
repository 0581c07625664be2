// A machine in virtual time on wires that lose, delay, double and damage frames, by a seed.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/core/machine_core.hpp"
#include "devices/simulation/can_nodes.hpp"
#include "tests/chaos/station.hpp"
#include "tests/chaos/watched_port.hpp"
#include "tests/support/virtual_line.hpp"
#include "tests/support/virtual_world.hpp"

namespace axisd::chaos {

/// `lines`: two RS-485 lines with three drives each, one of every model. `network`: a CAN network with two
/// YSS-C and two standard drives, and two drives on a line beside it. `full_line`: 16 drives on one line.
/// `generic`: a CAN network with a YSS-C and four drives that only their data sheets describe, each of
/// another make and with habits of its own, and a drive on a line.
enum class PlantKind : std::uint8_t { lines, network, full_line, generic };

/// How many transactions passed, and how many of them a fault struck. On CAN: SDO requests, RPDOs, NMT
/// commands, and each SYNC that is struck.
struct Traffic {
  std::uint64_t transactions = 0, faulted = 0;
};

class Plant {
 public:
  Plant(PlantKind kind, std::uint64_t seed);
  ~Plant();
  Plant(const Plant&) = delete;

  test::VirtualWorld world;
  std::unique_ptr<core::MachineCore> machine;
  std::vector<Station> stations;

  /// Called when a frame is about to go out and nobody can call it back any more: at its first byte on a
  /// line, when it is handed to the interface on CAN. And for what reaches a drive, and when one starts
  /// without.
  std::function<void(Station&, const Telegram&)> on_bind;
  std::function<void(Station&, const Executed&)> on_executed;
  std::function<void(Station&)> on_own_start;
  /// The drive has refused this one: it was reached, and did nothing.
  std::function<void(Station&, const Telegram&)> on_refused;
  /// Somebody did something at the machine.
  std::function<void(const Station&, const std::string&)> on_hand;

  /// Brings the drives to this moment.
  void settle();
  void set_faulty(bool faulty);
  [[nodiscard]] const Traffic& on_lines() const { return on_lines_; }
  [[nodiscard]] const Traffic& on_can() const { return on_can_; }
  [[nodiscard]] Station* find(const std::string& axis);

 private:
  void add_line(config::Configuration& configuration, const std::string& name,
                const std::vector<std::uint8_t>& nodes);
  /// `sheets`: of the drives, from the first node on; empty: a YSS-C.
  void add_network(config::Configuration& configuration, std::span<const std::string_view> sheets);
  void add_axis(config::Configuration& configuration, Station station);
  void add_drive(Station& station);
  std::unique_ptr<modbus_rtu::Line> make_line(const modbus_rtu::LineSettings& settings);
  std::unique_ptr<can::Port> make_port(const canopen::NetworkSettings& settings);

  // plant_faults.cpp
  void bound(const std::string& line, const test::WireEntry& entry);
  bool strike(Station& station, test::VirtualLine& line);
  void handed_over(const can::Frame& frame);
  bool strike(Station& station, const can::Frame& frame);
  void strike_network(const can::Frame& frame);
  void answered(const can::Frame& frame);
  void mend_network();

  Dice dice_;
  double share_ = 0;  ///< of transactions that a fault strikes
  bool faulty_ = false;
  std::map<std::string, test::VirtualLine*> lines_;
  std::unique_ptr<can::Network> network_;
  std::unique_ptr<simulation::NetworkNodes> nodes_;
  WatchedPort* port_ = nullptr;
  std::map<std::uint8_t, Telegram> asked_by_sdo_;  ///< of each node: the last request
  Traffic on_lines_, on_can_;
  std::vector<Clock::Timer> mendings_;
};

}  // namespace axisd::chaos
