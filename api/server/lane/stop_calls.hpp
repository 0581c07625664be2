// What the stop lane takes.
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "api/server/admission.hpp"
#include "api/server/lane/http2.hpp"
#include "devices/machine.hpp"

namespace axisd::server::lane {

/// The calls of StopService: each means what the call of its name means at the main address. Jogs are counted
/// per client, apart from what is counted there; nothing else is.
class StopCalls {
 public:
  /// Makes the answer. Thread: the lane's.
  using Make = std::move_only_function<Answer()>;
  /// Takes it over, once per call. Thread: any; meant for the core.
  using Done = std::function<void(Make make)>;

  /// `machine` outlives this.
  explicit StopCalls(Machine& machine) : machine_(machine), admission_({}) {}

  /// Begins a call; refusals come through `done`, too. Thread: the lane's.
  void start(const Http2::Call& call, const std::string& client, Done done);

  /// "/axisd.v1.StopService/Stop" and so on, all that are taken.
  [[nodiscard]] static std::vector<std::string_view> paths();

 private:
  Machine& machine_;
  Admission admission_;
};

}  // namespace axisd::server::lane
