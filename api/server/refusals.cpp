#include "api/server/refusals.hpp"

#include <fmt/format.h>

#include <optional>
#include <string>
#include <utility>

#include "api/server/audit_calls.hpp"
#include "buses/limited_log.hpp"

namespace axisd::server {
namespace {

/// What the request says in this field; empty: nothing, or it has no such field.
std::string named(const google::protobuf::Message& request, const char* name) {
  using google::protobuf::FieldDescriptor;
  const auto* field = request.GetDescriptor()->FindFieldByName(name);
  if (field == nullptr || field->is_repeated() || field->cpp_type() != FieldDescriptor::CPPTYPE_STRING)
    return {};
  return request.GetReflection()->GetString(request, field);
}

}  // namespace

void Refusals::tell(const Caller& caller, const google::protobuf::Message& request, const Error& error) {
  auto rpc = rpc_of(request);
  log_limited(spdlog::level::info, caller.identity, "refused calls",
              fmt::format("{} refused: {}", rpc, to_string(error)), LogKind::call_denied,
              {.client = caller.name});
  if (sink_ == nullptr) return;
  std::optional<std::uint64_t> left_out;
  {
    const std::lock_guard lock(mutex_);
    left_out = ration_.take(caller.identity, machine_->now());
  }
  if (!left_out) return;
  auto group = named(request, "group");
  auto names = demand_of(request).names;
  const bool one = names.size() == 1 && group.empty();
  record(*machine_, sink_,
         DeniedCall{.rpc = std::move(rpc),
                    .client = caller.name,
                    .axis = one ? std::move(names.front()) : std::string(),
                    .group = std::move(group),
                    .bus = named(request, "bus"),
                    .error = error,
                    .left_out = *left_out,
                    .origin = caller.origin});
}

}  // namespace axisd::server
