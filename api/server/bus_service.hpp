#pragma once

#include "api/server/bounded_service.hpp"
#include "api/server/services.hpp"
#include "axisd/v1/bus_service.grpc.pb.h"

namespace axisd::server {

/// BusService: validates, converts, asks the machine. Thread: gRPC.
class BusServiceImpl final : public BoundedService<v1::BusService::CallbackService> {
 public:
  explicit BusServiceImpl(const Services& services);

  using Context = grpc::CallbackServerContext;
  using Reactor = grpc::ServerUnaryReactor;
  Reactor* ListBuses(Context* context, const v1::ListBusesRequest* request,
                     v1::ListBusesResponse* response) override;
  Reactor* GetBudget(Context* context, const v1::GetBudgetRequest* request,
                     v1::GetBudgetResponse* response) override;
  Reactor* ListDevices(Context* context, const v1::ListDevicesRequest* request,
                       v1::ListDevicesResponse* response) override;
  Reactor* WriteDevice(Context* context, const v1::WriteDeviceRequest* request,
                       v1::WriteDeviceResponse* response) override;
  Reactor* Transact(Context* context, const v1::TransactRequest* request,
                    v1::TransactResponse* response) override;
  grpc::ServerWriteReactor<v1::ScanResponse>* Scan(Context* context, const v1::ScanRequest* request) override;

  // bus_watch_calls.cpp
  Reactor* GetBusStatistics(Context* context, const v1::GetBusStatisticsRequest* request,
                            v1::GetBusStatisticsResponse* response) override;
  grpc::ServerWriteReactor<v1::WatchBusStatisticsResponse>* WatchBusStatistics(
      Context* context, const v1::WatchBusStatisticsRequest* request) override;
  grpc::ServerWriteReactor<v1::TraceBusResponse>* TraceBus(Context* context,
                                                           const v1::TraceBusRequest* request) override;
  Reactor* ListFlightRecords(Context* context, const v1::ListFlightRecordsRequest* request,
                             v1::ListFlightRecordsResponse* response) override;
  Reactor* GetFlightRecord(Context* context, const v1::GetFlightRecordRequest* request,
                           v1::GetFlightRecordResponse* response) override;
  Reactor* WriteFlightRecord(Context* context, const v1::WriteFlightRecordRequest* request,
                             v1::WriteFlightRecordResponse* response) override;

 private:
  Reactor* transact_object(Context* context, const v1::TransactRequest* request,
                           v1::TransactResponse* response);

  const Services services_;
};

}  // namespace axisd::server
