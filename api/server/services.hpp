// What the services share.
#pragma once

#include <memory>

#include "api/server/admission.hpp"
#include "api/server/callers.hpp"
#include "api/server/open_calls.hpp"
#include "api/server/reply_thread.hpp"
#include "api/server/stall_guard.hpp"
#include "devices/audit.hpp"
#include "devices/configuration_access.hpp"
#include "devices/machine.hpp"
#include "devices/state_copy.hpp"

namespace axisd::server {

class EventHub;
class WatchHub;

/// The calls themselves keep `reply`, `calls` and `guard` alive: a command's callback may come after the
/// server is gone.
struct Services {
  Machine& machine;
  std::shared_ptr<ReplyThread> reply;
  std::shared_ptr<OpenCalls> calls;
  std::shared_ptr<StallGuard> guard;
  Admission& admission;
  Callers& callers;
  WatchHub& hub;
  EventHub& events;
  ConfigurationAccess* configuration;  ///< nullptr: there is none to show
  AuditAccess* audit;                  ///< likewise
  AuditSink* audit_sink;               ///< nullptr: nothing is kept
  StateCopies* state_copies;           ///< nullptr: there are none
};

}  // namespace axisd::server
