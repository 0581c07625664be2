// One connection of a browser: requests one after the other, each with its answer.
#pragma once

#include <boost/beast/core/flat_buffer.hpp>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "api/web/gateway/call.hpp"
#include "api/web/gateway/gateway.hpp"
#include "api/web/gateway/http_answer.hpp"
#include "api/web/gateway/request_parser.hpp"
#include "api/web/gateway/shares.hpp"
#include "api/web/gateway/transport.hpp"
#include "buses/clock.hpp"

namespace axisd::web {

/// Keeps itself until it has ended.
///
///   handshake --> waiting --first byte--> reading --whole--> working --answered--> waiting
///                                           |                   | client gone: the call is cancelled,
///                                           |                   | unless it is a stop
///                                           +--refused--> ending (reads what still comes, for a while)
///
/// While it works it goes on reading, so that a client that leaves is noticed: who sends another request
/// before a call is answered could leave unnoticed, and is cut off. Thread: the gateway's.
class Connection final : public Guest, public std::enable_shared_from_this<Connection> {
 public:
  Connection(Gateway& gateway, Transport transport, std::string peer, Shares::Place place);
  void start();

  void close() override;
  [[nodiscard]] std::optional<TimePoint> idle_since() const override;
  [[nodiscard]] std::uint64_t session() const override { return acting_ ? known_.session : 0; }
  [[nodiscard]] const Person* person() const override { return acting_ ? &known_.person : nullptr; }

 private:
  enum class Phase : std::uint8_t { handshake, waiting, reading, working, ending, closed };
  using Error = boost::system::error_code;
  /// A call that is passed on.
  struct Passing {
    bool stops = false;
    Upstream* daemon = nullptr;  ///< whom it is for
    std::shared_ptr<Call> call{};
    std::optional<Shares::Place> stream{};
  };

  // Reading.
  void wait_for_request();
  void watch();
  void watched(Error error, std::size_t size);
  void read_head();
  void read_body(std::function<void()> then);
  [[nodiscard]] std::string_view header(boost::beast::http::field name) const;
  [[nodiscard]] std::string_view header(std::string_view name) const;

  // What is asked for.
  void handle();
  /// Why nothing is done for it, whatever it asks for.
  [[nodiscard]] std::optional<Answer> objection() const;
  [[nodiscard]] bool same_origin() const;
  /// Who asks; sets known_. `is_use`: it puts off the idle end of a session.
  [[nodiscard]] bool identify(bool is_use);
  void serve_file(std::string_view path);
  void serve_health();
  void serve_session();
  void serve_sessions(std::string_view path);
  void begin_lane();

  // The log-in.
  void log_in();
  void ask_authority(const Credentials& credentials);
  void logged_in(const std::string& name, const std::optional<Admitted>& admitted);
  void refuse_log_in(std::string_view reason, std::string_view message, Duration pause);
  void log_out();

  // A call.
  void begin_call();
  /// What is wrong with its head, whoever asks.
  [[nodiscard]] std::optional<Answer> objection_to_call() const;
  void start_call();
  void pass_on(const grpc::ByteBuffer& message);
  void end_call(const CallStatus& status);

  // Writing.
  void answer(const Answer& answer);
  /// As answer(), where the request's body may not have been read: the connection ends with it.
  void refuse(const Answer& answer);
  void write(std::string bytes, std::function<void()> then);
  void finish();
  void end_gently();
  void drain();
  void limit(Duration duration);

  Gateway& gateway_;
  Transport transport_;
  const std::string peer_;
  std::optional<Shares::Place> place_;  ///< given back when it is closed
  Phase phase_ = Phase::handshake;
  TimePoint since_;  ///< of the phase
  Clock::Timer deadline_;
  std::string certificate_;
  boost::beast::flat_buffer buffer_;
  std::optional<RequestParser> parser_;
  bool watching_ = false, keep_alive_ = false, head_sent_ = false, ever_known_ = false;
  Known known_{};
  bool acting_ = false;  ///< a call is read or carried out
  Passing passing_;      ///< which it is
  std::string out_;
};

}  // namespace axisd::web
