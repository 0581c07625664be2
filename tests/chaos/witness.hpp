// A simulated drive that is watched: what really happened to it.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "tests/support/borrowed_node.hpp"

namespace axisd::chaos {

/// What reached a drive.
struct Executed {
  TimePoint when;
  std::span<const std::uint8_t> frame;
  int starts = 0;  ///< motions that it started
  [[nodiscard]] bool writes(std::uint16_t address) const {
    return frame.size() == 8 && frame[1] == 0x06 && (frame[2] << 8U | frame[3]) == address;
  }
};

class Witness final : public test::BorrowedNode {
 public:
  explicit Witness(std::unique_ptr<simulation::SimulatedRtuNode> drive)
      : BorrowedNode(*drive), drive_(std::move(drive)) {}

  std::function<void(const Executed&)> on_executed;  ///< of frames for this node
  /// No later than the last movement of the shaft so far.
  [[nodiscard]] TimePoint last_moved() const { return last_moved_; }
  [[nodiscard]] TimePoint last_power_loss() const { return last_power_loss_; }

  void advance(TimePoint now) override {
    BorrowedNode::advance(now);
    if (const auto shaft = shaft_pulses(); shaft != std::exchange(last_shaft_, shaft)) last_moved_ = now;
    now_ = now;
  }
  std::optional<std::vector<std::uint8_t>> on_frame(std::span<const std::uint8_t> frame) override {
    const auto before = starts();
    auto reply = BorrowedNode::on_frame(frame);
    if (reply && on_executed) on_executed({.when = now_, .frame = frame, .starts = starts() - before});
    return reply;
  }
  void set_power(bool on) override {
    if (!on) last_power_loss_ = now_;
    BorrowedNode::set_power(on);
  }

 private:
  std::unique_ptr<simulation::SimulatedRtuNode> drive_;
  std::int64_t last_shaft_ = 0;
  TimePoint now_{}, last_moved_{}, last_power_loss_{};
};

}  // namespace axisd::chaos
