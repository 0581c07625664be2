#include "api/cell/machine_link.hpp"

#include <grpcpp/create_channel.h>

#include <utility>

#include "api/transport/channel.hpp"
#include "config/text.hpp"

namespace axisd::cell {
namespace {

/// A GetInfo is answered from what an axisd has in memory.
constexpr Duration who_patience = std::chrono::milliseconds(1500);

grpc::Status unknown_entrance() {
  return {grpc::StatusCode::UNAVAILABLE, "it is not known where its entrance is"};
}

}  // namespace

bool is_for_another(const grpc::Status& status) {
  return status.error_code() == grpc::StatusCode::UNIMPLEMENTED ||
         (!status.ok() && status.error_details().empty() &&
          status.error_code() != grpc::StatusCode::DEADLINE_EXCEEDED);
}

MachineLink::MachineLink(boost::asio::any_io_executor core, std::shared_ptr<grpc::ChannelCredentials> trusted,
                         Addresses addresses)
    : core_(std::move(core)), trusted_(std::move(trusted)), addresses_(std::move(addresses)) {
  connect_main();
  connect_others();
}

std::shared_ptr<grpc::ChannelCredentials> MachineLink::trusted_at(const std::string& address) const {
  // An axisd has no TLS on a unix socket: the kernel says who is there.
  return address.starts_with("unix:") ? grpc::InsecureChannelCredentials() : trusted_;
}

void MachineLink::connect_main() {
  ++*turn_;
  was_ready_ = false;
  main_ = grpc::CreateCustomChannel(addresses_.axisd, trusted_at(addresses_.axisd),
                                    transport::client_arguments());
}

void MachineLink::connect_others() {
  const auto channel_to = [&](const std::string& address) -> std::shared_ptr<grpc::Channel> {
    if (address.empty()) return nullptr;
    return grpc::CreateCustomChannel(address, trusted_at(address), transport::client_arguments());
  };
  lane_ = channel_to(addresses_.stop);
  cell_ = channel_to(addresses_.cell);
  warming_ = false;
}

void MachineLink::move_to(Addresses addresses, std::shared_ptr<grpc::ChannelCredentials> trusted) {
  addresses_ = std::move(addresses);
  trusted_ = std::move(trusted);
  connect_main();
  connect_others();
}

void MachineLink::ask_who(bool anew, std::function<void(Answer)> done) {
  if (anew) connect_main();
  const auto asked_at = monotonic_now();
  ask<axisd::v1::GetInfoResponse>(
      core_, main_,
      // An entrance in place of an axisd is found out by the hop: it passes nothing on twice.
      {.path = "/axisd.v1.SystemService/GetInfo", .timeout = who_patience, .metadata = {{"axisd-hops", "1"}}},
      axisd::v1::GetInfoRequest(),
      [done = std::move(done), asked_at, turn = std::weak_ptr(turn_), number = *turn_](
          const grpc::Status& status, const axisd::v1::GetInfoResponse& info) {
        const auto present = turn.lock();
        if (!present || *present != number) return;
        if (status.ok())
          return done({.kind = Answer::Kind::good,
                       .said = {.machine = info.machine(),
                                .instance_id = info.instance_id(),
                                .version = info.version(),
                                .inhibited = info.inhibited(),
                                .round_trip = monotonic_now() - asked_at}});
        const bool late = status.error_code() == grpc::StatusCode::DEADLINE_EXCEEDED;
        done({.kind = late ? Answer::Kind::late : Answer::Kind::failed,
              .why = late ? std::string("axisd does not answer in time")
                          : config::printable(status.error_message(), 200)});
      });
}

bool MachineLink::has_been_lost() {
  const bool ready = main_->GetState(false) == GRPC_CHANNEL_READY;
  return std::exchange(was_ready_, ready) && !ready;
}

void MachineLink::warm_lane() {
  if (!lane_ || warming_ || lane_->GetState(true) == GRPC_CHANNEL_READY) return;
  warming_ = true;
  // A call that there is not: gRPC looks at its sockets only once there was a call.
  ask<axisd::v1::GetInfoResponse>(
      core_, lane_,
      {.path = "/axisd.v1.StopService/Nothing", .timeout = std::chrono::seconds(1), .metadata = {}},
      axisd::v1::GetInfoRequest(),
      [this, turn = std::weak_ptr(turn_)](const grpc::Status&, const axisd::v1::GetInfoResponse&) {
        if (!turn.expired()) warming_ = false;
      });
}

void MachineLink::stop_all(const Metadata& metadata, Duration timeout, Stopped done) {
  ask_lane_first<axisd::v1::StopAllResponse>(core_, way(), "SystemService",
                                             {.path = "StopAll", .timeout = timeout, .metadata = metadata},
                                             axisd::v1::StopAllRequest(), std::move(done));
}

void MachineLink::release_stop_all(const Metadata& metadata, Duration timeout,
                                   std::function<void(const grpc::Status&)> done) {
  ask<axisd::v1::ReleaseStopAllResponse>(
      core_, main_,
      {.path = "/axisd.v1.SystemService/ReleaseStopAll", .timeout = timeout, .metadata = metadata},
      axisd::v1::ReleaseStopAllRequest(),
      [done = std::move(done)](const grpc::Status& status, const axisd::v1::ReleaseStopAllResponse&) {
        done(status);
      });
}

void MachineLink::read_clock(Duration timeout, ClockRead done) {
  if (!cell_) return done(unknown_entrance(), {});
  ask<v1::GetClockResponse>(
      core_, cell_, {.path = "/axisd.cell.v1.CellService/GetClock", .timeout = timeout, .metadata = {}},
      v1::GetClockRequest(), std::move(done));
}

void MachineLink::exchange(const v1::ExchangeStopAllRequest& request, Duration timeout, Exchanged done) {
  if (!cell_) return done(unknown_entrance(), {});
  ask<v1::ExchangeStopAllResponse>(
      core_, cell_,
      {.path = "/axisd.cell.v1.CellService/ExchangeStopAll", .timeout = timeout, .metadata = {}}, request,
      std::move(done));
}

}  // namespace axisd::cell
