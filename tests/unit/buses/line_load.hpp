// A line in virtual time, loaded as axes load it: polls, starts, stops, parameters, scans; nodes answer as
// late as they may, or not at all.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <random>
#include <set>
#include <vector>

#include "buses/budget_rtu.hpp"
#include "buses/modbus_rtu/rtu_bus.hpp"
#include "tests/support/register_node.hpp"
#include "tests/support/virtual_line.hpp"

namespace axisd::modbus_rtu::test {

using namespace axisd::test;

/// One axis of the load, and the longest times that it saw.
struct LoadedAxis {
  explicit LoadedAxis(VirtualWorld& world) : wake(world.executor(), world.clock()) {}
  std::uint8_t node = 0;
  bool moving = false, silent = false, stopping = false;
  std::shared_ptr<AxisGate> gate = std::make_shared<AxisGate>();
  int chains = 0;            ///< starts under way: no polls meanwhile
  bool end_is_near = false;  ///< of what was started last: the next reading is awaited
  Signal wake;
  std::optional<TimePoint> last_asked, last_continuity, last_start;
  Duration longest_refresh{};
  // Of the stop under way.
  std::optional<TimePoint> stop_sent, stop_acknowledged, standstill;
};

class LineLoad {
 public:
  /// The last `silent` axes have drives that answer nothing.
  LineLoad(LineDemand demand, unsigned seed, int silent);
  ~LineLoad();

  [[nodiscard]] const LineDemand& demand() const { return demand_; }
  [[nodiscard]] VirtualWorld& world() { return world_; }
  std::vector<std::unique_ptr<LoadedAxis>> axes;
  int late_frames = 0;                        ///< sent after their deadline
  std::map<TransactionClass, int> completed;  ///< by class

  /// From now on.
  void silence_last(int silent);
  /// Begins polling; the first `moving` axes move, and start anew now and then if `starting`.
  void begin(int moving, bool starting);
  /// Stops the axes at once; returns when all that answer have confirmed their standstill.
  struct Stopped {
    Duration last_frame{}, standstill{};
    Duration last_answering{};  ///< to the last frame to an axis that answers
  };
  Stopped stop(const std::vector<std::size_t>& which);
  int random(int least, int most) { return std::uniform_int_distribution(least, most)(engine_); }

 private:
  Task<bool> exchange(std::uint8_t node, std::uint16_t address, ExchangeSize size, TransactionOptions options,
                      Answer* answer = nullptr);
  Task<> poll(LoadedAxis& axis, const AxisDemand& demand);
  Task<> start_now_and_then(LoadedAxis& axis, const AxisDemand& demand);
  Task<> ask_without_end(std::uint8_t node, TransactionClass transaction_class);
  Task<> send_stop(LoadedAxis& axis);
  void on_bind(const WireEntry& entry);

  LineDemand demand_;
  std::mt19937 engine_;
  VirtualWorld world_;
  VirtualLine* line_ = nullptr;
  std::unique_ptr<RtuBus> bus_;
  std::vector<RegisterNode*> nodes_;
  std::map<std::uint16_t, TimePoint> deadlines_;  ///< by the address that a read of its own has
  std::uint16_t last_address_ = 0x1000;
  bool closing_ = false;
};

}  // namespace axisd::modbus_rtu::test
