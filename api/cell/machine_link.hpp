// The warm connections to one machine: its axisd, its axisd's stop lane, its entrance.
#pragma once

#include <fmt/format.h>
#include <grpcpp/channel.h>
#include <grpcpp/generic/generic_stub.h>
#include <grpcpp/security/credentials.h>

#include <boost/asio/any_io_executor.hpp>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <string_view>

#include "api/cell/ask.hpp"
#include "api/cell/peer_machine.hpp"
#include "axisd/cell/v1/cell_service.pb.h"
#include "axisd/v1/system_service.pb.h"
#include "buses/clock.hpp"

namespace axisd::cell {

/// Where a machine is. Empty: not known.
struct Addresses {
  std::string axisd, stop, cell;
  friend bool operator==(const Addresses&, const Addresses&) = default;
};

/// What gRPC's threads need to pass a call on. Thread: any.
struct Way {
  std::shared_ptr<grpc::Channel> main, lane;
  [[nodiscard]] bool lane_is_ready() const { return lane && lane->GetState(true) == GRPC_CHANNEL_READY; }
};

/// Another address may take what this one does not. What an axisd itself says has details.
[[nodiscard]] bool is_for_another(const grpc::Status& status);

/// Asks a machine's stop lane, and where that does not take it, its main address. `question.path`: the name
/// of the call alone, of StopService there and of `service` here. Thread: core.
template <class Response, class Done>
void ask_lane_first(const boost::asio::any_io_executor& core, const Way& way, const std::string& service,
                    const Question& question, const google::protobuf::MessageLite& request,
                    const Done& done) {
  const auto until = monotonic_now() + question.timeout;
  const auto of = [question](std::string_view of_service, Duration left) {
    return Question{.path = fmt::format("/axisd.v1.{}/{}", of_service, question.path),
                    .timeout = left,
                    .metadata = question.metadata};
  };
  if (!way.lane_is_ready())
    return ask<Response>(core, way.main, of(service, question.timeout), request, done);
  ask_bytes(core, way.lane, of("StopService", question.timeout), to_buffer(request),
            [core, main = way.main, of, service, until, done, bytes = to_buffer(request)](
                const grpc::Status& status, const grpc::ByteBuffer& answer) {
              const auto left = until - monotonic_now();
              if (is_for_another(status) && left > Duration::zero())
                return ask_bytes(core, main, of(service, left), bytes, reading<Response>(done));
              reading<Response>(done)(status, answer);
            });
}

/// Thread: core.
class MachineLink {
 public:
  /// What came of a question.
  struct Answer {
    enum class Kind : std::uint8_t { good, late, failed } kind;
    PeerAnswer said{};  ///< of good
    std::string why{};  ///< of the others
  };

  MachineLink(boost::asio::any_io_executor core, std::shared_ptr<grpc::ChannelCredentials> trusted,
              Addresses addresses);

  /// Other addresses, or other certificates: everything is connected anew.
  void move_to(Addresses addresses, std::shared_ptr<grpc::ChannelCredentials> trusted);
  [[nodiscard]] const Addresses& addresses() const { return addresses_; }

  /// Asks the axisd who it is. `anew`: over another connection. An answer to an earlier question is not told.
  void ask_who(bool anew, std::function<void(Answer)> done);
  /// A connection that was there has ended since the last call of this. To be looked at a few times a second.
  [[nodiscard]] bool has_been_lost();
  /// Keeps the stop lane connected.
  void warm_lane();

  [[nodiscard]] Way way() const { return {.main = main_, .lane = lane_}; }

  using Stopped = std::function<void(const grpc::Status&, const axisd::v1::StopAllResponse&)>;
  /// StopAll, by the stop lane, and where that does not take it, by the main address. `metadata`: whom for.
  void stop_all(const Metadata& metadata, Duration timeout, Stopped done);
  void release_stop_all(const Metadata& metadata, Duration timeout,
                        std::function<void(const grpc::Status&)> done);
  using ClockRead = std::function<void(const grpc::Status&, const v1::GetClockResponse&)>;
  /// Of its entrance.
  void read_clock(Duration timeout, ClockRead done);
  using Exchanged = std::function<void(const grpc::Status&, const v1::ExchangeStopAllResponse&)>;
  /// With its entrance.
  void exchange(const v1::ExchangeStopAllRequest& request, Duration timeout, Exchanged done);

 private:
  void connect_main();
  void connect_others();
  [[nodiscard]] std::shared_ptr<grpc::ChannelCredentials> trusted_at(const std::string& address) const;

  boost::asio::any_io_executor core_;
  std::shared_ptr<grpc::ChannelCredentials> trusted_;
  Addresses addresses_;
  std::shared_ptr<grpc::Channel> main_, lane_, cell_;
  /// Counts connections of main_; what an earlier one says is of no use.
  std::shared_ptr<int> turn_ = std::make_shared<int>();
  bool was_ready_ = false, warming_ = false;
};

}  // namespace axisd::cell
