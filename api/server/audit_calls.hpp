// How the audit is told of calls: of those that change something and are no commands, twice.
#pragma once

#include <functional>
#include <utility>

#include "api/server/services.hpp"
#include "devices/audit.hpp"

namespace axisd::server {

/// `sink` may be null.
inline void record(const Machine& machine, AuditSink* sink, AuditContent content) {
  if (sink == nullptr) return;
  const auto now = machine.now();
  sink->add({.at = machine.wall(now), .uptime = now.time_since_epoch(), .content = std::move(content)});
}

/// Tells the audit of `call` now, before anything is sent for it, and again when it has ended; then calls
/// back.
template <class T>
[[nodiscard]] std::function<void(Result<T>)> audited(const Services& services, AuditedCall call,
                                                     std::function<void(Result<T>)> callback) {
  auto* sink = services.audit_sink;
  record(services.machine, sink, call);
  return [machine = &services.machine, sink, call = std::move(call),
          callback = std::move(callback)](Result<T> result) mutable {
    call.phase = result ? AuditedCall::Phase::done : AuditedCall::Phase::failed;
    if (!result) call.error = result.error();
    record(*machine, sink, call);
    callback(std::move(result));
  };
}

}  // namespace axisd::server
