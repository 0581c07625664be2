#include "api/transport/patience.hpp"

#include <algorithm>
#include <chrono>
#include <cstdint>

namespace axisd::transport {

std::optional<Duration> patience_of(const grpc::CallbackServerContext& context) {
  const auto deadline = context.raw_deadline();
  if (gpr_time_cmp(deadline, gpr_inf_future(deadline.clock_type)) == 0) return std::nullopt;
  const auto left = gpr_time_sub(deadline, gpr_now(deadline.clock_type));
  constexpr std::int64_t day = 24L * 3600;
  return std::chrono::seconds(std::clamp<std::int64_t>(left.tv_sec, -day, day)) +
         std::chrono::nanoseconds(left.tv_nsec);
}

}  // namespace axisd::transport
