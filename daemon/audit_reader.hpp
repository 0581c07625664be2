#pragma once

#include <filesystem>

#include "daemon/bounded_worker.hpp"
#include "daemon/store/audit_log.hpp"
#include "devices/audit.hpp"

namespace axisd {

/// Reads the files of the audit on a thread of its own, one look after the other. Thread: any.
class AuditReader final : public AuditAccess {
 public:
  /// `log` writes into this directory, and outlives it.
  AuditReader(std::filesystem::path directory, store::AuditLog& log);
  void look(std::uint64_t after, WallTime since, Visit visit,
            std::function<void(Result<AuditSeen>)> done) override;

 private:
  const std::filesystem::path directory_;
  store::AuditLog* log_;
  BoundedWorker worker_;
};

}  // namespace axisd
