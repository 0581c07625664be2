#include "api/server/refusals.hpp"

#include <fmt/format.h>

#include <optional>
#include <string>
#include <utility>

#include "buses/limited_log.hpp"

namespace axisd::server {

void Refusals::tell(const Caller& caller, const google::protobuf::Message& request, const Error& error) {
  auto rpc = rpc_of(request);
  log_limited(spdlog::level::info, caller.identity, "refused calls",
              fmt::format("{} refused: {}", rpc, to_string(error)));
  if (sink_ == nullptr) return;
  const auto now = machine_->now();
  std::optional<std::uint64_t> left_out;
  {
    const std::lock_guard lock(mutex_);
    left_out = ration_.take(caller.identity, now);
  }
  if (!left_out) return;
  auto names = demand_of(request).names;
  sink_->add({.at = machine_->wall(now),
              .uptime = now.time_since_epoch(),
              .content = DeniedCall{.rpc = std::move(rpc),
                                    .client = caller.name,
                                    .axis = names.size() == 1 ? std::move(names.front()) : std::string(),
                                    .error = error,
                                    .left_out = *left_out,
                                    .origin = caller.origin}});
}

}  // namespace axisd::server
