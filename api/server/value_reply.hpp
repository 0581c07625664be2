// Values as answers.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>

#include "api/server/reply.hpp"
#include "api/server/status.hpp"
#include "buses/limited_log.hpp"

namespace axisd::server {

/// The callback that ends `call`: with the value, given to `fill` on the reply thread while the response
/// exists, or with the error's status. `what` ("unix:anna: feeder save_parameters", first who asked) is
/// logged with the outcome, also if the client has left; empty: nothing is logged.
template <class Value, class Fill>
[[nodiscard]] std::function<void(Result<Value>)> reply_with_value(ReplyPtr call, Fill fill,
                                                                  std::string what = {}) {
  return [call = std::move(call), fill = std::move(fill), what = std::move(what)](Result<Value> result) {
    // On the core thread: nothing but handing over.
    const auto shared = std::make_shared<const Result<Value>>(std::move(result));
    call->complete(
        [fill, shared]() -> grpc::Status {
          if (!*shared) return to_status(shared->error());
          if constexpr (std::is_void_v<Value>) {
            fill();
          } else {
            fill(**shared);
          }
          return grpc::Status::OK;
        },
        [what, shared] {
          if (what.empty()) return;
          const auto end_of_client = std::min(what.find(": "), what.size());
          const auto client = std::string_view(what).substr(0, end_of_client);
          const auto rest = std::string_view(what).substr(std::min(end_of_client + 2, what.size()));
          log_limited(spdlog::level::info, client, *shared ? "calls" : "refused calls",
                      fmt::format("{}: {}", rest, *shared ? "done" : to_string(shared->error())));
        });
  };
}

}  // namespace axisd::server
