// An axis's uninterrupted use of its node.
#pragma once

#include "devices/axis/axis.hpp"

namespace axisd {

/// Keeps the poll loop off the node: a start is one uninterrupted chain (M6).
class Axis::Chain {
 public:
  explicit Chain(Axis& axis) : axis_(&axis) {
    ++axis_->chains_;
    axis_->observed_.interrupted();
    axis_->wake();
  }
  ~Chain() {
    --axis_->chains_;
    // The reading that waits since before it is of an axis at work now.
    axis_->context_.env.bus->hasten(axis_->context_.settings.node, TransactionClass::moving_state);
    axis_->wake();
  }
  Chain(const Chain&) = delete;

 private:
  Axis* axis_;
};

}  // namespace axisd
