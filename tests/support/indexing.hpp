// Axes that index: what fills a bus with starts.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "daemon/core/machine_core.hpp"
#include "tests/support/virtual_world.hpp"

namespace axisd::test {

/// Axes of one machine that are moved to and fro, each as soon as its last move has ended. What is refused is
/// asked for again 20 ms later.
class IndexingAxes {
 public:
  /// Targets, user units.
  struct Way {
    double near = 0.2, far = 0.4;
    double spread = 0;  ///< further by up to this, each time, by a fixed seed
    Duration pause{};   ///< that the client takes between the end of a move and the next
  };
  IndexingAxes(VirtualWorld& world, core::MachineCore& machine, std::vector<std::string> axes, Way way);
  IndexingAxes(VirtualWorld& world, core::MachineCore& machine, std::vector<std::string> axes)
      : IndexingAxes(world, machine, std::move(axes), Way{}) {}
  IndexingAxes(const IndexingAxes&) = delete;

  /// Waits until they are online, enables them, and calls where they stand 0. Throws where one is not done.
  void make_ready();
  void run(Duration duration);
  /// Until so many more moves are done. Throws if they take a second each.
  void run_moves(long moves);
  /// Now; its next move waits for the end of the stop. A move that is ended by it is no failure.
  void stop(std::size_t axis);

  [[nodiscard]] std::size_t count() const { return axes_.size(); }
  [[nodiscard]] long done_of(std::size_t axis) const { return axes_.at(axis).done; }
  [[nodiscard]] long all_done() const { return all_done_; }
  /// Its last move that was accepted; nullptr: none was.
  [[nodiscard]] const CommandPtr& move_of(std::size_t axis) const { return axes_.at(axis).move; }

  /// Told of each move that has ended.
  std::function<void(std::size_t axis, const Command& move)> on_end;
  long refused = 0, failed = 0;
  std::vector<std::string> failures;  ///< the first of them
  Duration longest_wait{};            ///< from a move's acceptance until it was active

 private:
  enum class Doing : std::uint8_t { moves, stops };
  struct Indexed {
    std::string name;
    CommandPtr move{}, stop{};
    Doing doing = Doing::moves;
    long done = 0;
    bool away = false;      ///< where its last move that was done went
    Clock::Timer rested{};  ///< at the end of the client's pause
  };
  void complete(const std::string& axis, const Action& action);
  void go_on(const std::function<bool()>& enough, TimePoint until);
  void next(std::size_t index);
  void ended(std::size_t index, const Command& move);

  VirtualWorld* world_;
  core::MachineCore* machine_;
  Way way_;
  std::vector<Indexed> axes_;
  std::vector<std::size_t> idle_;  ///< that are to get their next move, in this order
  long all_done_ = 0;
  std::mt19937_64 random_{1};
  std::shared_ptr<int> alive_ = std::make_shared<int>();
};

}  // namespace axisd::test
