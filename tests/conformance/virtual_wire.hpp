// The wire of a machine in virtual time, and the drives on it, of either kind of bus.
#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "daemon/core/machine_core.hpp"
#include "tests/conformance/target.hpp"
#include "tests/support/virtual_world.hpp"

namespace axisd::conformance {

/// It stays while daemons come and go. Thread: core.
class VirtualWire {
 public:
  virtual ~VirtualWire() = default;
  /// Puts what connects a daemon to this wire into the parts that its machine is built from. Each machine
  /// gets an end of its own; the drives meet it when there is one.
  virtual void connect(core::MachineParts& parts) = 0;
  /// Joins the drives to the end of the machine that was built from those parts.
  virtual void attach_drives() = 0;
  /// That machine is about to be destroyed.
  virtual void detach() = 0;
  /// One line to the outside world, at the present time.
  virtual std::string control(std::string_view line) = 0;
};

/// Throws std::invalid_argument: there is not one bus, or a drive is not accepted.
std::unique_ptr<VirtualWire> make_virtual_wire(test::VirtualWorld& world,
                                               const config::Configuration& configuration,
                                               const Plant& plant);

}  // namespace axisd::conformance
