// Reading a stream until somebody has had enough of it.
#pragma once

#include <functional>
#include <memory>
#include <string_view>

#include "api/axisctl/client.hpp"
#include "api/axisctl/interrupt.hpp"

namespace axisd::axisctl {

/// Gives each message to `take` until that returns false, or Ctrl-C: this is how one leaves a stream without
/// end. `subject` leads the text of errors. Throws Failure.
template <class Response, class Stub, class Request>
void follow(const Client& client,
            std::unique_ptr<grpc::ClientReader<Response>> (Stub::*method)(grpc::ClientContext*,
                                                                          const Request&),
            const Request& request, std::string_view subject,
            const std::function<bool(const Response&)>& take) {
  grpc::ClientContext context;
  const Interrupt interrupt([&context] { context.TryCancel(); });
  auto stream = client.stream(context, method, request);
  bool enough = false;
  for (Response message; !enough && stream.read(message);) enough = !take(message);
  if (enough) context.TryCancel();
  const auto status = stream.finish();
  if (enough || interrupt.requested()) return;
  if (status.ok()) throw Failure(ExitCode::unreachable, "the daemon ended the stream");
  throw client.failure(status, subject);
}

}  // namespace axisd::axisctl
