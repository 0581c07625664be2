// A simulated drive that is watched: what really happened to it.
#pragma once

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "tests/chaos/journey.hpp"
#include "tests/chaos/telegram.hpp"
#include "tests/support/borrowed_can_node.hpp"
#include "tests/support/borrowed_node.hpp"

namespace axisd::chaos {

/// What reached a drive, and what it did at once.
struct Executed {
  TimePoint when;
  std::span<const std::uint8_t> frame;  ///< on CAN its data
  Telegram telegram{};
  int starts = 0;         ///< motions that it started
  std::int64_t from = 0;  ///< where its shaft was, pulses
  Stretch lately{};       ///< and everywhere that it was shortly before
  bool moving = false;
};

/// What is known of any drive, whatever wire it is on.
class Witness {
 public:
  virtual ~Witness() = default;
  [[nodiscard]] virtual simulation::SimulatedNode& drive() = 0;
  [[nodiscard]] virtual const simulation::SimulatedNode& drive() const = 0;

  std::function<void(const Executed&)> on_executed;  ///< of frames for this node
  std::function<void()> on_own_start;                ///< it started, and no frame made it
  [[nodiscard]] std::int64_t shaft_pulses() const { return drive().shaft_pulses(); }
  [[nodiscard]] bool shaft_moving() const { return drive().shaft_moving(); }
  /// No later than the last movement of the shaft so far.
  [[nodiscard]] TimePoint last_moved() const { return last_moved_; }
  [[nodiscard]] TimePoint last_power_loss() const { return last_power_loss_; }
  /// A start is bound within this of the last reading (M6: reboot_guard).
  static constexpr Duration start_time = std::chrono::milliseconds(100);
  /// Everywhere the shaft was within that time.
  [[nodiscard]] Stretch lately() const {
    Stretch stretch{.low = last_shaft_, .high = last_shaft_};
    for (const auto& [until, shaft] : places_) {
      if (now_ - until > start_time) continue;
      stretch.low = std::min(stretch.low, shaft);
      stretch.high = std::max(stretch.high, shaft);
    }
    return stretch;
  }

 protected:
  void time_passed(TimePoint now) {
    now_ = now;
    touched();
  }
  void touched() {
    note_shaft();
    note_own_start();
  }
  void lost_power() { last_power_loss_ = now_; }
  /// Of a frame that `hand_over` gives to the drive. True: it was for this node.
  template <class HandOver>
  void executes(std::span<const std::uint8_t> frame, const Telegram& telegram, HandOver hand_over) {
    const auto from = shaft_pulses();
    const auto stretch = lately();
    const bool own = hand_over();
    const auto starts = drive().starts() - std::exchange(starts_, drive().starts());
    if (own && on_executed)
      on_executed({.when = now_,
                   .frame = frame,
                   .telegram = telegram,
                   .starts = starts,
                   .from = from,
                   .lately = stretch,
                   .moving = shaft_moving()});
  }

 private:
  void note_shaft() {
    const auto shaft = shaft_pulses();
    if (shaft == last_shaft_) return;
    last_moved_ = now_;
    while (!places_.empty() && now_ - places_.front().first > start_time) places_.pop_front();
    places_.emplace_back(now_, std::exchange(last_shaft_, shaft));
  }
  void note_own_start() {
    if (drive().starts() != std::exchange(starts_, drive().starts()) && on_own_start) on_own_start();
  }
  std::int64_t last_shaft_ = 0;
  int starts_ = 0;
  std::deque<std::pair<TimePoint, std::int64_t>> places_;  ///< where it was until when
  TimePoint now_{}, last_moved_{}, last_power_loss_{};
};

class RtuWitness final : public test::BorrowedNode, public Witness {
 public:
  explicit RtuWitness(std::unique_ptr<simulation::SimulatedRtuNode> drive)
      : BorrowedNode(*drive), drive_(std::move(drive)) {}

  [[nodiscard]] simulation::SimulatedNode& drive() override { return *this; }
  [[nodiscard]] const simulation::SimulatedNode& drive() const override { return *this; }
  void advance(TimePoint now) override {
    BorrowedNode::advance(now);
    time_passed(now);
  }
  std::optional<std::vector<std::uint8_t>> on_frame(std::span<const std::uint8_t> frame) override {
    std::optional<std::vector<std::uint8_t>> reply;
    executes(frame, read_request(frame, *this), [&] {
      reply = BorrowedNode::on_frame(frame);
      return reply.has_value() && frame[0] == address();
    });
    return reply;
  }
  void set_power(bool on) override {
    if (!on) lost_power();
    BorrowedNode::set_power(on);
  }
  void set_input(std::string_view terminal, std::optional<bool> active) override {
    BorrowedNode::set_input(terminal, active);
    touched();
  }
  bool push_shaft(std::int64_t pulses) override {
    const bool gave_way = BorrowedNode::push_shaft(pulses);
    touched();
    return gave_way;
  }

 private:
  std::unique_ptr<simulation::SimulatedRtuNode> drive_;
};

class CanWitness final : public test::BorrowedCanNode, public Witness {
 public:
  explicit CanWitness(std::unique_ptr<simulation::SimulatedCanNode> drive)
      : BorrowedCanNode(*drive), drive_(std::move(drive)) {}

  [[nodiscard]] simulation::SimulatedNode& drive() override { return *this; }
  [[nodiscard]] const simulation::SimulatedNode& drive() const override { return *this; }
  void advance(TimePoint now) override {
    BorrowedCanNode::advance(now);
    time_passed(now);
  }
  void on_frame(const can::Frame& frame) override {
    executes(frame.bytes(), read_frame(frame, *this), [&] {
      BorrowedCanNode::on_frame(frame);
      return true;
    });
  }
  void set_power(bool on) override {
    if (!on) lost_power();
    BorrowedCanNode::set_power(on);
  }
  void set_input(std::string_view terminal, std::optional<bool> active) override {
    BorrowedCanNode::set_input(terminal, active);
    touched();
  }
  bool push_shaft(std::int64_t pulses) override {
    const bool gave_way = BorrowedCanNode::push_shaft(pulses);
    touched();
    return gave_way;
  }

 private:
  std::unique_ptr<simulation::SimulatedCanNode> drive_;
};

}  // namespace axisd::chaos
