#pragma once

#include <boost/smart_ptr/atomic_shared_ptr.hpp>
#include <memory>
#include <utility>

#include "buses/gate.hpp"
#include "devices/axis/snapshot.hpp"

namespace axisd {

/// The part of an axis that every thread may use. It outlives the axis for whoever holds it, and an axis that
/// takes the place of another under the same name goes on with it: epochs only rise, and a stop that was
/// asked for is owed by whichever of the two serves it. Thread: any.
struct AxisFace {
  /// `bus`: told of each stop that is requested; may be null.
  explicit AxisFace(std::shared_ptr<StopNotice> bus) : gate(std::make_shared<AxisGate>(std::move(bus))) {}

  const std::shared_ptr<AxisGate> gate;
  /// Written by the axis; not null once there was one.
  boost::atomic_shared_ptr<const AxisSnapshot> snapshot;
};
using AxisFacePtr = std::shared_ptr<AxisFace>;

}  // namespace axisd
