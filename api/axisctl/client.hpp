// The connection to a daemon.
#pragma once

#include <grpcpp/channel.h>
#include <grpcpp/client_context.h>

#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <type_traits>

#include "api/axisctl/error.hpp"
#include "api/axisctl/stop_lane.hpp"

namespace axisd::axisctl {

struct Connection {
  std::string server = "localhost:7443";  ///< HOST, HOST:PORT or unix:PATH
  std::string stop_server;                ///< of the stop lane; empty: where stop_lane_of() says
  std::string tls_ca;                     ///< PEM file; TLS is used if it is set
  std::string tls_certificate, tls_key;   ///< PEM files of the client, both or none
  std::string speaks_for;                 ///< USER or USER:ROLE, of a delegate; empty: for itself
  std::chrono::nanoseconds timeout = std::chrono::seconds(10);
};

/// Stops, and what renews a jog or a lease, travel on connections of their own, so that nothing this program
/// has open or queued can delay one: to the daemon's stop lane, and where that does not take them, to its
/// main address.
enum class Lane : std::uint8_t { ordinary, stop };

/// Connects on first use. Thread: any.
class Client {
 public:
  /// Reads the certificates. Throws Failure (usage) if they cannot be read.
  explicit Client(Connection connection);

  /// One call, with the time limit of --timeout. `subject` leads the text of errors. Throws Failure.
  template <class Response, class Stub, class Request>
  Response call(grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&, Response*),
                const Request& request, std::string_view subject, Lane lane = Lane::ordinary) const {
    return call_within(connection_.timeout, method, request, subject, lane);
  }

  /// The same with another time limit; zero or less: none.
  template <class Response, class Stub, class Request>
  Response call_within(std::chrono::nanoseconds limit,
                       grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&, Response*),
                       const Request& request, std::string_view subject, Lane lane = Lane::ordinary) const {
    if constexpr (!std::is_null_pointer_v<std::remove_const_t<decltype(on_stop_lane<Request>)>>) {
      if (lane == Lane::stop && lane_is_reachable()) {
        // Half of the time is left for the main address.
        Response response;
        const auto status =
            attempt(may_be_repeated<Request> ? limit / 2 : limit, v1::StopService::Stub(lane_channel_),
                    on_stop_lane<Request>, request, response);
        if (status.ok()) return response;
        if (!is_for_the_main_address(status, may_be_repeated<Request>)) throw failure(status, subject);
      }
    }
    Response response;
    if (const auto status = attempt(limit, Stub(channel(lane)), method, request, response); !status.ok())
      throw failure(status, subject);
    return response;
  }

  /// For streams: they have no time limit; keep-alive notices a daemon that is gone.
  [[nodiscard]] const std::shared_ptr<grpc::Channel>& channel(Lane lane = Lane::ordinary) const {
    return lane == Lane::stop ? stop_channel_ : channel_;
  }
  /// Lets so much time pass, or less if there is a connection again before. gRPC connects only while somebody
  /// waits.
  void wait_for_connection(Lane lane, std::chrono::milliseconds limit) const;
  [[nodiscard]] Failure failure(const grpc::Status& status, std::string_view subject) const;
  [[nodiscard]] std::chrono::nanoseconds timeout() const { return connection_.timeout; }

 private:
  /// Waits for it as long as it was not waited for in vain.
  [[nodiscard]] bool lane_is_reachable() const;
  template <class Stub, class Method, class Request, class Response>
  static grpc::Status attempt(std::chrono::nanoseconds limit, Stub&& stub, Method method,
                              const Request& request, Response& response) {
    grpc::ClientContext context;
    if (limit.count() > 0)
      context.set_deadline(std::chrono::system_clock::now() +
                           std::chrono::duration_cast<std::chrono::system_clock::duration>(limit));
    return (stub.*method)(&context, request, &response);
  }

  Connection connection_;
  std::shared_ptr<grpc::Channel> channel_, stop_channel_;
  std::shared_ptr<grpc::Channel> lane_channel_;  ///< nullptr: no address is known
  mutable std::atomic<bool> lane_is_deaf_{false};
};

/// A random UUID (version 4): the request_id of one invocation.
std::string random_uuid();

}  // namespace axisd::axisctl
