// What the stop lane takes.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "api/server/access.hpp"
#include "api/server/admission.hpp"
#include "api/server/lane/http2.hpp"
#include "api/server/refusals.hpp"
#include "buses/clock.hpp"
#include "devices/machine.hpp"

namespace axisd::server::lane {

/// So many at once, and so many in a second. Thread: one at a time.
class Allowance {
 public:
  explicit Allowance(double rate) : rate_(rate), left_(rate) {}
  /// False: there is none left now.
  [[nodiscard]] bool take(TimePoint now);

 private:
  double rate_, left_;
  TimePoint refilled_{};
};

/// The calls of StopService: each means what the call of its name means at the main address. Jogs are counted
/// per client, apart from what is counted there; nothing else is.
class StopCalls {
 public:
  /// Makes the answer. Thread: the lane's.
  using Make = std::move_only_function<Answer()>;
  /// Takes it over, once per call. Thread: any; meant for the core.
  using Done = std::function<void(Make make)>;

  /// `machine` outlives this. `access`: nullptr: everybody may do everything. `audit`: as of Refusals.
  explicit StopCalls(Machine& machine, std::shared_ptr<const AccessControl> access = {},
                     AuditSink* audit = nullptr);
  /// For an axis that there is not the one that was probably meant is looked for: among hundreds that takes
  /// longer than a stop. In all, at once and in a second.
  static constexpr double suggestions = 20;

  /// Begins a call; refusals come through `done`, too. Thread: the lane's.
  void start(const Http2::Call& call, const Peer& peer, Done done);

  /// "/axisd.v1.StopService/Stop" and so on, all that are taken.
  [[nodiscard]] static std::vector<std::string_view> paths();

 private:
  Machine& machine_;
  const std::shared_ptr<const AccessControl> access_;
  Refusals refusals_;
  Admission admission_;
  Allowance suggestions_{suggestions};
};

}  // namespace axisd::server::lane
