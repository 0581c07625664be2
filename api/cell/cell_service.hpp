// CellService: from gRPC's threads to the core, and back.
#pragma once

#include "api/cell/callers.hpp"
#include "api/cell/cell.hpp"
#include "axisd/cell/v1/cell_service.grpc.pb.h"

namespace axisd::cell {

/// Thread: gRPC's; nothing is decided there but who calls.
class CellServiceImpl final : public v1::CellService::CallbackService {
 public:
  /// All of them outlive the server.
  CellServiceImpl(Cell& cell, const Callers& callers, OpenCalls& calls, const Settings& settings)
      : cell_(cell), callers_(callers), calls_(calls), settings_(settings), core_(cell.executor()) {}

 private:
  template <class Response>
  using Answer = std::function<void(const grpc::Status&, const Response&)>;
  /// A call that the core answers: `work` is given who calls, and the way back.
  template <class Request, class Response>
  grpc::ServerUnaryReactor* serve(grpc::CallbackServerContext* context, const Request* request,
                                  Response* response,
                                  std::function<void(const Caller&, const Request&, Answer<Response>)> work);
  template <class Response>
  grpc::ServerWriteReactor<Response>* stream(
      grpc::CallbackServerContext* context,
      std::function<void(const std::shared_ptr<CoreStream<Response>>&)> begin);

  grpc::ServerUnaryReactor* GetCell(grpc::CallbackServerContext* context, const v1::GetCellRequest* request,
                                    v1::GetCellResponse* response) override;
  grpc::ServerUnaryReactor* ListMachines(grpc::CallbackServerContext* context,
                                         const v1::ListMachinesRequest* request,
                                         v1::ListMachinesResponse* response) override;
  grpc::ServerWriteReactor<v1::WatchMachinesResponse>* WatchMachines(
      grpc::CallbackServerContext* context, const v1::WatchMachinesRequest* request) override;
  grpc::ServerUnaryReactor* StopAll(grpc::CallbackServerContext* context, const v1::StopAllRequest* request,
                                    v1::StopAllResponse* response) override;
  grpc::ServerUnaryReactor* ReleaseStopAll(grpc::CallbackServerContext* context,
                                           const v1::ReleaseStopAllRequest* request,
                                           v1::ReleaseStopAllResponse* response) override;
  grpc::ServerUnaryReactor* MoveGroup(grpc::CallbackServerContext* context,
                                      const v1::MoveGroupRequest* request,
                                      v1::MoveGroupResponse* response) override;
  grpc::ServerWriteReactor<v1::WatchEventsResponse>* WatchEvents(
      grpc::CallbackServerContext* context, const v1::WatchEventsRequest* request) override;
  grpc::ServerUnaryReactor* GetClock(grpc::CallbackServerContext* context, const v1::GetClockRequest* request,
                                     v1::GetClockResponse* response) override;
  grpc::ServerUnaryReactor* ExchangeStopAll(grpc::CallbackServerContext* context,
                                            const v1::ExchangeStopAllRequest* request,
                                            v1::ExchangeStopAllResponse* response) override;

  Cell& cell_;
  const Callers& callers_;
  OpenCalls& calls_;
  const Settings& settings_;
  const boost::asio::any_io_executor core_;
};

}  // namespace axisd::cell
