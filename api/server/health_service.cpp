#include "api/server/health_service.hpp"

#include <grpcpp/impl/codegen/proto_utils.h>
#include <grpcpp/impl/codegen/server_callback_handlers.h>
#include <grpcpp/impl/rpc_service_method.h>

#include <algorithm>
#include <memory>
#include <utility>

#include "api/server/pending_call.hpp"
#include "api/server/reply_stream.hpp"
#include "api/server/status.hpp"

namespace axisd::server {
namespace {

/// Of HealthCheckResponse.
enum class Serving : std::int32_t { serving = 1, not_serving = 2, service_unknown = 3 };

/// Says it once: what the daemon is changes with its end only, which ends the stream.
class HealthWatch final : public ReplyStream<google::protobuf::Int32Value> {
 public:
  HealthWatch(const Services& services, grpc::CallbackServerContext* context, Admission::Ticket ticket,
              Serving serving)
      : ReplyStream(services, context, std::move(ticket)), serving_(serving) {}

  void begin() {
    reply().post([this, stream = shared_from_this()] { go_on(); });
  }

 private:
  bool next(google::protobuf::Int32Value& to) override {
    if (std::exchange(said_, true)) return false;
    to.set_value(std::to_underlying(serving_));
    return true;
  }
  void release() override {}

  const Serving serving_;
  bool said_ = false;
};

}  // namespace

HealthService::HealthService(const Services& services) : services_(services) {
  using grpc::internal::RpcMethod;
  AddMethod(
      new grpc::internal::RpcServiceMethod("/grpc.health.v1.Health/Check", RpcMethod::NORMAL_RPC, nullptr));
  MarkMethodCallback(0, new grpc::internal::CallbackUnaryHandler<Request, Response>(
                            [this](Context* context, const Request* request, Response* response) {
                              return check(context, *request, *response);
                            }));
  AddMethod(new grpc::internal::RpcServiceMethod("/grpc.health.v1.Health/Watch", RpcMethod::SERVER_STREAMING,
                                                 nullptr));
  MarkMethodCallback(
      1, new grpc::internal::CallbackServerStreamingHandler<Request, Response>(
             [this](Context* context, const Request* request) { return watch(context, *request); }));
}

bool HealthService::knows(const std::string& service) const {
  return service.empty() || std::ranges::find(names_, service) != names_.end();
}

grpc::ServerUnaryReactor* HealthService::check(Context* context, const Request& request, Response& response) {
  if (!knows(request.value()))
    return answer(context, {grpc::StatusCode::NOT_FOUND, "there is no such service"});
  response.set_value(std::to_underlying(ending_ ? Serving::not_serving : Serving::serving));
  return answer(context, grpc::Status::OK);
}

grpc::ServerWriteReactor<HealthService::Response>* HealthService::watch(Context* context,
                                                                        const Request& request) {
  auto ticket =
      services_.admission.admit(services_.callers.peer_of(*context).name, Admission::Kind::health_watch);
  if (!ticket) return new RefusedStream<Response>(to_status(ticket.error()));
  const auto serving = knows(request.value()) ? Serving::serving : Serving::service_unknown;
  const auto stream = std::make_shared<HealthWatch>(services_, context, *std::move(ticket), serving);
  if (!stream->open()) return new RefusedStream<Response>(shutting_down());
  stream->begin();
  return stream.get();
}

}  // namespace axisd::server
