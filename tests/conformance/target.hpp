// What the scenarios run against: a daemon, the drives behind it, and the time that passes for both.
#pragma once

#include <grpcpp/channel.h>

#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "buses/clock.hpp"

namespace axisd::conformance {

/// A machine with one bus: the daemon's configuration, and the drives as axisd-sim's --drive takes them.
/// Other nodes than drives may be among them (model=modbus-generic, where the simulators have it).
struct Plant {
  std::string yaml;
  std::vector<std::string> drives;
};

/// Everything that a scenario may touch: the public API, the outside world, and time. Calls of the API let
/// time pass until they are answered; otherwise it stands still. Streams do not make it pass.
class Target {
 public:
  virtual ~Target() = default;
  /// To the daemon as it runs now; of old after restart().
  [[nodiscard]] virtual std::shared_ptr<grpc::Channel> channel() = 0;
  /// One line to the outside world, in the language of axisd-sim's control socket. The answer begins with
  /// "ok" or "error".
  virtual std::string control(std::string_view line) = 0;
  /// Lets time pass for the daemon and the drives.
  virtual void pass(Duration duration) = 0;
  /// Ends the daemon and starts it again, with what it had stored; the drives go on.
  virtual void restart() = 0;
};

/// Everything in this process and in virtual time, but the API over a real gRPC server. Throws
/// std::invalid_argument if the plant's YAML or drives are not accepted; the message has all findings.
std::unique_ptr<Target> make_virtual_target(const Plant& plant);
/// Likewise, of any kind.
using TargetMaker = std::function<std::unique_ptr<Target>(const Plant& plant)>;

}  // namespace axisd::conformance
