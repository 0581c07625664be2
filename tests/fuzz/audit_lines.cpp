// Lines of the audit's files, as a disk may give them back, and what ListAudit makes of them.
#include "api/server/audit_convert.hpp"
#include "tests/fuzz/target.hpp"

namespace axisd::fuzz {

void run(Input input) {
  const auto asked = input.take(input.byte() % 32U);
  const auto line = text(input.rest());
  if (const auto command = server::told_command(line)) expect(!command->id.empty(), "a command has an id");
  const auto record = server::audit_record(line);
  if (!record) return;
  v1::ListAuditRequest request;
  (void)request.ParseFromArray(asked.data(), static_cast<int>(asked.size()));
  (void)server::AuditFilter(request).passes(*record);
  const auto written = server::audit_line(*record);
  expect(written.find('\n') == std::string::npos, "a record is one line");
  const auto again = server::audit_record(written);
  expect(again && server::audit_line(*again) == written, "a record survives being written");
}

}  // namespace axisd::fuzz
