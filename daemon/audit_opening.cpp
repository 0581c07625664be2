#include "daemon/audit_opening.hpp"

#include <chrono>
#include <optional>
#include <string_view>
#include <utility>

#include "api/server/audit_convert.hpp"

namespace axisd {

std::filesystem::path audit_directory(const config::Configuration& configuration) {
  return std::filesystem::path(configuration.state_directory) / "audit";
}

std::unique_ptr<store::AuditLog> open_audit(const config::Configuration& configuration,
                                            store::KeptState& state, const std::string& instance_id,
                                            std::string revision) {
  const auto encode = [](const store::AuditHead& head, const AuditEntry& entry) {
    v1::AuditRecord record;
    server::to_proto(entry, record);
    record.set_number(head.number);
    record.set_instance_id(head.instance_id);
    record.set_revision(head.revision);
    return server::audit_line(record);
  };
  const auto command_of = [](std::string_view line) -> std::optional<store::AuditFormat::Told> {
    auto told = server::told_command(line);
    if (!told) return std::nullopt;
    return store::AuditFormat::Told{.id = std::move(told->id), .ended = told->ended};
  };
  const auto& keys = configuration.audit;
  return std::make_unique<store::AuditLog>(
      store::AuditOptions{.directory = audit_directory(configuration),
                          .bounds = {.files = static_cast<std::size_t>(keys.files),
                                     .file_bytes = static_cast<std::uint64_t>(keys.file_size) * 1024},
                          .format = {.encode = encode, .command_of = command_of},
                          .instance_id = instance_id,
                          .revision = std::move(revision),
                          .earlier = store::recovered(state.journal().loaded())});
}

void record_run(store::AuditLog& audit, store::KeptState& state, DaemonRun::What what) {
  audit.add({.at = std::chrono::system_clock::now(),
             .uptime = monotonic_now().time_since_epoch(),
             .content = DaemonRun{
                 .what = what, .version = AXISD_VERSION, .start_count = state.state().loaded().start_count}});
}

}  // namespace axisd
