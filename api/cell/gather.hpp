#pragma once

#include <functional>
#include <memory>
#include <utility>

#include "buses/clock.hpp"

namespace axisd::cell {

/// Waits for several things, but not for ever. Thread: core.
class Gather : public std::enable_shared_from_this<Gather> {
 public:
  /// `done`: called once: when all that was added has come and sealed, or when the time is over.
  static std::shared_ptr<Gather> begin(Clock& clock, Duration patience, std::function<void()> done) {
    std::shared_ptr<Gather> gather(new Gather(std::move(done)));
    gather->timer_ = clock.call_at(clock.now() + patience, [weak = std::weak_ptr(gather)] {
      if (const auto self = weak.lock()) self->finish();
    });
    gather->self_ = gather;
    return gather;
  }
  void add() { ++open_; }
  /// One of those that were added has come.
  void come() {
    if (--open_ == 0) finish();
  }
  /// Nothing more is added.
  void seal() { come(); }

 private:
  explicit Gather(std::function<void()> done) : done_(std::move(done)) {}
  void finish() {
    const auto self = std::move(self_);  // until the end of this
    timer_.reset();
    if (const auto done = std::exchange(done_, {})) done();
  }

  std::function<void()> done_;
  std::shared_ptr<Gather> self_;
  int open_ = 1;
  Clock::Timer timer_;
};

}  // namespace axisd::cell
