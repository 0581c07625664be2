#include "daemon/audit_reader.hpp"

#include <memory>
#include <utility>

namespace axisd {

namespace {

/// Looks that may wait for others.
constexpr std::size_t most_looks = 8;
/// That one of them shows: some 50 ms.
constexpr std::size_t most_records = 4'000;

}  // namespace

AuditReader::AuditReader(std::filesystem::path directory, store::AuditLog& log)
    : directory_(std::move(directory)), log_(&log), worker_(most_looks) {}

void AuditReader::look(std::uint64_t after, WallTime since, Visit visit,
                       std::function<void(Result<AuditSeen>)> done) {
  const auto shared = std::make_shared<std::function<void(Result<AuditSeen>)>>(std::move(done));
  const bool taken = worker_.post([this, after, since, visit = std::move(visit), shared] {
    log_->write_all();
    (*shared)(store::look_at_audit(directory_, after, log_->newest(), since, most_records, visit));
  });
  if (!taken)
    (*shared)(fail(Reason::busy, "several clients read the audit already", "repeat the call in a moment"));
}

}  // namespace axisd
