// The way from gRPC to every call.
#pragma once

#include <grpcpp/support/server_callback.h>

#include "api/server/bounds.hpp"
#include "api/server/pending_call.hpp"
#include "api/server/reply_stream.hpp"
#include "api/server/status.hpp"

namespace axisd::server {

/// A generated service whose calls begin only with requests that are within their bounds, and that their
/// clients may make. Whoever derives from it hands all of its calls to begin_within_bounds() once, in its
/// constructor. Thread: gRPC.
template <class Service>
class BoundedService : public Service {
 protected:
  using Context = grpc::CallbackServerContext;

  explicit BoundedService(const Services& services) : callers_(services.callers) {}

  /// Whose the call is: of its commands, holds, leases and quotas, and in the log.
  [[nodiscard]] std::string client_of(const Context& context) const { return callers_.of(context).name; }
  /// The same with where it comes from, which the audit tells of what it changes.
  [[nodiscard]] Caller who_asks(const Context& context, const google::protobuf::Message& request) const {
    return callers_.of(context, request);
  }

  /// What stands before each call.
  [[nodiscard]] Result<void> admit(const Context& context, const google::protobuf::Message& request) {
    if (auto within = check_bounds(request); !within) return within;
    return callers_.admit(context, request);
  }

  /// In any order. A call that answers in raw bytes is not among them: it has to admit() what it parses.
  template <class... Calls>
  void begin_within_bounds(Calls... calls) {
    (begin(calls), ...);
  }

 private:
  template <class Impl, class Request, class Response>
  void begin(grpc::ServerUnaryReactor* (Impl::*call)(Context*, const Request*, Response*)) {
    this->MarkMethodCallback(index_of<Request>(),
                             new grpc::internal::CallbackUnaryHandler<Request, Response>(
                                 [this, call](Context* context, const Request* request,
                                              Response* response) -> grpc::ServerUnaryReactor* {
                                   if (const auto may = admit(*context, *request); !may)
                                     return answer(context, to_status(may.error()));
                                   return (static_cast<Impl*>(this)->*call)(context, request, response);
                                 }));
  }

  template <class Impl, class Request, class Response>
  void begin(grpc::ServerWriteReactor<Response>* (Impl::*call)(Context*, const Request*)) {
    this->MarkMethodCallback(
        index_of<Request>(),
        new grpc::internal::CallbackServerStreamingHandler<Request, Response>(
            [this, call](Context* context, const Request* request) -> grpc::ServerWriteReactor<Response>* {
              if (const auto may = admit(*context, *request); !may)
                return new RefusedStream<Response>(to_status(may.error()));
              return (static_cast<Impl*>(this)->*call)(context, request);
            }));
  }

  /// Of the call with this request: each call of a service has a request of its own, in the same file.
  template <class Request>
  static int index_of() {
    const auto* type = Request::descriptor();
    const auto* service = type->file()->service(0);
    for (int i = 0; i < service->method_count(); ++i)
      if (service->method(i)->input_type() == type) return i;
    return -1;
  }

  Callers& callers_;
};

}  // namespace axisd::server
