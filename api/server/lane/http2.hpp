// gRPC over HTTP/2 for a server of unary calls, without I/O: bytes in, calls out; answers in, bytes out.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "api/server/access.hpp"
#include "buses/clock.hpp"

struct nghttp2_session;

namespace axisd::server::lane {

/// What an answer to a call says: the code and the texts of its gRPC status, and the message where that is
/// OK.
struct Answer {
  int code = 0;
  std::string error;    ///< grpc-message
  std::string details;  ///< grpc-status-details-bin, not encoded yet
  std::string message;  ///< serialised
};

/// One connection's HTTP/2, by nghttp2. Everything that a peer can make it keep is bounded, and so is what it
/// may ask for in a time: whoever asks for more is cut off. Thread: one at a time.
class Http2 {
 public:
  /// A complete request.
  struct Call {
    std::int32_t stream = 0;
    std::string path;  ///< "/axisd.v1.StopService/Stop"
    std::string message;
    std::optional<Duration> patience;  ///< grpc-timeout
    Claim claim;                       ///< of whom it is made for
  };
  /// Called inside receive(), where answer() may be called as well.
  using OnCall = std::function<void(Call call)>;

  /// A stop that names as many axes as there may be fits.
  static constexpr std::size_t largest_message = std::size_t{80} * 1024;
  static constexpr std::size_t largest_headers =
      std::size_t{8} * 1024;  ///< of one request, as HTTP/2 counts them
  static constexpr int most_streams = 100;
  static constexpr std::size_t most_unsent =
      std::size_t{1024} * 1024;  ///< of answers that the peer does not take
  /// Effort that may be spent at once, and in a second: a frame is one unit, and so are 128 bytes, once more
  /// of headers after decompression. A call takes about eight.
  static constexpr double effort_at_once = 8000, effort_per_second = 4000;

  Http2(OnCall on_call, TimePoint now);
  ~Http2();
  Http2(const Http2&) = delete;

  /// Takes in bytes of the peer. False: this is no HTTP/2, or more than a peer may ask for: send what
  /// take_output() has left, and close.
  [[nodiscard]] bool receive(std::string_view bytes, TimePoint now);
  /// Answers a call; without effect if its stream is gone.
  void answer(std::int32_t stream, Answer answer);
  /// Tells the peer to open no more streams here.
  void go_away();
  /// What has to go to the peer next; about `most` bytes. Empty: nothing at present.
  [[nodiscard]] std::string take_output(std::size_t most = std::size_t{64} * 1024);
  /// Calls that were handed out and have not been answered, but for those that the peer took back: what they
  /// asked for is done all the same, and whom to answer is forgotten at once.
  [[nodiscard]] int waiting() const { return waiting_; }
  /// Of the effort that may be spent at once.
  [[nodiscard]] double effort_left(TimePoint now) const;

 private:
  struct Stream;
  struct Callbacks;
  void complete(std::int32_t id, Stream& stream);
  void submit_answer(std::int32_t id, Stream& stream);
  void spend(double effort) { effort_ -= effort; }

  OnCall on_call_;
  std::map<std::int32_t, Stream> streams_;
  int waiting_ = 0;
  std::size_t unsent_ = 0;
  double effort_ = effort_at_once;
  TimePoint refilled_;
  struct Free {
    void operator()(nghttp2_session* session) const;
  };
  std::unique_ptr<nghttp2_session, Free> session_;
};

}  // namespace axisd::server::lane
