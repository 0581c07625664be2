// What the services share.
#pragma once

#include <memory>

#include "api/server/admission.hpp"
#include "api/server/open_calls.hpp"
#include "api/server/reply_thread.hpp"
#include "devices/machine.hpp"

namespace axisd::server {

class WatchHub;

/// The calls themselves keep `reply` and `calls` alive: a command's callback may come after the server is
/// gone.
struct Services {
  Machine& machine;
  std::shared_ptr<ReplyThread> reply;
  std::shared_ptr<OpenCalls> calls;
  Admission& admission;
  WatchHub& hub;
};

}  // namespace axisd::server
