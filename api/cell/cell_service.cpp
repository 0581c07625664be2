#include "api/cell/cell_service.hpp"

#include <fmt/format.h>

#include <boost/asio/post.hpp>
#include <utility>

#include "api/cell/status.hpp"
#include "api/transport/patience.hpp"
#include "config/text.hpp"

namespace axisd::cell {
namespace {

grpc::Status refusal_of(const Caller& caller) {
  return to_status(grpc::StatusCode::UNAUTHENTICATED, axisd::v1::REASON_UNAUTHENTICATED,
                   caller.refusal->message, caller.refusal->remedy);
}

grpc::Status too_many(const Caller& caller) {
  return to_status(grpc::StatusCode::RESOURCE_EXHAUSTED, axisd::v1::REASON_BUSY,
                   fmt::format("{} has too many calls open at this entrance", caller.name),
                   "end some of them");
}

/// Goes when gRPC is done with it and the core has answered, whichever is later.
class Answering final : public grpc::ServerUnaryReactor {
 public:
  explicit Answering(std::function<void()> done) : done_(std::move(done)) {}
  static std::shared_ptr<Answering> make(std::function<void()> done) {
    auto answering = std::make_shared<Answering>(std::move(done));
    answering->self_ = answering;
    return answering;
  }

 private:
  void OnDone() override {
    if (done_) done_();
    const auto last = std::move(self_);
  }
  std::function<void()> done_;
  std::shared_ptr<Answering> self_;
};

}  // namespace

template <class Request, class Response>
grpc::ServerUnaryReactor* CellServiceImpl::serve(
    grpc::CallbackServerContext* context, const Request* request, Response* response,
    std::function<void(const Caller&, const Request&, Answer<Response>)> work) {
  const auto caller = callers_.of(*context);
  constexpr auto kind =
      std::is_same_v<Request, v1::StopAllRequest> ? OpenCalls::Kind::stop : OpenCalls::Kind::counted;
  if (caller.refusal || !calls_.enter(caller.name, kind)) {
    auto* const reactor = context->DefaultReactor();
    reactor->Finish(caller.refusal ? refusal_of(caller) : too_many(caller));
    return reactor;
  }
  auto answering = Answering::make([this, name = caller.name] { calls_.leave(name, kind); });
  boost::asio::post(core_, [caller, asked = *request, response, answering, work = std::move(work)] {
    // Until Finish gRPC keeps the response, also of a call whose caller is gone.
    work(caller, asked, [response, answering](const grpc::Status& status, const Response& answer) {
      if (status.ok()) *response = answer;
      answering->Finish(status);
    });
  });
  return answering.get();
}

template <class Response>
grpc::ServerWriteReactor<Response>* CellServiceImpl::stream(
    grpc::CallbackServerContext* context,
    std::function<void(const std::shared_ptr<CoreStream<Response>>&)> begin) {
  const auto caller = callers_.of(*context);
  if (caller.refusal || !calls_.enter(caller.name, OpenCalls::Kind::counted))
    return CoreStream<Response>::make(
        core_, {}, [status = caller.refusal ? refusal_of(caller) : too_many(caller)](const auto& stream) {
          stream->finish(status);
        });
  return CoreStream<Response>::make(
      core_, [this, name = caller.name] { calls_.leave(name, OpenCalls::Kind::counted); }, std::move(begin));
}

grpc::ServerUnaryReactor* CellServiceImpl::GetCell(grpc::CallbackServerContext* context,
                                                   const v1::GetCellRequest* request,
                                                   v1::GetCellResponse* response) {
  return serve<v1::GetCellRequest, v1::GetCellResponse>(
      context, request, response,
      [this](const Caller& caller, const v1::GetCellRequest&, const Answer<v1::GetCellResponse>& answer) {
        answer(grpc::Status::OK, cell_.get(caller));
      });
}

grpc::ServerUnaryReactor* CellServiceImpl::ListMachines(grpc::CallbackServerContext* context,
                                                        const v1::ListMachinesRequest* request,
                                                        v1::ListMachinesResponse* response) {
  return serve<v1::ListMachinesRequest, v1::ListMachinesResponse>(
      context, request, response,
      [this](const Caller&, const v1::ListMachinesRequest&, const Answer<v1::ListMachinesResponse>& answer) {
        answer(grpc::Status::OK, cell_.list());
      });
}

grpc::ServerWriteReactor<v1::WatchMachinesResponse>* CellServiceImpl::WatchMachines(
    grpc::CallbackServerContext* context, const v1::WatchMachinesRequest* /*request*/) {
  return stream<v1::WatchMachinesResponse>(context,
                                           [this](const auto& stream) { cell_.watch_machines(stream); });
}

grpc::ServerUnaryReactor* CellServiceImpl::StopAll(grpc::CallbackServerContext* context,
                                                   const v1::StopAllRequest* request,
                                                   v1::StopAllResponse* response) {
  return serve<v1::StopAllRequest, v1::StopAllResponse>(
      context, request, response,
      [this](const Caller& caller, const v1::StopAllRequest& asked,
             const Answer<v1::StopAllResponse>& answer) {
        cell_.stop_all(caller, asked.reason(),
                       [answer](const v1::StopAllResponse& stopped) { answer(grpc::Status::OK, stopped); });
      });
}

grpc::ServerUnaryReactor* CellServiceImpl::ReleaseStopAll(grpc::CallbackServerContext* context,
                                                          const v1::ReleaseStopAllRequest* request,
                                                          v1::ReleaseStopAllResponse* response) {
  return serve<v1::ReleaseStopAllRequest, v1::ReleaseStopAllResponse>(
      context, request, response,
      [this](const Caller& caller, const v1::ReleaseStopAllRequest&,
             const Answer<v1::ReleaseStopAllResponse>& answer) { cell_.release_stop_all(caller, answer); });
}

grpc::ServerUnaryReactor* CellServiceImpl::MoveGroup(grpc::CallbackServerContext* context,
                                                     const v1::MoveGroupRequest* request,
                                                     v1::MoveGroupResponse* response) {
  const auto patience = transport::patience_of(*context);
  const auto start_by = patience ? monotonic_now() + *patience : TimePoint::max();
  return serve<v1::MoveGroupRequest, v1::MoveGroupResponse>(
      context, request, response,
      [this, start_by](const Caller& caller, const v1::MoveGroupRequest& asked,
                       const Answer<v1::MoveGroupResponse>& answer) {
        cell_.move_group(caller, asked, start_by, answer);
      });
}

grpc::ServerWriteReactor<v1::WatchEventsResponse>* CellServiceImpl::WatchEvents(
    grpc::CallbackServerContext* context, const v1::WatchEventsRequest* request) {
  return stream<v1::WatchEventsResponse>(
      context, [this, asked = *request](const auto& stream) { cell_.watch_events(stream, asked); });
}

grpc::ServerUnaryReactor* CellServiceImpl::GetClock(grpc::CallbackServerContext* context,
                                                    const v1::GetClockRequest* request,
                                                    v1::GetClockResponse* response) {
  return serve<v1::GetClockRequest, v1::GetClockResponse>(
      context, request, response,
      [this](const Caller&, const v1::GetClockRequest&, const Answer<v1::GetClockResponse>& answer) {
        answer(grpc::Status::OK, cell_.read_clock());
      });
}

grpc::ServerUnaryReactor* CellServiceImpl::ExchangeStopAll(grpc::CallbackServerContext* context,
                                                           const v1::ExchangeStopAllRequest* request,
                                                           v1::ExchangeStopAllResponse* response) {
  return serve<v1::ExchangeStopAllRequest, v1::ExchangeStopAllResponse>(
      context, request, response,
      [this](const Caller& caller, const v1::ExchangeStopAllRequest& asked,
             const Answer<v1::ExchangeStopAllResponse>& answer) {
        if (!callers_.is_entrance(caller))
          return answer(to_status(grpc::StatusCode::PERMISSION_DENIED, axisd::v1::REASON_ACCESS_DENIED,
                                  fmt::format("{} is no entrance of the cell {}",
                                              config::printable(caller.name), settings_.cell),
                                  fmt::format("entrances show the name cell.{}", settings_.cell)),
                        {});
        if (asked.cell() != settings_.cell)
          return answer(to_status(grpc::StatusCode::FAILED_PRECONDITION, axisd::v1::REASON_INVALID_ARGUMENT,
                                  fmt::format("this is the cell {}", settings_.cell),
                                  "correct `cell`, or the address of the entrance"),
                        {});
        answer(grpc::Status::OK, cell_.exchange(asked));
      });
}

}  // namespace axisd::cell
