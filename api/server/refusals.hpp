#pragma once

#include <google/protobuf/message.h>

#include <mutex>

#include "api/server/access.hpp"
#include "devices/audit.hpp"
#include "devices/audit_ration.hpp"
#include "devices/machine.hpp"

namespace axisd::server {

/// Tells the log and the audit of calls that their clients may not make, of each identity so many in a
/// minute. Thread: any.
class Refusals {
 public:
  /// `machine` outlives this; so does `sink`, which may be null: nothing is kept.
  Refusals(const Machine& machine, AuditSink* sink) : machine_(&machine), sink_(sink) {}
  void tell(const Caller& caller, const google::protobuf::Message& request, const Error& error);

 private:
  const Machine* machine_;
  AuditSink* sink_;
  std::mutex mutex_;
  Ration ration_{audit_ration::refusals};  ///< of identities; under mutex_
};

}  // namespace axisd::server
