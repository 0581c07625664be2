// The connection to a daemon.
#pragma once

#include <grpcpp/channel.h>
#include <grpcpp/client_context.h>
#include <grpcpp/support/sync_stream.h>

#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <type_traits>

#include "api/axisctl/error.hpp"
#include "api/axisctl/machine_names.hpp"
#include "api/axisctl/stop_lane.hpp"

namespace axisd::axisctl {

struct Connection {
  std::string server = "localhost:7443";  ///< HOST, HOST:PORT or unix:PATH
  std::string stop_server;                ///< of the stop lane; empty: where stop_lane_of() says
  std::string cell;                       ///< an entrance, HOST or HOST:PORT, in place of `server`
  std::string machine;                    ///< of the cell: names without a machine are of this one
  std::string only_machine;               ///< the one that the command line's names are of, if it is one
  std::string lease_machine;              ///< that the token of a lease is of; empty: it was not told
  std::string tls_ca;                     ///< PEM file; TLS is used if it is set
  std::string tls_certificate, tls_key;   ///< PEM files of the client, both or none
  std::string speaks_for;                 ///< USER or USER:ROLE, of a delegate; empty: for itself
  std::chrono::nanoseconds timeout = std::chrono::seconds(10);

  [[nodiscard]] bool through_entrance() const { return !cell.empty(); }
  /// Of the daemon, or of the entrance, with a port.
  [[nodiscard]] std::string address() const;
};

/// Stops, and what renews a jog or a lease, travel on connections of their own, so that nothing this program
/// has open or queued can delay one: to the daemon's stop lane, and where that does not take them, to its
/// main address.
enum class Lane : std::uint8_t { ordinary, stop };

/// What a stream brings, with the names as this program writes them.
template <class Response>
class Answers {
 public:
  /// `machine`: put before the names; empty: they stay as they are.
  Answers(std::unique_ptr<grpc::ClientReader<Response>> reader, std::string machine)
      : reader_(std::move(reader)), machine_(std::move(machine)) {}
  /// False: there are no more.
  bool read(Response& message) {
    if (!reader_->Read(&message)) return false;
    if (!machine_.empty()) put_machine(message, machine_);
    return true;
  }
  grpc::Status finish() { return reader_->Finish(); }

 private:
  std::unique_ptr<grpc::ClientReader<Response>> reader_;
  std::string machine_;
};

/// Connects on first use. Through the entrance of a cell each call goes to the machine that its names are of,
/// and so are the names in its answer ("press-2/feeder"). Thread: any.
class Client {
 public:
  /// Reads the certificates. Throws Failure (usage) if they cannot be read.
  explicit Client(Connection connection);
  /// The same connections, for what names no machine itself: to this one of the cell, and its name is put
  /// before the names in the answers.
  [[nodiscard]] Client at(const std::string& machine) const;

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
    auto sent = request;
    const auto way = way_of(sent);
    Response response;
    if constexpr (!std::is_null_pointer_v<std::remove_const_t<decltype(on_stop_lane<Request>)>>) {
      if (lane == Lane::stop && lane_is_reachable()) {
        // Half of the time is left for the main address.
        const auto status =
            attempt(way, may_be_repeated<Request> ? limit / 2 : limit, v1::StopService::Stub(lane_channel_),
                    on_stop_lane<Request>, sent, response);
        if (status.ok()) return shown(way, std::move(response));
        if (!is_for_the_main_address(status, may_be_repeated<Request>)) throw failure(status, subject);
      }
    }
    const auto status = attempt(way, limit, Stub(channel(lane)), method, sent, response);
    if (!status.ok()) throw failure(status, subject);
    return shown(way, std::move(response));
  }

  /// Streams have no time limit; keep-alive notices a daemon that is gone. Throws Failure (usage) where a
  /// name is wrong. `context` outlives the answers.
  template <class Response, class Stub, class Request>
  [[nodiscard]] Answers<Response> stream(
      grpc::ClientContext& context,
      std::unique_ptr<grpc::ClientReader<Response>> (Stub::*method)(grpc::ClientContext*, const Request&),
      const Request& request) const {
    auto sent = request;
    const auto way = way_of(sent);
    set(context, way);
    Stub stub(channel());
    return {(stub.*method)(&context, sent), way.shown ? way.machine : std::string()};
  }

  /// Lets so much time pass, or less if there is a connection again before. gRPC connects only while somebody
  /// waits.
  void wait_for_connection(Lane lane, std::chrono::milliseconds limit) const;
  [[nodiscard]] Failure failure(const grpc::Status& status, std::string_view subject) const;
  [[nodiscard]] std::chrono::nanoseconds timeout() const { return connection_.timeout; }
  [[nodiscard]] const Connection& connection() const { return connection_; }

 private:
  /// Where a call goes.
  struct Way {
    std::string machine;  ///< empty: to whoever is connected to
    bool shown = false;   ///< the answer's names have it in front
  };
  Client(const Client& other, const std::string& machine);
  /// Takes the machine off the names in the request, and the token of another machine's lease off it: each
  /// counts its own, so that it may be that of somebody's lease there.
  [[nodiscard]] Way way_of(google::protobuf::Message& request) const;
  [[nodiscard]] Way way_to_names(google::protobuf::Message& request) const;
  static void set(grpc::ClientContext& context, const Way& way);
  [[nodiscard]] const std::shared_ptr<grpc::Channel>& channel(Lane lane = Lane::ordinary) const {
    return lane == Lane::stop ? stop_channel_ : channel_;
  }
  /// The answer with its names as they are shown.
  template <class Response>
  static Response shown(const Way& way, Response response) {
    if (way.shown) put_machine(response, way.machine);
    return response;
  }
  /// Waits for it as long as it was not waited for in vain.
  [[nodiscard]] bool lane_is_reachable() const;
  template <class Stub, class Method, class Request, class Response>
  static grpc::Status attempt(const Way& way, std::chrono::nanoseconds limit, Stub&& stub, Method method,
                              const Request& request, Response& response) {
    grpc::ClientContext context;
    set(context, way);
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
